//! Edges along the pixel grid in coarsely sampled pictures.
//!
//! Where light between the samples is lost (rendered pictures with few samples a pixel, sensors with dark gaps, enlarged
//! pictures), an edge is known to a cell of c pixels. An oblique edge crosses many cells in its window, which average
//! out; an edge along the grid stays in one, and its corner is off by up to c/2 although every residual is small. The
//! mean of such a sawtooth over n cells scatters by c²/12 · h(n), h from (1 − n)² to 1/(30 n²).
//!
//! c is what makes the misses of all corners of the board likeliest. Where it is clearly above zero, the coordinate of a
//! corner that sampling spoils is that of the smooth board through all corners, each weighed by its variance.

use super::fit::CornerFit;
use super::params::{
    CELL_MIN_LOG_LIKELIHOOD, CELL_ROUNDS, CELL_START_PX, CELL_STEP_PX, CELL_STEPS, DISAGREEMENT_MIN_SAMPLES,
    SHARED_CELL_SHARE,
};
use super::warp::{BoardWarp, SmoothBoard};
use super::window::{Reach, half_sides};

/// Square of the median of a Gaussian's absolute value.
const MEDIAN_SQUARE: f64 = 0.4549;

/// What an edge's sampling does to its corner.
#[derive(Debug, Clone, Copy)]
struct SampledEdge {
    /// How far the corner's u and v move when the edge moves by one pixel along its normal.
    moves: [f64; 2],
    /// How far the edge strays from the grid's direction within its window (px).
    stray_px: f64,
}

/// A cell size with what goes with it.
struct Cells {
    /// Side of a cell (px).
    cell_px: f64,
    /// Variance of the oblique corners' misses over that of their noise, at least one.
    scale: f64,
    /// Misses of the board that is smooth but for the corner, and the variances of its predictions.
    smooth: SmoothBoard,
    /// By how much likelier (natural logarithm) the misses are than without cells.
    gain: f64,
}

/// Corrects the coordinates that coarse sampling spoils, and states the rest of it in σ.
pub(super) fn allow_for_sampling(fits: &mut [CornerFit], indices: &[[usize; 2]], warp: &BoardWarp, reach: Reach) {
    let places: Vec<[f64; 2]> = indices.iter().map(|index| index.map(|at| at as f64)).collect();
    let edges: Vec<[SampledEdge; 2]> = places.iter().map(|place| sampled_edges(warp, *place, reach)).collect();
    if edges.iter().flatten().all(|edge| edge.stray_px > CELL_STEP_PX * f64::from(CELL_STEPS)) {
        return;
    }
    let pairs: Vec<_> = places.iter().zip(fits.iter()).map(|(place, fit)| (*place, fit.position_px)).collect();
    let noise: Vec<f64> = fits.iter().map(|fit| fit.sigma_px * fit.sigma_px).collect();
    let Some(cells) = cells(&noise, &pairs, &edges, warp).filter(|cells| cells.gain >= CELL_MIN_LOG_LIKELIHOOD)
    else {
        return;
    };
    for (k, fit) in fits.iter_mut().enumerate() {
        let mut variances = [noise[k]; 2];
        for (axis, variance) in variances.iter_mut().enumerate() {
            let sampled = sampling_variance(&edges[k], axis, cells.cell_px);
            *variance += sampled;
            if sampled > cells.scale * noise[k] {
                let (own, board) = (cells.scale * noise[k] + sampled, cells.smooth.variance[k][axis]);
                fit.position_px[axis] -= cells.smooth.miss_px[k][axis] * own / (own + board);
                *variance = own * board / (own + board) + SHARED_CELL_SHARE * sampled;
            }
        }
        fit.sigma_px = (0.5 * (variances[0] + variances[1])).sqrt();
    }
}

