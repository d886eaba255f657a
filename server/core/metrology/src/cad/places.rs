//! Compared points, and the places of the surface they make together: cells with their means.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::cad::areas::Cells;
use crate::cad::budget::Budget;
use crate::cad::nominal::Nominal;
use crate::cad::statistics::{DeviationStatistics, WorstPlace, weighted};
use crate::interface::part_verdict::PartVerdict;
use crate::interface::verdict::Limits;
use crate::measuring::measure::judged;
use crate::params::{COVERAGE_FACTOR, MIN_CELL_POINTS, WORST_PLACE_CELLS, WORST_PLACES};

/// A point on the surface.
#[derive(Clone, Copy)]
pub(crate) struct Compared {
    pub(crate) sample: u32,
    pub(crate) facet: u32,
    /// Its cell, if the surface has one there.
    pub(crate) cell: Option<u32>,
    pub(crate) deviation_mm: f32,
    /// Share of an error along the ray that is along the normal.
    pub(crate) cosine: f32,
    pub(crate) at: Vector3<f32>,
}

/// A cell with its mean.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    cell: u32,
    area_mm2: f64,
    at: Vector3<f64>,
    deviation_mm: f64,
    u_mm: f64,
    n_points: usize,
}

/// The means of all cells that points were seen in; counts the points of every cell.
pub(crate) fn places(cells: &mut Cells, compared: &[Compared], budgets: &[Budget], redundancy: f64) -> Vec<Place> {
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
    let mut places = Vec::new();
    for (idx, (at, deviation, noise, shared, n_points)) in sums.into_iter().enumerate() {
        cells.cells[idx].n_points = n_points;
        if n_points == 0 {
            continue;
        }
        let n = n_points as f64;
        // Points of one cell share their noise.
        let n_independent = (n / redundancy).max(1.0);
        places.push(Place {
            cell: idx as u32,
            area_mm2: cells.cells[idx].area_mm2,
            at: at / n,
            deviation_mm: deviation / n,
            u_mm: (noise / n / n_independent + shared / n).sqrt(),
            n_points,
        });
    }
    places
}

pub(crate) fn statistics(
    nominal: &Nominal,
    cells: &Cells,
    compared: &[Compared],
    places: &[Place],
    tolerance_mm: Option<f64>,
    n_samples: usize,
) -> DeviationStatistics {
    let weight = |point: &Compared| {
        let cell = cells.cells[point.cell? as usize];
        Some((point.deviation_mm, (cell.area_mm2 / cell.n_points as f64) as f32))
    };
    let mut deviations: Vec<(f32, f32)> = compared.par_iter().filter_map(weight).collect();
    let ([mean_mm, rms_mm, std_mm], percentiles_mm) = weighted(&mut deviations);
    let end = |of: Option<&(f32, f32)>| of.map_or(f64::NAN, |(d, _)| f64::from(*d));
    let beyond = |by: &dyn Fn(&Place, f64) -> bool| {
        tolerance_mm.map(|tolerance_mm| {
            let out = places.iter().filter(|place| place.n_points >= MIN_CELL_POINTS && by(place, tolerance_mm));
            out.map(|place| place.area_mm2).sum()
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
        area_mm2: nominal.area_mm2,
        covered_mm2: places.iter().map(|place| place.area_mm2).sum(),
        out_of_tolerance_mm2: beyond(&|place, tolerance_mm| place.deviation_mm.abs() > tolerance_mm),
        surely_out_of_tolerance_mm2: beyond(&|place, tolerance_mm| {
            place.deviation_mm.abs() - COVERAGE_FACTOR * place.u_mm > tolerance_mm
        }),
    }
}

/// The verdict on the covered surface: the worst of its cells.
pub(crate) fn verdict(places: &[Place], tolerance_mm: f64, is_proven: bool) -> PartVerdict {
    let limits = Limits::symmetric(tolerance_mm);
    let of = |place: &Place| judged(place.deviation_mm, &limits, COVERAGE_FACTOR * place.u_mm, is_proven);
    let all = places.iter().filter(|place| place.n_points >= MIN_CELL_POINTS).map(|place| of(place).into());
    all.max().unwrap_or(PartVerdict::Invalid)
}

/// The cells that are furthest off, some way apart.
pub(crate) fn worst(places: &[Place], side_mm: f64) -> Vec<WorstPlace> {
    let mut sorted: Vec<&Place> = places.iter().filter(|place| place.n_points >= MIN_CELL_POINTS).collect();
    sorted
        .sort_unstable_by(|a, b| b.deviation_mm.abs().total_cmp(&a.deviation_mm.abs()).then(a.cell.cmp(&b.cell)));
    let mut worst: Vec<&Place> = Vec::new();
    for place in sorted {
        if worst.len() == WORST_PLACES {
            break;
        }
        if worst.iter().all(|known| (known.at - place.at).norm() > WORST_PLACE_CELLS * side_mm) {
            worst.push(place);
        }
    }
    let of = |place: &&Place| WorstPlace {
        at_mm: place.at.into(),
        deviation_mm: place.deviation_mm,
        expanded_uncertainty_mm: COVERAGE_FACTOR * place.u_mm,
        n_points: place.n_points,
    };
    worst.iter().map(of).collect()
}
