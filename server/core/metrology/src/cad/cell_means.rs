//! Compared points, and their mean deviation per cell of the surface.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::cad::areas::Cells;
use crate::cad::budget::Budget;
use crate::cad::statistics::{DeviationStatistics, WorstDeviation, weighted};
use crate::params::{COVERAGE_FACTOR, MIN_CELL_POINTS, N_WORST_DEVIATIONS, WORST_DEVIATION_CELLS};

/// A cloud point with the nearest point of the surface.
#[derive(Clone, Copy)]
pub(crate) struct ComparedPoint {
    pub(crate) sample: u32,
    pub(crate) facet: u32,
    /// Its cell, if the surface has one at that point.
    pub(crate) cell: Option<u32>,
    pub(crate) deviation_mm: f32,
    /// Fraction of an error along the ray that is along the normal.
    pub(crate) cosine: f32,
    pub(crate) at: Vector3<f32>,
}

/// Mean deviation of a cell.
#[derive(Clone, Copy)]
pub(crate) struct CellMean {
    pub(crate) cell: u32,
    area_mm2: f64,
    at: Vector3<f64>,
    pub(crate) deviation_mm: f64,
    pub(crate) u_noise_mm: f64,
    pub(crate) u_shared_mm: f64,
    n_points: usize,
}

impl CellMean {
    pub(crate) fn expanded_uncertainty_mm(&self) -> f64 {
        COVERAGE_FACTOR * self.u_noise_mm.hypot(self.u_shared_mm)
    }

    pub(crate) fn is_judged(&self) -> bool {
        self.n_points >= MIN_CELL_POINTS
    }
}

/// The mean deviations of all cells with points; also counts the points of every cell.
pub(crate) fn cell_means(
    cells: &mut Cells,
    compared: &[ComparedPoint],
    budgets: &[Budget],
    redundancy: f64,
) -> Vec<CellMean> {
    let mut sums: Vec<(Vector3<f64>, f64, f64, f64, usize)> =
        vec![(Vector3::zeros(), 0.0, 0.0, 0.0, 0); cells.cells.len()];
    for (point, budget) in compared.iter().zip(budgets) {
        let Some(cell) = point.cell else { continue };
        let sum = &mut sums[cell as usize];
        sum.0 += point.at.cast::<f64>();
        sum.1 += f64::from(point.deviation_mm);
        sum.2 += f64::from(budget.noise_mm).powi(2);
        sum.3 += f64::from(budget.shared_mm).powi(2);
        sum.4 += 1;
    }
    let mut cell_means = Vec::new();
    for (idx, (at, deviation, noise, shared, n_points)) in sums.into_iter().enumerate() {
        cells.cells[idx].n_points = n_points;
        if n_points == 0 {
            continue;
        }
        let n = n_points as f64;
        // Neighbouring points of a cell have correlated noise.
        let n_independent = (n / redundancy).max(1.0);
        cell_means.push(CellMean {
            cell: idx as u32,
            area_mm2: cells.cells[idx].area_mm2,
            at: at / n,
            deviation_mm: deviation / n,
            u_noise_mm: (noise / n / n_independent).sqrt(),
            u_shared_mm: (shared / n).sqrt(),
            n_points,
        });
    }
    cell_means
}

pub(crate) fn statistics(
    cells: &Cells,
    compared: &[ComparedPoint],
    cell_means: &[CellMean],
    tolerance_mm: Option<f64>,
    n_samples: usize,
) -> DeviationStatistics {
    let weight = |point: &ComparedPoint| {
        let cell = cells.cells[point.cell? as usize];
        Some((point.deviation_mm, (cell.area_mm2 / cell.n_points as f64) as f32))
    };
    let mut deviations: Vec<(f32, f32)> = compared.par_iter().filter_map(weight).collect();
    let ([mean_mm, rms_mm, std_mm], percentiles_mm) = weighted(&mut deviations);
    let end = |of: Option<&(f32, f32)>| of.map_or(f64::NAN, |(d, _)| f64::from(*d));
    let beyond = |by: &dyn Fn(&CellMean, f64) -> bool| {
        tolerance_mm.map(|tolerance_mm| {
            let out = cell_means.iter().filter(|cell_mean| cell_mean.is_judged() && by(cell_mean, tolerance_mm));
            // Not by `sum`, which gives −0 for none.
            out.fold(0.0, |area, cell_mean| area + cell_mean.area_mm2)
        })
    };
    DeviationStatistics {
        n_points: compared.len(),
        n_beyond: n_samples - compared.len(),
        mean_mm,
        rms_mm,
        std_mm,
        range_mm: [end(deviations.first()), end(deviations.last())],
        percentiles_mm,
        area_mm2: cells.area_mm2(),
        covered_mm2: cell_means.iter().map(|cell_mean| cell_mean.area_mm2).sum(),
        out_of_tolerance_mm2: beyond(&|cell_mean, tolerance_mm| cell_mean.deviation_mm.abs() > tolerance_mm),
        surely_out_of_tolerance_mm2: beyond(&|cell_mean, tolerance_mm| {
            cell_mean.deviation_mm.abs() - cell_mean.expanded_uncertainty_mm() > tolerance_mm
        }),
    }
}

/// The cells with the largest deviations, at a minimum distance from each other.
pub(crate) fn worst(cell_means: &[CellMean], side_mm: f64) -> Vec<WorstDeviation> {
    let mut sorted: Vec<&CellMean> = cell_means.iter().filter(|cell_mean| cell_mean.is_judged()).collect();
    sorted
        .sort_unstable_by(|a, b| b.deviation_mm.abs().total_cmp(&a.deviation_mm.abs()).then(a.cell.cmp(&b.cell)));
    let mut worst: Vec<&CellMean> = Vec::new();
    for cell_mean in sorted {
        if worst.len() == N_WORST_DEVIATIONS {
            break;
        }
        if worst.iter().all(|known| (known.at - cell_mean.at).norm() > WORST_DEVIATION_CELLS * side_mm) {
            worst.push(cell_mean);
        }
    }
    let of = |cell_mean: &&CellMean| WorstDeviation {
        at_mm: cell_mean.at.into(),
        deviation_mm: cell_mean.deviation_mm,
        expanded_uncertainty_mm: cell_mean.expanded_uncertainty_mm(),
        n_points: cell_mean.n_points,
    };
    worst.iter().map(of).collect()
}
