//! Differences in depth of two orders in one bin, in the order of travel.

use std::collections::VecDeque;

/// The depth of one order above the surface of another; slope and depth without the mean of their frame.
#[derive(Debug, Clone, Copy)]
pub struct Difference {
    /// The frame of the first order.
    pub frame: usize,
    /// The last frame of the surface used.
    pub reference: usize,
    /// Stated travel between the two observations.
    pub travel_mm: f64,
    /// Slope of the surface along the travel.
    pub slope: f64,
    /// Difference in depth.
    pub depth_mm: f64,
    /// Its weight: differences of one line from several surfaces share the line's noise.
    pub weight: f64,
}

/// Sums over differences, weighted, except for `n` and `travel`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    /// Number of differences.
    pub n: f64,
    /// Σ travel, mm.
    pub travel: f64,
    /// Σ 1.
    pub weight: f64,
    /// Σ slope.
    pub slope: f64,
    /// Σ slope².
    pub slope_slope: f64,
    /// Σ depth, mm.
    pub depth: f64,
    /// Σ slope·depth.
    pub slope_depth: f64,
    /// Σ depth².
    pub depth_depth: f64,
}

impl Sums {
    fn with(&self, of: &Difference) -> Self {
        let (slope, depth) = (of.weight * of.slope, of.weight * of.depth_mm);
        Self {
            n: self.n + 1.0,
            travel: self.travel + of.travel_mm,
            weight: self.weight + of.weight,
            slope: self.slope + slope,
            slope_slope: self.slope_slope + slope * of.slope,
            depth: self.depth + depth,
            slope_depth: self.slope_depth + slope * of.depth_mm,
            depth_depth: self.depth_depth + depth * of.depth_mm,
        }
    }

    fn minus(&self, other: &Self) -> Self {
        Self {
            n: self.n - other.n,
            travel: self.travel - other.travel,
            weight: self.weight - other.weight,
            slope: self.slope - other.slope,
            slope_slope: self.slope_slope - other.slope_slope,
            depth: self.depth - other.depth,
            slope_depth: self.slope_depth - other.slope_depth,
            depth_depth: self.depth_depth - other.depth_depth,
        }
    }
}

/// The differences of two orders in one bin.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Each with the sums up to and including it.
    differences: VecDeque<(Difference, Sums)>,
    /// The sums before the first.
    before: Sums,
}

impl Series {
    /// Adds one of a later frame than all others.
    pub fn push(&mut self, difference: Difference) {
        let sums = self.up_to(self.differences.len()).with(&difference);
        self.differences.push_back((difference, sums));
    }

    /// Removes those of frames before `oldest`.
    pub fn forget_before(&mut self, oldest: usize) {
        while let Some((_, sums)) = self.differences.pop_front_if(|(difference, _)| difference.frame < oldest) {
            self.before = sums;
        }
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Difference> {
        self.differences.iter().map(|(difference, _)| difference)
    }

    /// Mean difference; `None` without any.
    pub fn mean_mm(&self) -> Option<f64> {
        let all = self.all();
        (all.n > 0.0).then(|| all.depth / all.weight)
    }

    /// Sums over all.
    pub fn all(&self) -> Sums {
        self.up_to(self.differences.len()).minus(&self.before)
    }

    /// Sums over those between a line from `first_frame` on and a surface from before it.
    pub fn across(&self, first_frame: usize) -> Sums {
        let from = self.differences.partition_point(|(difference, _)| difference.frame < first_frame);
        let to = self.differences.partition_point(|(difference, _)| difference.reference < first_frame);
        if from < to { self.up_to(to).minus(&self.up_to(from)) } else { Sums::default() }
    }

    fn up_to(&self, end: usize) -> Sums {
        end.checked_sub(1).and_then(|last| self.differences.get(last)).map_or(self.before, |(_, sums)| *sums)
    }
}