/// The likeliest cells; `None` if the corners are too few to tell.
fn cells(
    noise: &[f64],
    pairs: &[([f64; 2], [f64; 2])],
    edges: &[[SampledEdge; 2]],
    warp: &BoardWarp,
) -> Option<Cells> {
    let variances = |cell_px: f64, scale: f64| -> Vec<[f64; 2]> {
        let of = |k: usize| [0, 1].map(|axis| scale * noise[k] + sampling_variance(&edges[k], axis, cell_px));
        (0..noise.len()).map(of).collect()
    };
    let (mut cell_px, mut scale) = (CELL_START_PX, 1.0);
    let mut smooth = SmoothBoard::of_best_degree(warp, pairs, &variances(cell_px, scale))?;
    let mut gain = 0.0;
    for _ in 0..CELL_ROUNDS {
        let own = variances(cell_px, 1.0);
        let coordinates = (0..noise.len()).flat_map(|k| [(k, 0), (k, 1)]);
        let mut ratios: Vec<f64> = coordinates
            .filter(|&(k, axis)| own[k][axis] < 2.0 * noise[k])
            .map(|(k, axis)| smooth.miss_px[k][axis].powi(2) / (noise[k] + smooth.variance[k][axis] / scale))
            .collect();
        if ratios.len() >= DISAGREEMENT_MIN_SAMPLES {
            let middle = ratios.len() / 2;
            scale = (*ratios.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN_SQUARE).max(1.0);
        }
        let likelihood = |cell_px: f64| -> f64 {
            let of = |(k, own): (usize, &[f64; 2])| {
                let [u, v] = [0, 1].map(|axis| {
                    let variance = own[axis] + smooth.variance[k][axis];
                    -0.5 * (variance.ln() + smooth.miss_px[k][axis].powi(2) / variance)
                });
                u + v
            };
            variances(cell_px, scale).iter().enumerate().map(of).sum()
        };
        let tried =
            (1..=CELL_STEPS).map(|step| CELL_STEP_PX * f64::from(step)).map(|cell| (cell, likelihood(cell)));
        let (best, most) = tried.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (cell_px, gain) = (best, most - likelihood(0.0));
        smooth = SmoothBoard::fit(&smooth.warp, pairs, &variances(cell_px, scale))?;
    }
    Some(Cells { cell_px, scale, smooth, gain })
}

fn sampled_edges(warp: &BoardWarp, index: [f64; 2], reach: Reach) -> [SampledEdge; 2] {
    let local = warp.shape_at(index);
    let halves = half_sides(local.square_px, reach);
    // The edge whose normal points to the next column runs along the rows' direction, and the other way round.
    [0, 1].map(|edge| {
        let other = 1 - edge;
        let normal = [local.normal_rad[edge].cos(), local.normal_rad[edge].sin()];
        // Along the other edge the corner moves when this one is shifted.
        let along = local.square_px[edge];
        let across = along[0] * normal[0] + along[1] * normal[1];
        let own = local.square_px[other].map(f64::abs);
        let slope = own[0].min(own[1]) / own[0].max(own[1]);
        SampledEdge { moves: along.map(|a| a / across), stray_px: 2.0 * halves[other] * slope }
    })
}

/// Variance of a corner's coordinate by cells of this size (px²).
fn sampling_variance(edges: &[SampledEdge; 2], axis: usize, cell_px: f64) -> f64 {
    if cell_px == 0.0 {
        return 0.0;
    }
    let of = |edge: &SampledEdge| {
        edge.moves[axis].powi(2) * cell_px * cell_px / 12.0 * share_left(edge.stray_px / cell_px)
    };
    of(&edges[0]) + of(&edges[1])
}

/// What averaging over `n` cells leaves of the variance of a place within its cell: frac(n)²(1 − frac(n))²/n², its mean
/// taken beyond the first cell.
fn share_left(n: f64) -> f64 {
    let within = if n < 1.0 { (1.0 - n) * (1.0 - n) } else { 0.0 };
    within.max(1.0 / 30.0 / n.max(1.0).powi(2))
}
