//! The normal equations of one picture's corners: camera and pose only, so that all sizes are known beforehand.

// Matrices as they are written.
#![allow(clippy::needless_range_loop)]

use multiversion::multiversion;
use optics::CAMERA_PARAMETERS;

use crate::normal::BlockNormal;

/// Camera, pose, residual.
const COLUMNS: usize = CAMERA_PARAMETERS + 7;

/// One residual: its derivatives by camera and pose, then itself.
pub struct CornerRow {
    values: [f64; COLUMNS],
    weight: f64,
}

impl CornerRow {
    /// A row; `weight` is 1/σ² times the robust weight.
    pub fn new(by_camera: &[f64; CAMERA_PARAMETERS], by_pose: &[f64; 6], residual: f64, weight: f64) -> Self {
        let mut values = [residual; COLUMNS];
        values[..CAMERA_PARAMETERS].copy_from_slice(by_camera);
        values[CAMERA_PARAMETERS..COLUMNS - 1].copy_from_slice(by_pose);
        Self { values, weight }
    }
}

/// Adds the rows to `sums`, as [`BlockNormal::add`] would one by one.
pub fn add_rows(rows: &[CornerRow], sums: &mut BlockNormal) {
    let mut products = [[0.0; COLUMNS]; COLUMNS];
    add_products(rows, &mut products);
    let (camera, last) = (CAMERA_PARAMETERS, COLUMNS - 1);
    for i in 0..camera {
        for j in i..camera {
            sums.gg[(i, j)] += products[i][j];
        }
        for j in 0..6 {
            sums.gb[(i, j)] += products[i][camera + j];
        }
        sums.g[i] += products[i][last];
    }
    for i in 0..6 {
        for j in i..6 {
            sums.bb[(i, j)] += products[camera + i][camera + j];
        }
        sums.b[i] += products[camera + i][last];
    }
}

/// Weighted products of the columns, on and above the diagonal (in steps of four: the rest is not used).
#[multiversion(targets("x86_64+avx2"))]
fn add_products(rows: &[CornerRow], products: &mut [[f64; COLUMNS]; COLUMNS]) {
    const STEP: usize = 4;
    for quarter in 0..COLUMNS / STEP {
        let from = quarter * STEP;
        for row in rows {
            for i in from..from + STEP {
                let weighted = row.weight * row.values[i];
                for j in from..COLUMNS {
                    products[i][j] += weighted * row.values[j];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_added_together_are_rows_added_one_by_one() {
        let value = |k: usize| (1.3 * k as f64).sin();
        let (mut fast, mut plain) = (BlockNormal::zeros(CAMERA_PARAMETERS), BlockNormal::zeros(CAMERA_PARAMETERS));
        let mut rows = Vec::new();
        for n in 0..7 {
            let by_camera: [f64; CAMERA_PARAMETERS] = std::array::from_fn(|k| value(20 * n + k));
            let by_pose: [f64; 6] = std::array::from_fn(|k| value(20 * n + 9 + k));
            let (residual, weight) = (value(20 * n + 15), 1.0 + n as f64);
            plain.add(&[(0, &by_camera)], &by_pose, residual, weight);
            rows.push(CornerRow::new(&by_camera, &by_pose, residual, weight));
        }
        add_rows(&rows, &mut fast);
        // Rounding of seven products near one, weighted by up to seven.
        let rounding = 1e-13;
        assert!((&fast.gg - &plain.gg).amax() < rounding && (&fast.gb - &plain.gb).amax() < rounding);
        assert!((fast.bb - plain.bb).amax() < rounding && (fast.b - plain.b).amax() < rounding);
        assert!((fast.g - plain.g).amax() < rounding && plain.gg.amax() > 1.0);
    }
}
