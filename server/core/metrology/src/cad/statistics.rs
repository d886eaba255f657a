//! Statistics of deviations, weighted by area.

use crate::params::COVERAGE_FACTOR;

/// Deviations of the covered surface, weighted by area.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviationStatistics {
    /// Points that were compared.
    pub n_points: usize,
    /// Points without a surface within reach, or beyond a free edge.
    pub n_beyond: usize,
    /// Mean, mm.
    pub mean_mm: f64,
    /// Root of the mean square, mm.
    pub rms_mm: f64,
    /// Standard deviation, mm.
    pub std_mm: f64,
    /// Smallest and largest deviation of single points, mm.
    pub range_mm: [f64; 2],
    /// Percentiles 2.5 %, 50 % and 97.5 % of the area, mm.
    pub percentiles_mm: [f64; 3],
    /// Area of the surface, or of the part of it that is compared, mm².
    pub area_mm2: f64,
    /// Area covered by points, mm².
    pub covered_mm2: f64,
    /// Area of cells whose mean is out of tolerance, mm²; `None` without a tolerance.
    pub out_of_tolerance_mm2: Option<f64>,
    /// Area of cells whose mean is out of tolerance by more than U, mm².
    pub surely_out_of_tolerance_mm2: Option<f64>,
}

/// A large deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstDeviation {
    /// Position on the surface, datum frame, mm.
    pub at_mm: [f64; 3],
    /// Mean deviation of the cell, mm; positive outside the surface.
    pub deviation_mm: f64,
    /// Its expanded uncertainty, mm.
    pub expanded_uncertainty_mm: f64,
    /// Points in the cell.
    pub n_points: usize,
}

/// The largest deviation of any cell of the surface, corrected for noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargestDeviation {
    /// Its magnitude, mm.
    pub deviation_mm: f64,
    /// What noise added to the largest mean of a cell, mm; it is subtracted.
    pub noise_mm: f64,
    /// Standard uncertainty from the noise of the points, mm.
    pub u_noise_mm: f64,
    /// Standard uncertainty from errors common to the points, mm.
    pub u_shared_mm: f64,
}

impl LargestDeviation {
    /// U (k = 2), mm.
    pub fn expanded_uncertainty_mm(&self) -> f64 {
        COVERAGE_FACTOR * self.u_noise_mm.hypot(self.u_shared_mm)
    }
}

/// Mean, RMS and standard deviation of weighted deviations, and their percentiles 2.5 %, 50 % and 97.5 %.
pub(crate) fn weighted(deviations: &mut [(f32, f32)]) -> ([f64; 3], [f64; 3]) {
    let sum =
        |of: &dyn Fn(f64) -> f64| deviations.iter().map(|(d, w)| f64::from(*w) * of(f64::from(*d))).sum::<f64>();
    let total = sum(&|_| 1.0);
    let (mean, square) = (sum(&|d| d) / total, sum(&|d| d * d) / total);
    let std = (square - mean * mean).max(0.0).sqrt();
    rayon::slice::ParallelSliceMut::par_sort_unstable_by(deviations, |a, b| a.0.total_cmp(&b.0));
    let mut percentiles = [f64::NAN; 3];
    let mut below = 0.0;
    for (d, w) in deviations.iter() {
        below += f64::from(*w);
        for (percentile, share) in percentiles.iter_mut().zip([0.025, 0.5, 0.975]) {
            if percentile.is_nan() && below >= share * total {
                *percentile = f64::from(*d);
            }
        }
    }
    ([mean, square.sqrt(), std], percentiles)
}
