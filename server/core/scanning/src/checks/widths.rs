//! Comparison of line widths with the labels of points (`docs/maths/labelling.md`, "Line widths").

use crate::checks::compare::Surfaces;
use crate::checks::rivals::Rivals;
use crate::error::ScanError;
use crate::input::frames::in_order;
use crate::input::line_widths::{Label, LineWidths, Sample, Width};
use crate::params::{
    CLOSE_TOLERANCES, WIDTH_REJECTED_CONFIRMED_SIGMAS, WIDTH_REJECTED_SIGMAS, WIDTH_STRIDE_POINTS,
    WIDTH_WINDOW_WIDTHS,
};
use crate::points::profile::ProfilePoint;
use crate::points::profiles::Profiles;
use statistics::median;

/// Evidence of line widths for the labels of points.
#[derive(Clone, Copy)]
pub struct Widths<'a> {
    /// Line width as a function of the label.
    pub learned: &'a LineWidths,
    /// The other labels that points could have.
    pub rivals: Rivals<'a>,
}

impl Widths<'_> {
    /// The evidence for every point of a run. `is_confirmed`: whether another order has observed the surface of a
    /// point, by index.
    pub fn of_run(&self, run: &[ProfilePoint], is_confirmed: impl Fn(usize) -> bool) -> Vec<Width> {
        let widths_px: Vec<f64> = run.iter().map(|point| f64::from(point.centreline.width_px)).collect();
        let mut near_px = Vec::new();
        let width = |idx: usize| {
            let reach = (WIDTH_WINDOW_WIDTHS * widths_px[idx]).ceil() as usize;
            near_px.clear();
            near_px.extend_from_slice(&widths_px[idx.saturating_sub(reach)..(idx + reach + 1).min(run.len())]);
            let own = Label { order: run[idx].order, depth_mm: run[idx].hit_in_camera.xyz.z };
            let limit = if is_confirmed(idx) { WIDTH_REJECTED_CONFIRMED_SIGMAS } else { WIDTH_REJECTED_SIGMAS };
            let width_px = median(&mut near_px);
            width_px.map_or(Width::Unclear, |px| self.learned.fit(px, own, self.rivals.labels(&run[idx]), limit))
        };
        (0..run.len()).map(width).collect()
    }
}

/// Fits the model of line widths to points whose label other orders confirm.
///
/// # Errors
/// [`ScanError::UnreadableFrame`].
pub fn learned(profiles: &Profiles, surfaces: &Surfaces) -> Result<LineWidths, ScanError> {
    let of_frame = |frame: usize| -> Result<Vec<Sample>, ScanError> {
        let profile = profiles.of(frame)?;
        let points = profile.points.iter().step_by(WIDTH_STRIDE_POINTS);
        let seen_again = points.filter(|point| surfaces.nearest_tolerances(point, frame) <= CLOSE_TOLERANCES);
        let sample = seen_again.map(|point| Sample {
            label: Label { order: point.order, depth_mm: point.hit_in_camera.xyz.z },
            log_width: f64::from(point.centreline.width_px).ln(),
        });
        Ok(sample.collect())
    };
    let mut samples = Vec::new();
    in_order(profiles.frames.n_frames(), of_frame, |of_frame| {
        samples.extend(of_frame);
        Ok::<(), ScanError>(())
    })?;
    Ok(LineWidths::of(&samples, &profiles.calibration.orders, profiles.depth_range_mm))
}
