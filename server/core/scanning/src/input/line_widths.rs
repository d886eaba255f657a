//! Line width as a function of depth: lines out of focus are wider, and another order implies another depth
//! (`docs/maths/labelling.md`, "Line widths", eq. 4).

use optics::DepthRangeMm;
use statistics::{SIGMA_PER_MAD, median};

use crate::params::{
    WIDTH_BIN_SAMPLES, WIDTH_BINS, WIDTH_FIT_ROUNDS, WIDTH_FITS_SIGMAS, WIDTH_HELD_SIGMAS, WIDTH_REJECTED_RATIO,
    WIDTH_RIVAL_SIGMAS, WIDTH_SIGMA_FLOOR,
};

/// An order and the depth of a line under it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Label {
    /// The order.
    pub order: i8,
    /// Depth of the line under this order.
    pub depth_mm: f64,
}

/// Which label the width of a line fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// Its own, and no other.
    Own,
    /// Another one better than its own.
    Rival,
    /// Several, or none.
    Unclear,
}

/// A line with a known label, and the logarithm of its width in px.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Its label.
    pub label: Label,
    /// ln(width).
    pub log_width: f64,
}

/// Widths of a scan's lines, learned from the scan: ln(width) = g(depth) + s(order).
#[derive(Debug, Clone, PartialEq)]
pub struct LineWidths {
    near_mm: f64,
    bin_mm: f64,
    /// g in every depth bin with enough samples.
    of_depth: Vec<Option<f64>>,
    /// s.
    of_order: Vec<(i8, f64)>,
    /// Scatter of the samples about the model; infinite without samples.
    sigma: f64,
}

impl LineWidths {
    /// Fits the model to lines with known labels, within `depths`.
    pub fn of(samples: &[Sample], orders: &[i8], depths: DepthRangeMm) -> Self {
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
        let residuals =
            samples.iter().filter_map(|sample| Some((sample.log_width - widths.log_width(sample.label)?).abs()));
        widths.sigma =
            median_of(residuals).map_or(f64::INFINITY, |mad| (SIGMA_PER_MAD * mad).max(WIDTH_SIGMA_FLOOR));
        widths
    }

    /// Which label a line of `width_px` fits. `limit`: by how many standard deviations it must differ from its own
    /// label's width to fit a rival's.
    pub fn fit(&self, width_px: f64, own: Label, rivals: impl Iterator<Item = Label>, limit: f64) -> Width {
        let log_width = width_px.ln();
        let off_by = |label: Label| self.sigmas_off(log_width, label);
        let (Some(off), Some(own_share)) = (off_by(own), self.of_depth(own.depth_mm)) else {
            return Width::Unclear;
        };
        // At depths with the same line width, rivals differ only by their order's width, which is not enough to reject
        // a label.
        let (mut nearest, mut nearest_elsewhere) = (f64::INFINITY, f64::INFINITY);
        for rival in rivals {
            let (Some(off), Some(share)) = (off_by(rival), self.of_depth(rival.depth_mm)) else { continue };
            nearest = nearest.min(off);
            if (share - own_share).abs() >= WIDTH_FITS_SIGMAS * self.sigma {
                nearest_elsewhere = nearest_elsewhere.min(off);
            }
        }
        if off >= limit && off >= WIDTH_REJECTED_RATIO * nearest_elsewhere.max(WIDTH_FITS_SIGMAS) {
            Width::Rival
        } else if off <= WIDTH_HELD_SIGMAS && (WIDTH_RIVAL_SIGMAS..f64::INFINITY).contains(&nearest) {
            Width::Own
        } else {
            Width::Unclear
        }
    }

    /// Deviation of a line's width from the one expected for a label, in standard deviations; `None` at depths
    /// without samples.
    pub fn sigmas_off(&self, log_width: f64, label: Label) -> Option<f64> {
        Some((log_width - self.log_width(label)?).abs() / self.sigma)
    }

    /// ln of the width expected for this label; `None` at depths without samples.
    fn log_width(&self, label: Label) -> Option<f64> {
        Some(self.of_depth(label.depth_mm)? + self.of_order(label.order))
    }

    fn of_order(&self, order: i8) -> f64 {
        self.of_order.iter().find(|(other, _)| *other == order).map_or(0.0, |(_, share)| *share)
    }

    /// Linear interpolation between the middles of two bins.
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
    use crate::params::WIDTH_REJECTED_SIGMAS;

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
            let noise = 0.04 * f64::from(idx * 7919 % 17) / 8.0 - 0.04;
            Sample { label, log_width: width_px(label, focus_depth_mm).ln() + noise }
        };
        LineWidths::of(&(0..4000).map(sample).collect::<Vec<_>>(), &[0, 1], DEPTHS)
    }

    /// Whether the true width of a line of order 0 at `true_mm` rejects the label of order 1 at `assumed_mm`.
    fn is_rejected(widths: &LineWidths, focus_depth_mm: f64, true_mm: f64, assumed_mm: f64) -> bool {
        let truth = Label { order: 0, depth_mm: true_mm };
        let assumed = Label { order: 1, depth_mm: assumed_mm };
        widths.fit(width_px(truth, focus_depth_mm), assumed, [truth].into_iter(), WIDTH_REJECTED_SIGMAS)
            == Width::Rival
    }

    #[test]
    fn a_line_out_of_focus_is_not_confused_with_one_in_focus() {
        let widths = learned(20.0);
        assert!(is_rejected(&widths, 20.0, 370.0, 400.0) && is_rejected(&widths, 20.0, 400.0, 370.0));
        let own = Label { order: 1, depth_mm: 371.0 };
        let rival = Label { order: 0, depth_mm: 400.0 };
        assert!(
            widths.fit(width_px(own, 20.0), own, [rival].into_iter(), WIDTH_REJECTED_SIGMAS) == Width::Own,
            "the width of its own label"
        );
        assert!(
            widths.fit(4.0 * width_px(own, 20.0), own, [rival].into_iter(), WIDTH_REJECTED_SIGMAS) != Width::Own,
            "a width that fits neither label"
        );
    }

    #[test]
    fn widths_are_no_evidence_where_the_focus_is_deep_or_no_line_was_observed() {
        assert!(!is_rejected(&learned(f64::INFINITY), f64::INFINITY, 370.0, 400.0));
        assert!(!is_rejected(&learned(20.0), 20.0, 430.0, 400.0), "no line was seen at 430 mm");
        assert!(!is_rejected(&LineWidths::of(&[], &[0, 1], DEPTHS), 20.0, 370.0, 400.0));
    }
}
