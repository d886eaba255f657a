//! One crossing of a column and a line: position, width, intensity, and the coefficients of its noise.

use super::scatter::{LANES, ThirdDifferences};

/// A measured crossing.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// Row.
    pub v: f64,
    /// Variance from camera noise, px².
    pub camera_variance: f64,
    /// Variance per unit of squared speckle contrast times speckle grain, px².
    pub speckle_variance: f64,
    /// Grey levels above the background.
    pub intensity: f32,
    /// Full width at half height along the column.
    pub width_px: f32,
}

/// Crossings of one line in neighbouring columns, independent of their storage.
pub trait Line {
    /// Columns.
    fn n_columns(&self) -> usize;
    /// The crossing of the column `idx` columns after the first.
    fn at(&self, idx: usize) -> Crossing;
    /// Third differences at a lag, beginning at `start` and at the columns after it, all inside the line.
    fn third_differences(&self, start: usize, lag: usize) -> ThirdDifferences {
        let mut differences = ThirdDifferences::default();
        (0..LANES).for_each(|lane| differences.set(lane, self, start + lane, lag));
        differences
    }
}

impl Line for &[Crossing] {
    fn n_columns(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn at(&self, idx: usize) -> Crossing {
        self[idx]
    }
}
