//! How wide the lines are at which depth: out of focus they are wider, and another order would put them at another depth
//! (`docs/maths/labelling.md`, "Widths").

use optics::DepthRangeMm;
use statistics::median;

use crate::checks::compare::Surfaces;
use crate::error::ScanError;
use crate::input::frames::in_order;
use crate::params::{
    CLOSE_TOLERANCES, WIDTH_BIN_SAMPLES, WIDTH_BINS, WIDTH_DENIED_SIGMAS, WIDTH_FIT_ROUNDS, WIDTH_FITS_SIGMAS,
    WIDTH_SIGMA_FLOOR, WIDTH_STRIDE_POINTS,
};
use crate::points::profiles::Profiles;

/// A standard deviation is so many median absolute deviations of normal noise.
const SIGMAS_PER_MAD: f64 = 1.4826;

/// An order and the depth that it gives a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Label {
    pub order: i8,
    pub depth_mm: f64,
}

/// A line whose label is known, and the logarithm of its width in px.
#[derive(Debug, Clone, Copy)]
struct Sample {
    label: Label,
    log_width: f64,
}

/// Widths of a scan's lines as learned from it: ln(width) = g(depth) + s(order).
#[derive(Debug, Clone, PartialEq)]
pub struct LineWidths {
    near_mm: f64,
    bin_mm: f64,
    /// g in every bin of depths with samples enough.
    of_depth: Vec<Option<f64>>,
    /// s.
    of_order: Vec<(i8, f64)>,
    /// Scatter of the samples about it; infinite where nothing was learned.
    sigma: f64,
}

impl LineWidths {
    /// Learns from points whose surface other orders have seen again.
    ///
    /// # Errors
    /// [`ScanError::UnreadableFrame`].
    pub fn learned(profiles: &Profiles, surfaces: &Surfaces) -> Result<Self, ScanError> {
        let of_frame = |frame: usize| -> Result<Vec<Sample>, ScanError> {
            let profile = profiles.of(frame)?;
            let points = profile.points.iter().step_by(WIDTH_STRIDE_POINTS);
            let seen_again = points.filter(|point| surfaces.is_seen_again(point, frame, CLOSE_TOLERANCES));
            let sample = seen_again.map(|point| Sample {
                label: Label { order: point.order, depth_mm: point.hit_in_camera.xyz.z },
                log_width: f64::from(point.seen.width_px).ln(),
            });
            Ok(sample.collect())
        };
        let mut samples = Vec::new();
        in_order(profiles.frames.n_frames(), of_frame, |of_frame| {
            samples.extend(of_frame);
            Ok::<(), ScanError>(())
        })?;
        Ok(Self::of(&samples, &profiles.calibration.orders, profiles.depth_range_mm))
    }

    fn of(samples: &[Sample], orders: &[i8], depths: DepthRangeMm) -> Self {
        let mut widths = Self {
            near_mm: depths.near_mm,
            bin_mm: (depths.far_mm - depths.near_mm) / WIDTH_BINS as f64,
            of_depth: vec![None; WIDTH_BINS],
            of_order: orders.iter().map(|&order| (order, 0.0)).collect(),
            sigma: f64::INFINITY,
        };
        let mut by_bin: Vec<Vec<Sample>> = vec![Vec::new(); WIDTH_BINS];
        samples.iter().for_each(|sample| by_bin[widths.bin(sample.label.depth_mm)].push(*sample));
        by_bin.iter_mut().filter(|bin| bin.len() < WIDTH_BIN_SAMPLES).for_each(Vec::clear);
        for _ in 0..WIDTH_FIT_ROUNDS {
            let depth_share = |sample: &Sample| sample.log_width - widths.of_order(sample.label.order);
            let of_depth = by_bin.iter().map(|bin| median_of(bin.iter().map(depth_share))).collect();
            widths.of_depth = of_depth;
            let of_order = |&(order, before): &(i8, f64)| {
                let own = samples.iter().filter(|sample| sample.label.order == order);
                let share =
                    own.filter_map(|sample| Some(sample.log_width - widths.of_depth(sample.label.depth_mm)?));
                (order, median_of(share).unwrap_or(before))
            };
            widths.of_order = widths.of_order.iter().map(of_order).collect();
        }
        let misses =
            samples.iter().filter_map(|sample| Some((sample.log_width - widths.log_width(sample.label)?).abs()));
        widths.sigma =
            median_of(misses).map_or(f64::INFINITY, |mad| (SIGMAS_PER_MAD * mad).max(WIDTH_SIGMA_FLOOR));
        widths
    }

