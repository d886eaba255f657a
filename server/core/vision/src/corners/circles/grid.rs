//! Selection of the blobs that form the configured grid.

use std::collections::{BTreeMap, BTreeSet};

use super::super::params::{GRID_MAX_MISS_STEPS, GRID_NEIGHBOURS, GRID_SEEDS};
use super::CircleParams;
use super::blobs::Blob;

/// Blobs by their steps along two directions from a seed.
type Lattice = BTreeMap<[i32; 2], usize>;

/// Rotations of the lattice by multiples of 90°, as matrices of lattice steps.
const QUARTER_TURNS: [[[i32; 2]; 2]; 4] =
    [[[1, 0], [0, 1]], [[0, -1], [1, 0]], [[-1, 0], [0, -1]], [[0, 1], [-1, 0]]];

/// The blobs of the grid, row by row; on failure the size of the largest regular group.
pub(super) fn find_grid(blobs: &[Blob], params: &CircleParams) -> Result<Vec<Blob>, usize> {
    let mut largest = 0;
    for seed in seeds(blobs) {
        for steps in pairs_of_steps(blobs, seed) {
            let lattice = grow(blobs, seed, steps);
            largest = largest.max(lattice.len());
            if lattice.len() >= params.columns * params.rows
                && let Some(grid) = read_grid(blobs, &lattice, params)
            {
                return Ok(grid);
            }
        }
    }
    Err(largest)
}

/// Seed blobs, ordered from the middle of all blobs outwards: central ones have neighbours on every side.
fn seeds(blobs: &[Blob]) -> Vec<usize> {
    let median = |k: usize| {
        let mut values: Vec<f64> = blobs.iter().map(|blob| blob.centre_px[k]).collect();
        statistics::median(&mut values).unwrap_or_default()
    };
    let middle = Blob { centre_px: [median(0), median(1)], spread_px2: [0.0; 3] };
    let mut order: Vec<usize> = (0..blobs.len()).collect();
    order.sort_by(|&a, &b| blobs[a].distance_px(&middle).total_cmp(&blobs[b].distance_px(&middle)));
    order.truncate(GRID_SEEDS);
    order
}

/// Pairs of steps to nearby blobs, short ones first; the two have the same handedness as u and v.
fn pairs_of_steps(blobs: &[Blob], seed: usize) -> Vec<[[f64; 2]; 2]> {
    let mut near: Vec<usize> = (0..blobs.len()).filter(|&k| k != seed).collect();
    near.sort_by(|&a, &b| blobs[a].distance_px(&blobs[seed]).total_cmp(&blobs[b].distance_px(&blobs[seed])));
    near.truncate(GRID_NEIGHBOURS);
    let step = |k: usize| [0, 1].map(|axis| blobs[k].centre_px[axis] - blobs[seed].centre_px[axis]);
    let mut pairs = Vec::new();
    for (n, &a) in near.iter().enumerate() {
        for &b in &near[..n] {
            let (a, b) = (step(a), step(b));
            let (cross, dot) = (a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
            // Not collinear.
            if cross.abs() > 0.3 * dot.abs() {
                pairs.push(if cross > 0.0 { [a, b] } else { [b, a] });
            }
        }
    }
    pairs
}

/// All blobs reached from `seed` by steps that change little from one to the next.
fn grow(blobs: &[Blob], seed: usize, steps: [[f64; 2]; 2]) -> Lattice {
    let mut lattice = Lattice::from([([0, 0], seed)]);
    let mut used = BTreeSet::from([seed]);
    let mut open = std::collections::VecDeque::from([([0, 0], steps)]);
    while let Some((node, steps)) = open.pop_front() {
        let from = blobs[lattice[&node]].centre_px;
        for (axis, sign) in [(0, 1), (1, 1), (0, -1), (1, -1)] {
            let mut next = node;
            next[axis] += sign;
            if lattice.contains_key(&next) {
                continue;
            }
            let step = steps[axis].map(|s| s * f64::from(sign));
            let expected = [from[0] + step[0], from[1] + step[1]];
            let miss = |k: usize| {
                let at = blobs[k].centre_px;
                (at[0] - expected[0]).hypot(at[1] - expected[1])
            };
            let nearest =
                (0..blobs.len()).filter(|k| !used.contains(k)).min_by(|&a, &b| miss(a).total_cmp(&miss(b)));
            let Some(nearest) = nearest.filter(|&k| miss(k) < GRID_MAX_MISS_STEPS * step[0].hypot(step[1])) else {
                continue;
            };
            let mut changed = steps;
            changed[axis] = [0, 1].map(|k| (blobs[nearest].centre_px[k] - from[k]) * f64::from(sign));
            lattice.insert(next, nearest);
            used.insert(nearest);
            open.push_back((next, changed));
        }
    }
    lattice
}

/// The configured grid within the lattice, in the matching orientation whose columns are closest to +u; `None` if it is
/// not found or is found at several positions.
fn read_grid(blobs: &[Blob], lattice: &Lattice, params: &CircleParams) -> Option<Vec<Blob>> {
    // A staggered grid's nearest neighbours are diagonal steps.
    let to_board = |[a, b]: [i32; 2]| if params.staggered { [a - b, a + b] } else { [a, b] };
    let mut best: Option<(f64, Vec<Blob>)> = None;
    for turn in QUARTER_TURNS {
        let turned: BTreeMap<[i32; 2], usize> = lattice
            .iter()
            .map(|(node, blob)| {
                let [x, y] = to_board(*node);
                ([turn[0][0] * x + turn[0][1] * y, turn[1][0] * x + turn[1][1] * y], *blob)
            })
            .collect();
        let at = |origin: [i32; 2]| -> Option<Vec<Blob>> {
            let place = |[column, row]: [usize; 2]| {
                let [x, y] = params.place(column, row);
                turned.get(&[origin[0] + x, origin[1] + y]).map(|&blob| blobs[blob])
            };
            params.indices().map(place).collect()
        };
        let mut fitting = turned.keys().filter_map(|origin| at(*origin));
        let Some(grid) = fitting.next() else { continue };
        if fitting.next().is_some() {
            return None;
        }
        let along = [0, 1].map(|k| grid[params.columns - 1].centre_px[k] - grid[0].centre_px[k]);
        let cosine = along[0] / along[0].hypot(along[1]);
        if best.as_ref().is_none_or(|(most, _)| cosine > *most) {
            best = Some((cosine, grid));
        }
    }
    best.map(|(_, grid)| grid)
}
