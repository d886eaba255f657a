//! The normal equations of many residuals with a fixed number of parameters: all sizes are compile-time constants, so
//! that the sums compile to vector instructions.

// Matrix loops in mathematical notation.
#![allow(clippy::needless_range_loop)]

use multiversion::multiversion;
use optics::{CAMERA_PARAMETERS, GRATING_PARAMETERS};

use crate::solving::normal::BlockNormal;

/// Pose and residual: the last columns of every row.
const AFTER_GLOBALS: usize = 6 + 1;

/// Columns summed together; the number of columns is a multiple of it.
const STEP: usize = 4;

/// Columns of a corner: camera, pose, residual.
pub const CORNER_COLUMNS: usize = CAMERA_PARAMETERS + AFTER_GLOBALS;

/// Columns of a laser point: camera, a light model of up to [`MAX_ROW_LIGHT_PARAMETERS`], pose, residual.
pub const LASER_COLUMNS: usize = (CAMERA_PARAMETERS + GRATING_PARAMETERS + AFTER_GLOBALS).next_multiple_of(STEP);

/// Most light parameters of a laser point's row.
pub const MAX_ROW_LIGHT_PARAMETERS: usize = LASER_COLUMNS - CAMERA_PARAMETERS - AFTER_GLOBALS;

/// Rows added together: they fit in the L1 cache (15 kB of laser points).
const MAX_ROWS: usize = 64;

/// One residual: its derivatives with respect to the first globals and the pose, then the residual itself.
struct Row<const COLUMNS: usize> {
    values: [f64; COLUMNS],
    weight: f64,
}

/// Rows waiting to be added to the sums of a block.
pub struct Rows<const COLUMNS: usize> {
    rows: Vec<Row<COLUMNS>>,
    products: Products<COLUMNS>,
}

/// Weighted products of the columns, on and above the diagonal (in steps of [`STEP`]: the rest is not used).
type Products<const COLUMNS: usize> = [[f64; COLUMNS]; COLUMNS];

impl<const COLUMNS: usize> Rows<COLUMNS> {
    /// No rows.
    pub fn new() -> Self {
        Self { rows: Vec::with_capacity(MAX_ROWS), products: [[0.0; COLUMNS]; COLUMNS] }
    }

    /// Adds a residual; `by_globals` are its derivatives with respect to the first globals, `weight` is 1/σ² times the
    /// robust weight.
    pub fn push<'a>(
        &mut self,
        by_globals: impl IntoIterator<Item = &'a f64>,
        by_pose: &[f64; 6],
        residual: f64,
        weight: f64,
    ) {
        let mut values = [0.0; COLUMNS];
        let (globals, rest) = values.split_at_mut(COLUMNS - AFTER_GLOBALS);
        for (slot, derivative) in globals.iter_mut().zip(by_globals) {
            *slot = *derivative;
        }
        rest[..6].copy_from_slice(by_pose);
        rest[6] = residual;
        self.rows.push(Row { values, weight });
        if self.rows.len() == MAX_ROWS {
            self.sum_up();
        }
    }

    fn sum_up(&mut self) {
        add_products(&self.rows, &mut self.products);
        self.rows.clear();
    }

    /// Adds all rows to `sums`, equivalent to [`BlockNormal::add`] one by one.
    pub fn add_to(mut self, sums: &mut BlockNormal) {
        self.sum_up();
        let products = &self.products;
        let (pose, last) = (COLUMNS - AFTER_GLOBALS, COLUMNS - 1);
        let n_globals = pose.min(sums.g.len());
        for i in 0..n_globals {
            for j in i..n_globals {
                sums.gg[(i, j)] += products[i][j];
            }
            for j in 0..6 {
                sums.gb[(i, j)] += products[i][pose + j];
            }
            sums.g[i] += products[i][last];
        }
        for i in 0..6 {
            for j in i..6 {
                sums.bb[(i, j)] += products[pose + i][pose + j];
            }
            sums.b[i] += products[pose + i][last];
        }
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn add_products<const COLUMNS: usize>(rows: &[Row<COLUMNS>], products: &mut Products<COLUMNS>) {
    for from in (0..COLUMNS).step_by(STEP) {
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

    /// More than are added together, so that there are several batches.
    const N_ROWS: usize = MAX_ROWS + 7;

    fn check<const COLUMNS: usize>(n_globals: usize) {
        let value = |k: usize| (1.3 * k as f64).sin();
        let (mut fast, mut plain) = (BlockNormal::zeros(n_globals), BlockNormal::zeros(n_globals));
        let mut rows = Rows::<COLUMNS>::new();
        for n in 0..N_ROWS {
            let by_globals: Vec<f64> = (0..n_globals).map(|k| value(40 * n + k)).collect();
            let by_pose: [f64; 6] = std::array::from_fn(|k| value(40 * n + 30 + k));
            let (residual, weight) = (value(40 * n + 36), 1.0 + n as f64 / N_ROWS as f64);
            plain.add(&[(0, &by_globals)], &by_pose, residual, weight);
            rows.push(&by_globals, &by_pose, residual, weight);
        }
        rows.add_to(&mut fast);
        // Rounding of some seventy products near one, weighted by up to two.
        let rounding = 1e-12;
        assert!((&fast.gg - &plain.gg).amax() < rounding && (&fast.gb - &plain.gb).amax() < rounding);
        assert!((fast.bb - plain.bb).amax() < rounding && (fast.b - plain.b).amax() < rounding);
        assert!((fast.g - plain.g).amax() < rounding && plain.gg.amax() > 1.0);
    }

    #[test]
    fn rows_of_corners_added_together_are_rows_added_one_by_one() {
        check::<CORNER_COLUMNS>(CAMERA_PARAMETERS);
    }

    #[test]
    fn rows_of_laser_points_may_have_globals_to_spare() {
        check::<LASER_COLUMNS>(CAMERA_PARAMETERS + GRATING_PARAMETERS);
        check::<LASER_COLUMNS>(CAMERA_PARAMETERS + MAX_ROW_LIGHT_PARAMETERS);
    }
}
