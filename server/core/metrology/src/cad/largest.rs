//! The largest deviation of a surface, without what noise adds to the largest of many cells.
//!
//! Of cells that all deviate equally, the one with the largest noise shows √(2 ln n) of it more; of a dent, whose deepest
//! cell stands alone, little. How much it is follows from the deviations themselves once their noise is filtered
//! (eq. 19, 20 of `docs/maths/metrology.md`).

use std::collections::HashMap;
use std::f64::consts::SQRT_2;

use rayon::prelude::*;
use statrs::function::erf::erfc;

use crate::cad::areas::Cells;
use crate::cad::cell_means::CellMean;
use crate::cad::statistics::LargestDeviation;

/// Cells to either side that the filter averages: the noise of a surface without form falls to a fifth.
const REACH_CELLS: i32 = 2;

/// The largest noise of a billion cells is below so many of their σ.
const MOST_SIGMAS: f64 = 7.0;

/// Halvings that leave 10⁻⁶ of the interval.
const BISECTIONS: usize = 20;

/// The largest deviation of the judged cells; `None` without any. Its U is that of the cell that could deviate most.
pub(crate) fn largest(cells: &Cells, cell_means: &[CellMean]) -> Option<LargestDeviation> {
    let judged: Vec<&CellMean> = cell_means.iter().filter(|cell_mean| cell_mean.is_judged()).collect();
    let reach_mm = |cell_mean: &CellMean| cell_mean.deviation_mm.abs() + cell_mean.expanded_uncertainty_mm();
    let farthest = judged.iter().max_by(|a, b| reach_mm(a).total_cmp(&reach_mm(b)))?;
    let largest_mm = judged.iter().map(|cell_mean| cell_mean.deviation_mm.abs()).fold(0.0, f64::max);
    let noise_mm = noise_of_largest_mm(&judged, &filtered_mm(cells, &judged));
    Some(LargestDeviation {
        deviation_mm: (largest_mm - noise_mm).max(0.0),
        noise_mm,
        u_noise_mm: farthest.u_noise_mm,
        u_shared_mm: farthest.u_shared_mm,
    })
}

/// The deviation of every cell, moved towards the mean of its neighbourhood as far as noise explains the scatter there (the
/// filter of Lee, IEEE PAMI 2(2), 1980): d̂ = m + τ²/(τ² + u²)·(d − m), τ² = s² − ū².
fn filtered_mm(cells: &Cells, judged: &[&CellMean]) -> Vec<f64> {
    let by_key: HashMap<[i32; 3], &CellMean> =
        judged.iter().map(|cell_mean| (cells.key_of(cell_mean.cell), *cell_mean)).collect();
    let weight = |cell_mean: &CellMean| cell_mean.u_noise_mm.max(f64::MIN_POSITIVE).powi(-2);
    let of = |cell_mean: &&CellMean| {
        let centre = cells.key_of(cell_mean.cell);
        let steps = || -REACH_CELLS..=REACH_CELLS;
        let keys = steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| [x, y, z])));
        let beside: Vec<&CellMean> = keys
            .filter_map(|step| by_key.get(&[0, 1, 2].map(|axis| centre[axis] + step[axis])).copied())
            .collect();
        let (n, total) = (beside.len() as f64, beside.iter().map(|one| weight(one)).sum::<f64>());
        let mean = beside.iter().map(|one| weight(one) * one.deviation_mm).sum::<f64>() / total;
        let square = beside.iter().map(|one| weight(one) * (one.deviation_mm - mean).powi(2)).sum::<f64>() / total;
        let form = (square * n / (n - 1.0).max(1.0) - n / total).max(0.0);
        let share = form / (form + cell_mean.u_noise_mm.powi(2)).max(f64::MIN_POSITIVE);
        mean + share * (cell_mean.deviation_mm - mean)
    };
    judged.par_iter().map(of).collect()
}

/// What noise adds to the largest deviation: the median x of the largest of cells with these deviations and their noise,
/// Π Φ((x − d̂)/u)·Φ((x + d̂)/u) = ½, minus the largest |d̂|, mm.
fn noise_of_largest_mm(judged: &[&CellMean], filtered_mm: &[f64]) -> f64 {
    let below = |z: f64| 0.5 * erfc(-z / SQRT_2);
    let is_below_median = |x: f64| {
        let both = |(cell_mean, d): (&&CellMean, &f64)| {
            let u_mm = cell_mean.u_noise_mm.max(f64::MIN_POSITIVE);
            below((x - d) / u_mm) * below((x + d) / u_mm)
        };
        judged.iter().zip(filtered_mm).map(both).product::<f64>() < 0.5
    };
    let largest_mm = filtered_mm.iter().map(|d| d.abs()).fold(0.0, f64::max);
    let most_mm = judged.iter().map(|cell_mean| cell_mean.u_noise_mm).fold(0.0, f64::max);
    let (mut low, mut high) = (largest_mm, largest_mm + MOST_SIGMAS * most_mm);
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(low, high);
        if is_below_median(middle) { low = middle } else { high = middle }
    }
    high - largest_mm
}
