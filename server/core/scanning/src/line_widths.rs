//! How wide the lines are at which depth: out of focus they are wider, and a line of another order is one of another depth
//! (`docs/maths/labelling.md`, "Widths").

use optics::DepthRangeMm;

use crate::compare::Surfaces;
use crate::error::ScanError;
use crate::frames::in_order;
use crate::params::{
    CLOSE_TOLERANCES, WIDTH_BINS, WIDTH_BIN_SAMPLES, WIDTH_DENIED_SIGMAS, WIDTH_FIT_ROUNDS, WIDTH_FITS_SIGMAS,
    WIDTH_SIGMA_FLOOR, WIDTH_STRIDE_POINTS,
};
use crate::profiles::Profiles;

/// A line of an order at a depth, and the logarithm of its width in px.
#[derive(Debug, Clone, Copy)]
struct Sample {
    order: i8,
    depth_mm: f64,
    log_width: f64,
}

/// Widths of a scan's lines: ln w = g(depth) + s(order), where they were learned.
#[derive(Debug, Clone, PartialEq)]
pub struct LineWidths {
    near_mm: f64,
    bin_mm: f64,
    /// g in the middle of every bin of depths that has samples enough.
    of_depth: Vec<Option<f64>>,
    /// s, by order.
    of_order: Vec<(i8, f64)>,
    /// Scatter of single points about it.
    sigma: f64,
}

/// What a line's width says about its label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WidthVerdict {
    /// It fits this label and no other.
    Fits,
    /// It does not fit this label, and might fit another.
    Denies,
    /// It tells nothing.
    Silent,
}

impl LineWidths {
    /// Learns from the points whose surface other orders have seen again.
    ///
    /// # Errors
    /// [`ScanError::UnreadableFrame`].
    pub fn learned(profiles: &Profiles, surfaces: &Surfaces) -> Result<Self, ScanError> {
        let of_frame = |frame: usize| -> Result<Vec<Sample>, ScanError> {
            let profile = profiles.of(frame)?;
            let points = profile.points.iter().step_by(WIDTH_STRIDE_POINTS);
            let seen = points.filter(|point| surfaces.is_seen_again(point, frame, CLOSE_TOLERANCES));
            Ok(seen
                .map(|point| Sample {
                    order: point.order,
                    depth_mm: point.hit_in_camera.xyz.z,
                    log_width: f64::from(point.seen.width_px).ln(),
                })
                .collect())
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
        samples.iter().for_each(|sample| by_bin[widths.bin(sample.depth_mm)].push(*sample));
        for _ in 0..WIDTH_FIT_ROUNDS {
            let of_depth = |bin: &Vec<Sample>| {
                let enough = bin.len() >= WIDTH_BIN_SAMPLES;
                enough.then(|| median(bin.iter().map(|sample| sample.log_width - widths.of_order(sample.order))))?
            };
            widths.of_depth = by_bin.iter().map(of_depth).collect();
            let of_order = |&(order, before): &(i8, f64)| {
                let own = samples.iter().filter(|sample| sample.order == order);
                let share = own.filter_map(|sample| Some(sample.log_width - widths.of_depth(sample.depth_mm)?));
                (order, median(share).unwrap_or(before))
            };
            widths.of_order = widths.of_order.iter().map(of_order).collect();
        }
        let misses = samples
            .iter()
            .filter_map(|sample| Some((sample.log_width - widths.expected(sample.order, sample.depth_mm)?).abs()));
        widths.sigma = median(misses).map_or(f64::INFINITY, |mad| (1.4826 * mad).max(WIDTH_SIGMA_FLOOR));
        if std::env::var("WIDTHS").is_ok() {
            eprintln!("{widths:?} of {}", samples.len());
        }
        widths
    }

    /// What a line `width_px` wide says about its label: `depth_mm` under its own order, and (order, depth) of its rivals.
    pub fn verdict(
        &self,
        width_px: f64,
        (order, depth_mm): (i8, f64),
        rivals: impl Iterator<Item = (i8, f64)>,
    ) -> WidthVerdict {
        let log_width = width_px.ln();
        let env = |name: &str, default: f64| std::env::var(name).ok().map_or(default, |t| t.parse().unwrap());
        let (deny, fits, near, against) = (env("DENY", 5.0), env("FITS", 2.5), env("NEAR", 2.5), env("AGAINST", 5.0));
        let miss = |order, depth_mm| self.expected(order, depth_mm).map(|width| (log_width - width).abs() / self.sigma);
        let Some(own) = miss(order, depth_mm) else { return WidthVerdict::Silent };
        let of_rivals: Vec<Option<f64>> = rivals.map(|(order, depth_mm)| miss(order, depth_mm)).collect();
        if of_rivals.is_empty() {
            return WidthVerdict::Silent;
        }
        if own >= deny && of_rivals.iter().any(|rival| rival.is_some_and(|rival| rival < near)) {
            WidthVerdict::Denies
        } else if own <= fits && of_rivals.iter().all(|rival| rival.is_some_and(|rival| rival >= against)) {
            WidthVerdict::Fits
        } else {
            WidthVerdict::Silent
        }
    }

    fn expected(&self, order: i8, depth_mm: f64) -> Option<f64> {
        Some(self.of_depth(depth_mm)? + self.of_order(order))
    }

    fn of_order(&self, order: i8) -> f64 {
        self.of_order.iter().find(|(other, _)| *other == order).map_or(0.0, |(_, share)| *share)
    }

    /// Between the middles of bins it is a straight line.
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

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
