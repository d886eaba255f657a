//! Decomposition of a covariance into independent steps.

use nalgebra::{DMatrix, DVector};

/// One-σ steps whose outer products sum to `covariance`, largest first.
pub(crate) fn independent_steps(covariance: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let scale: DVector<f64> = covariance.diagonal().map(|v| if v > 0.0 { v.sqrt() } else { 1.0 });
    let correlation = DMatrix::from_fn(scale.len(), scale.len(), |row, column| {
        covariance[(row, column)] / (scale[row] * scale[column])
    });
    let eigen = correlation.symmetric_eigen();
    let mut modes: Vec<(f64, Vec<f64>)> = (0..scale.len())
        .filter(|&idx| eigen.eigenvalues[idx] > 0.0)
        .map(|idx| {
            let size = eigen.eigenvalues[idx].sqrt();
            let mode = eigen.eigenvectors.column(idx).component_mul(&scale) * size;
            (eigen.eigenvalues[idx], mode.iter().copied().collect())
        })
        .collect();
    modes.sort_by(|a, b| b.0.total_cmp(&a.0));
    modes.into_iter().map(|(_, mode)| mode).collect()
}
