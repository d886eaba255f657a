//! A bounding-volume hierarchy over facets: finds the nearest facet that faces the camera.

use nalgebra::Vector3;

use crate::cad::nominal::{Facet, Nearest};

/// Most facets in a leaf.
const LEAF_FACETS: usize = 4;

/// Levels of a tree over 2³² facets, plus one.
const MAX_DEPTH: usize = 33;

/// Facets at a larger incidence are not visible to the camera (cosine, 87°).
const MIN_FACING: f64 = 0.05;

/// A bounding box with its two child nodes or its facets.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    /// The first facet of a leaf, the second child of another node; the first child follows its parent.
    first: u32,
    /// Number of facets; 0 in an inner node.
    n_facets: u32,
}

/// The tree; its owner keeps the facets, in the order of the leaves.
pub(crate) struct Tree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Tree {
    pub(crate) fn new(facets: &[Facet]) -> Self {
        let mut order: Vec<u32> = (0..facets.len() as u32).collect();
        let middles: Vec<Vector3<f64>> =
            facets.iter().map(|f| f.corners.iter().sum::<Vector3<f64>>() / 3.0).collect();
        let mut nodes = Vec::with_capacity(facets.len());
        build(facets, &middles, &mut order, 0, &mut nodes);
        Self { nodes, order }
    }

    /// Indices of the original facets in the order of the leaves.
    pub(crate) fn order(&self) -> &[u32] {
        &self.order
    }

    pub(crate) fn nearest(
        &self,
        facets: &[Facet],
        at: &Vector3<f64>,
        ray: &Vector3<f64>,
        square: f64,
        guess: Option<u32>,
    ) -> Option<Nearest> {
        let mut best: Option<Nearest> = None;
        let mut least = square;
        let mut consider = |idx: u32, least: &mut f64| {
            let facet = &facets[idx as usize];
            if facet.normal.dot(ray) > -MIN_FACING {
                return;
            }
            let (place, region) = facet.nearest(at);
            let square = (at - place).norm_squared();
            if square < *least {
                *least = square;
                best = Some(Nearest { facet: idx, at: place, region });
            }
        };
        if let Some(guess) = guess {
            consider(guess, &mut least);
        }
        let mut stack = [(0u32, 0.0f64); 2 * MAX_DEPTH];
        let mut depth = 1;
        stack[0] = (0, self.nodes[0].square_to(at));
        while depth > 0 {
            depth -= 1;
            let (node_idx, to_box) = stack[depth];
            if to_box >= least {
                continue;
            }
            let node = &self.nodes[node_idx as usize];
            if node.n_facets > 0 {
                (node.first..node.first + node.n_facets).for_each(|idx| consider(idx, &mut least));
                continue;
            }
            let children =
                [node_idx + 1, node.first].map(|child| (child, self.nodes[child as usize].square_to(at)));
            let (near, far) = if children[0].1 <= children[1].1 { (0, 1) } else { (1, 0) };
            stack[depth] = children[far];
            stack[depth + 1] = children[near];
            depth += 2;
        }
        best
    }
}

impl Node {
    #[inline]
    fn square_to(&self, at: &Vector3<f64>) -> f64 {
        let beyond = |k: usize| (self.low[k] - at[k]).max(at[k] - self.high[k]).max(0.0);
        let (x, y, z) = (beyond(0), beyond(1), beyond(2));
        x * x + y * y + z * z
    }
}

fn build(facets: &[Facet], middles: &[Vector3<f64>], order: &mut [u32], first: usize, nodes: &mut Vec<Node>) {
    let empty = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let corners = order.iter().flat_map(|idx| &facets[*idx as usize].corners);
    let (low, high) = corners.fold(empty, |(low, high), corner| (low.inf(corner), high.sup(corner)));
    let (low, high) = (low.into(), high.into());
    let node_idx = nodes.len();
    if order.len() <= LEAF_FACETS {
        nodes.push(Node { low, high, first: first as u32, n_facets: order.len() as u32 });
        return;
    }
    nodes.push(Node { low, high, first: 0, n_facets: 0 });
    let of = order.iter().map(|idx| &middles[*idx as usize]);
    let (low, high) = of.fold(empty, |(low, high), middle| (low.inf(middle), high.sup(middle)));
    let axis = (high - low).imax();
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| {
        middles[*a as usize][axis].total_cmp(&middles[*b as usize][axis]).then(a.cmp(b))
    });
    let (left, right) = order.split_at_mut(half);
    build(facets, middles, left, first, nodes);
    nodes[node_idx].first = nodes.len() as u32;
    build(facets, middles, right, first + half, nodes);
}
