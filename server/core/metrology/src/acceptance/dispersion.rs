//! How far the points of an artefact scatter about its least-squares feature.

use serde::{Deserialize, Serialize};

use crate::params::{DISPERSION_FRACTION, REJECTED_FRACTION};

/// Scatter of points about a feature.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Dispersion {
    /// Points inside the evaluated region.
    pub n_points: usize,
    /// Points left out of the fit and of `range_mm`: the farthest from the surface, at most 3 ‰.
    pub n_rejected: usize,
    /// Largest minus smallest residual of the other points, mm.
    pub range_mm: f64,
    /// Width of the narrowest band that holds 95 % of all points, mm (D95 of ISO 10360-13).
    pub d95_mm: f64,
}

/// Number of points that may be left out of `n_points` (VDI/VDE 2634).
pub(crate) fn n_rejectable(n_points: usize) -> usize {
    (REJECTED_FRACTION * n_points as f64).floor() as usize
}

/// The scatter of `kept` and `rejected` residuals, mm; `None` without residuals.
pub(crate) fn dispersion(kept_mm: &[f64], rejected_mm: &[f64]) -> Option<Dispersion> {
    let low = kept_mm.iter().copied().min_by(f64::total_cmp)?;
    let high = kept_mm.iter().copied().max_by(f64::total_cmp)?;
    let all: Vec<f64> = kept_mm.iter().chain(rejected_mm).copied().collect();
    Some(Dispersion {
        n_points: all.len(),
        n_rejected: rejected_mm.len(),
        range_mm: high - low,
        d95_mm: narrowest_band_mm(all),
    })
}

/// Width of the narrowest interval that holds [`DISPERSION_FRACTION`] of the values.
fn narrowest_band_mm(mut values_mm: Vec<f64>) -> f64 {
    values_mm.sort_unstable_by(f64::total_cmp);
    let n_inside = (DISPERSION_FRACTION * values_mm.len() as f64).ceil() as usize;
    let widths = values_mm.windows(n_inside.max(1)).map(|inside| inside[inside.len() - 1] - inside[0]);
    widths.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_band_of_95_per_cent_is_the_narrowest_and_the_range_holds_all_that_is_kept() {
        // 96 values 0.01 apart from 0, and four far below: 95 of the 96 span 0.94.
        let mut kept: Vec<f64> = (0..96).map(|idx| f64::from(idx) * 0.01).collect();
        kept.extend([-5.0, -6.0, -7.0]);
        let found = dispersion(&kept, &[-8.0]).unwrap();
        assert_eq!((found.n_points, found.n_rejected), (100, 1));
        assert!((found.range_mm - 7.95).abs() < 1e-12, "{found:?}");
        assert!((found.d95_mm - 0.94).abs() < 1e-12, "{found:?}");
        assert_eq!(dispersion(&[], &[1.0]), None);
    }

    #[test]
    fn three_in_a_thousand_may_be_left_out() {
        assert_eq!([100, 333, 334, 1000, 2001].map(n_rejectable), [0, 0, 1, 3, 6]);
    }
}
