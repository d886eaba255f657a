//! The sequence of the frames along the stage, and the view from which surfaces of all frames are compared.

use nalgebra::{Vector2, Vector3};
use optics::{Calibration, DepthRangeMm, LightModelKind};
use statistics::median;
use vision::LineDirection;

use super::gather::reference_view::ReferenceView;
use crate::input::motions::{Chart, FrameMotion};
use crate::params::{AGREEMENT_FLOOR_GRATING, AGREEMENT_FLOOR_PLANES, SYSTEMATIC_SIGMAS};

/// The frames in the sequence of their stage positions.
pub struct Travel {
    /// Frames, sorted by position.
    pub order: Vec<usize>,
    /// Per frame: its index in `order`.
    pub rank: Vec<usize>,
    /// Typical shift from one to the next.
    step_mm: Vector3<f64>,
    /// Shift in the middle of the scan.
    middle_mm: Vector3<f64>,
    /// Chart in which the positions of all frames are compared.
    chart: Chart,
}

impl Travel {
    /// The sequence along the stage's direction, from the motion of the part in each frame; if lines were switched on
    /// one by one (`lit`), all frames of one line before those of the next.
    pub fn of(motions: &[FrameMotion], lit: Option<&[usize]>) -> Self {
        let shifts_mm: Vec<Vector3<f64>> = motions.iter().map(FrameMotion::travel_mm).collect();
        let mut order: Vec<usize> = (0..shifts_mm.len()).collect();
        let whole = shifts_mm.iter().fold(Vector3::zeros(), |longest: Vector3<f64>, shift| {
            let apart = shift - shifts_mm[0];
            if apart.norm() > longest.norm() { apart } else { longest }
        });
        let line = |frame: usize| lit.map_or(0, |lit| lit[frame]);
        let place = |frame: usize| shifts_mm[frame].dot(&whole);
        order.sort_by(|&a, &b| line(a).cmp(&line(b)).then(place(a).total_cmp(&place(b))));
        let mut rank = vec![0; order.len()];
        for (place, &frame) in order.iter().enumerate() {
            rank[frame] = place;
        }
        let mut steps: Vec<f64> =
            order.windows(2).map(|pair| (shifts_mm[pair[1]] - shifts_mm[pair[0]]).norm()).collect();
        let direction = whole.try_normalize(0.0).unwrap_or_default();
        let step_mm = direction * median(&mut steps).unwrap_or(0.0);
        let middle_mm = order.get(order.len() / 2).map_or(Vector3::zeros(), |&frame| shifts_mm[frame]);
        let chart = motions.first().map_or(Chart::Part, FrameMotion::chart);
        Self { order, rank, step_mm, middle_mm, chart }
    }
}

/// The view of the part from the middle of the depth range and of the travel.
pub fn reference_view(
    travel: &Travel,
    calibration: &Calibration,
    depth_range_mm: DepthRangeMm,
    direction: LineDirection,
) -> ReferenceView {
    let reference_depth_mm = depth_range_mm.middle_mm();
    let focal_px = match direction {
        LineDirection::Rows => calibration.camera.fx_px,
        LineDirection::Columns => calibration.camera.fy_px,
    };
    let floor = match calibration.light.kind() {
        LightModelKind::Grating => AGREEMENT_FLOOR_GRATING,
        LightModelKind::Planes | LightModelKind::Pencil => AGREEMENT_FLOOR_PLANES,
    };
    ReferenceView {
        chart: travel.chart,
        middle_shift_mm: travel.middle_mm,
        reference_depth_mm,
        step_mm: Vector2::new(travel.step_mm.x, travel.step_mm.y),
        column_mm: reference_depth_mm / focal_px,
        floor_mm: floor * reference_depth_mm + SYSTEMATIC_SIGMAS * systematic_sigma_mm(calibration),
    }
}

/// Systematic σ of the calibration in the middle of the image, the largest of all orders, mm.
fn systematic_sigma_mm(calibration: &Calibration) -> f64 {
    let camera = &calibration.camera;
    let middle = Vector2::new(camera.width_px as f64, camera.height_px as f64) / 2.0;
    let sigmas = calibration.orders.iter().filter_map(|&order| {
        calibration.systematic_sigma_mm(order, &calibration.triangulate(order, &middle, None)?)
    });
    sigmas.fold(0.0, f64::max)
}