    /// Whether a line `width_px` wide is not as wide as lines are under its own label, but as under one of its rivals.
    pub fn deny(&self, width_px: f64, own: Label, mut rivals: impl Iterator<Item = Label>) -> bool {
        let off_by = |label| self.log_width(label).map(|expected| (width_px.ln() - expected).abs() / self.sigma);
        off_by(own).is_some_and(|off| off >= WIDTH_DENIED_SIGMAS)
            && rivals.any(|rival| off_by(rival).is_some_and(|off| off <= WIDTH_FITS_SIGMAS))
    }

    /// Expected under this label; `None` where no line was seen.
    fn log_width(&self, label: Label) -> Option<f64> {
        Some(self.of_depth(label.depth_mm)? + self.of_order(label.order))
    }

    fn of_order(&self, order: i8) -> f64 {
        self.of_order.iter().find(|(other, _)| *other == order).map_or(0.0, |(_, share)| *share)
    }

    /// Between the middles of two bins a straight line.
    fn of_depth(&self, depth_mm: f64) -> Option<f64> {
        let bin = self.bin(depth_mm);
        let here = self.of_depth[bin]?;
        let from_middle = (depth_mm - self.near_mm) / self.bin_mm - bin as f64 - 0.5;
        let next = if from_middle < 0.0 { bin.checked_sub(1) } else { Some(bin + 1) };
        let there = next.and_then(|next| self.of_depth.get(next).copied().flatten()).unwrap_or(here);
        Some(here + from_middle.abs().min(0.5) * (there - here))
    }

    fn bin(&self, depth_mm: f64) -> usize {
        (((depth_mm - self.near_mm) / self.bin_mm).max(0.0) as usize).min(WIDTH_BINS - 1)
    }
}

fn median_of(values: impl Iterator<Item = f64>) -> Option<f64> {
    median(&mut values.collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEPTHS: DepthRangeMm = DepthRangeMm { near_mm: 340.0, far_mm: 460.0 };

    /// In focus at 400 mm and 5 px wide, √2 times as wide `focus_depth_mm` away; order 1 a fifth wider.
    fn width_px(label: Label, focus_depth_mm: f64) -> f64 {
        let defocus = (1.0 + ((label.depth_mm - 400.0) / focus_depth_mm).powi(2)).sqrt();
        5.0 * defocus * if label.order == 1 { 1.2 } else { 1.0 }
    }

    /// Lines at 360 to 405 mm, their widths off by up to 4 %.
    fn learned(focus_depth_mm: f64) -> LineWidths {
        let sample = |idx: u32| {
            let label = Label { order: (idx % 2) as i8, depth_mm: 360.0 + f64::from(idx % 90) / 2.0 };
            let unrest = 0.04 * f64::from(idx * 7919 % 17) / 8.0 - 0.04;
            Sample { label, log_width: width_px(label, focus_depth_mm).ln() + unrest }
        };
        LineWidths::of(&(0..4000).map(sample).collect::<Vec<_>>(), &[0, 1], DEPTHS)
    }

    /// Whether the true width of a line of order 0 at `true_mm` denies that it is of order 1 at `taken_mm`.
    fn is_denied(widths: &LineWidths, focus_depth_mm: f64, true_mm: f64, taken_mm: f64) -> bool {
        let truth = Label { order: 0, depth_mm: true_mm };
        let taken = Label { order: 1, depth_mm: taken_mm };
        widths.deny(width_px(truth, focus_depth_mm), taken, [truth].into_iter())
    }

    #[test]
    fn a_line_out_of_focus_is_not_taken_for_one_in_focus_nor_the_other_way_round() {
        let widths = learned(20.0);
        assert!(is_denied(&widths, 20.0, 370.0, 400.0) && is_denied(&widths, 20.0, 400.0, 370.0));
        let own = Label { order: 1, depth_mm: 371.0 };
        let rival = Label { order: 0, depth_mm: 400.0 };
        assert!(!widths.deny(width_px(own, 20.0), own, [rival].into_iter()), "as wide as it is to be");
        assert!(!widths.deny(4.0 * width_px(own, 20.0), own, [rival].into_iter()), "nor does it fit the rival");
    }

    #[test]
    fn widths_tell_nothing_where_the_focus_is_deep_or_nothing_was_seen() {
        assert!(!is_denied(&learned(f64::INFINITY), f64::INFINITY, 370.0, 400.0));
        assert!(!is_denied(&learned(20.0), 20.0, 430.0, 400.0), "no line was seen at 430 mm");
        assert!(!is_denied(&LineWidths::of(&[], &[0, 1], DEPTHS), 20.0, 370.0, 400.0));
    }
}
