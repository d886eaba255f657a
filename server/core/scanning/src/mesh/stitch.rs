//! Stitches neighbouring profiles of one order into triangles.

use nalgebra::Vector3;
use statistics::median;

use super::{Layer, MeshParams, position};
use crate::points::cloud::CloudPoint;

/// Most pairs of neighbours used for the median spacings.
const MAX_SPACING_SAMPLES: usize = 20_000;

/// Depth steps up to this many σ are noise, not slope.
const NOISE_SIGMAS: f64 = 6.0;

/// Connectivity limits in millimetres.
pub(super) struct Limits {
    /// Longest lateral edge.
    pub(super) edge_mm: f64,
    /// Cell of the coverage grid: half the frame step.
    pub(super) cell_mm: f64,
    max_slope: f64,
}

impl Limits {
    /// Limits from the medians of the spacing along the lines and from frame to frame; `None` without neighbours.
    pub(super) fn from_layers(points: &[CloudPoint], layers: &[Layer], params: &MeshParams) -> Option<Self> {
        let mut across = Vec::new();
        let profiles = || layers.iter().flat_map(|layer| &layer.profiles);
        let n_pairs: usize = profiles().map(|profile| profile.len().saturating_sub(1)).sum();
        let pairs = profiles().flat_map(|profile| profile.windows(2)).step_by(stride(n_pairs));
        let mut along: Vec<f64> = pairs.map(|pair| lateral(points, pair[0], pair[1])).collect();
        for pair in layers.iter().flat_map(|layer| layer.profiles.windows(2)) {
            let stride = (pair[0].len() / 20).max(1);
            across.extend(pair[0].iter().step_by(stride).filter_map(|&from| nearest(points, from, &pair[1])));
        }
        across = across.iter().copied().step_by(stride(across.len())).collect();
        if along.is_empty() || across.is_empty() {
            return None;
        }
        let (line_mm, travel_mm) = (median(&mut along).unwrap_or(0.0), median(&mut across).unwrap_or(0.0));
        let edge_mm = params.max_edge_spacings * line_mm.hypot(travel_mm);
        (edge_mm > 0.0).then_some(Self {
            edge_mm,
            cell_mm: line_mm.max(travel_mm) / 2.0,
            max_slope: params.max_slope,
        })
    }

    fn connects(&self, points: &[CloudPoint], a: u32, b: u32) -> bool {
        let (from, to) = (&points[a as usize], &points[b as usize]);
        let across_mm = lateral(points, a, b);
        let noise_mm = NOISE_SIGMAS * f64::from(from.sigma_mm).hypot(f64::from(to.sigma_mm));
        across_mm <= self.edge_mm && (to.z_mm - from.z_mm).abs() <= self.max_slope * across_mm + noise_mm
    }
}

/// Sampling step for `n` items.
fn stride(n: usize) -> usize {
    n.div_ceil(MAX_SPACING_SAMPLES).max(1)
}

fn lateral(points: &[CloudPoint], a: u32, b: u32) -> f64 {
    let step: Vector3<f64> = position(&points[b as usize]) - position(&points[a as usize]);
    step.xy().norm()
}

fn nearest(points: &[CloudPoint], from: u32, profile: &[u32]) -> Option<f64> {
    profile.iter().map(|&to| lateral(points, from, to)).min_by(f64::total_cmp)
}

/// All triangles between neighbouring profiles whose edges connect.
pub(super) fn triangles(points: &[CloudPoint], layer: &Layer, limits: &Limits) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    for pair in layer.profiles.windows(2) {
        stitch_pair(points, layer.along, (&pair[0], &pair[1]), limits, &mut triangles);
    }
    triangles
}

/// Walks along two profiles in step: the one whose next point comes first along the line advances.
///
/// Distances are not used to choose: where one profile jumps (onto a block and off it), the other would never
/// catch up.
fn stitch_pair(
    points: &[CloudPoint],
    along: fn(&CloudPoint) -> f32,
    (near, far): (&[u32], &[u32]),
    limits: &Limits,
    out: &mut Vec<[u32; 3]>,
) {
    let at = |idx: &u32| along(&points[*idx as usize]);
    let (mut i, mut j) = (0, 0);
    while i + 1 < near.len() || j + 1 < far.len() {
        let along_near = match (near.get(i + 1).map(at), far.get(j + 1).map(at)) {
            (Some(on_near), Some(on_far)) => on_near <= on_far,
            (on_near, _) => on_near.is_some(),
        };
        let triangle = if along_near { [near[i], far[j], near[i + 1]] } else { [near[i], far[j], far[j + 1]] };
        let [a, b, c] = triangle;
        if limits.connects(points, a, b) && limits.connects(points, b, c) && limits.connects(points, c, a) {
            out.push(triangle);
        }
        if along_near {
            i += 1;
        } else {
            j += 1;
        }
    }
}
