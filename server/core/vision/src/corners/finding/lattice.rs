//! From a detector's labelled corners to every corner of the board, each verified against the image.
//!
//! The detector only provides the seed. Its corners are fitted, and those that are not chessboard corners are dropped.
//! Then gaps are filled and the lattice grows outwards, as long as a corner of the right polarity and contrast is found
//! where the neighbours predict one.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use statistics::median;

use crate::GreyImage;

use crate::corners::fitting::fit::{CornerFit, fit_corner, start_at};
use crate::corners::fitting::model::CrossShape;
use crate::corners::fitting::warp::edge_normals;
use crate::corners::fitting::window::{Reach, window_around};
use crate::corners::params::{
    BLUR_START_PX, FIRST_WINDOW_BLURS, FIRST_WINDOW_MAX_PX, FIRST_WINDOW_SQUARES, MAX_RESIDUAL_RATIO,
    MAX_SHIFT_SQUARES, MAX_SLOPE_RATIO, MAX_TURN_RAD, MIN_CONTRAST_RATIO, MIN_SEED_CORNERS,
    PRECHECK_MIN_CONTRAST_RATIO, PRECHECK_MIN_SQUARE_PX, RECENTRE_PX,
};

/// Lattice index (i, j); the axes are the detector's, not yet the board's.
pub type Node = (i32, i32);

/// Verified corners of a board.
#[derive(Debug, Clone, Default)]
pub struct Lattice {
    /// Fits by lattice index.
    pub corners: BTreeMap<Node, CornerFit>,
    /// Sign of the contrast at even nodes.
    parity_sign: f64,
    /// Median contrast (levels).
    contrast: f64,
    /// Median blur of the corners (px).
    blur_px: f64,
}

const AXES: [Node; 2] = [(1, 0), (0, 1)];

impl Lattice {
    /// Verifies the seed's corners, then fills gaps and grows the lattice.
    ///
    /// `None` if fewer than [`MIN_SEED_CORNERS`] of the seed are chessboard corners.
    pub fn from_seed(image: &GreyImage, seed: &BTreeMap<Node, [f64; 2]>) -> Option<Self> {
        let mut lattice = Self { blur_px: BLUR_START_PX, ..Self::default() };
        let nodes: Vec<Node> = seed.keys().copied().collect();
        let verify = |&node: &Node| {
            let square_px = spacing(node, |n| seed.get(&n).copied())?;
            Some((node, lattice.fit_at(image, seed[&node], square_px)?))
        };
        let mut fits: BTreeMap<Node, CornerFit> = nodes.par_iter().filter_map(verify).collect();
        lattice.estimate(&fits)?;
        fits.retain(|node, fit| lattice.fits_in(*node, fit));
        lattice.corners = fits;
        lattice.keep_main_component();
        (lattice.corners.len() >= MIN_SEED_CORNERS).then(|| {
            lattice.grow(image);
            lattice
        })
    }

    /// Estimates sign, contrast and blur of the board from corners some of which may be false.
    fn estimate(&mut self, fits: &BTreeMap<Node, CornerFit>) -> Option<()> {
        let vote: f64 = fits.iter().map(|(node, fit)| parity(*node) * fit.contrast).sum();
        self.parity_sign = vote.signum();
        self.contrast = median(&mut fits.values().map(|fit| fit.contrast.abs()).collect::<Vec<f64>>())?;
        self.blur_px = median(&mut fits.values().map(|fit| fit.shape.blur_px).collect::<Vec<f64>>())?;
        Some(())
    }

    fn fits_in(&self, node: Node, fit: &CornerFit) -> bool {
        let contrast = fit.contrast * parity(node) * self.parity_sign;
        contrast >= MIN_CONTRAST_RATIO * self.contrast
            && fit.slope_ratio <= MAX_SLOPE_RATIO
            && fit.residual_rms <= MAX_RESIDUAL_RATIO * contrast
    }

    /// Fits the corner near `start_px`; `None` if there is no crossing with the expected directions.
    fn fit_at(&self, image: &GreyImage, start_px: [f64; 2], square_px: [[f64; 2]; 2]) -> Option<CornerFit> {
        let shortest = square_px.iter().map(|s| s[0].hypot(s[1])).fold(f64::INFINITY, f64::min);
        let normal_rad = edge_normals(square_px);
        let shape =
            CrossShape { normal_rad, curvature_per_px: [0.0; 2], blur_px: self.blur_px.max(BLUR_START_PX) };
        let max_px = FIRST_WINDOW_MAX_PX.max(FIRST_WINDOW_BLURS * shape.blur_px);
        let reach = Reach { squares: FIRST_WINDOW_SQUARES, max_px };
        let fit_from = |centre: [f64; 2], shape: CrossShape| {
            let window = window_around(image, centre, square_px, reach, None);
            fit_corner(&window, start_at(&window, centre, shape)?, None)
        };
        let mut fit = fit_from(start_px, shape)?;
        let shift_px =
            |fit: &CornerFit| (fit.position_px[0] - start_px[0]).hypot(fit.position_px[1] - start_px[1]);
        if shift_px(&fit) > MAX_SHIFT_SQUARES * shortest {
            return None;
        }
        if shift_px(&fit) > RECENTRE_PX {
            fit = fit_from(fit.position_px, fit.shape)?;
        }
        let rotated = |k: usize| angle_between(fit.shape.normal_rad[k], normal_rad[k]).abs() > MAX_TURN_RAD;
        (shift_px(&fit) <= MAX_SHIFT_SQUARES * shortest && !rotated(0) && !rotated(1)).then_some(fit)
    }

    /// Drops corners not connected with the largest connected group.
    fn keep_main_component(&mut self) {
        let mut left: BTreeSet<Node> = self.corners.keys().copied().collect();
        let mut largest = BTreeSet::new();
        while let Some(first) = left.pop_first() {
            let mut group = BTreeSet::from([first]);
            let mut open = vec![first];
            while let Some(node) = open.pop() {
                for neighbour in neighbours(node) {
                    if left.remove(&neighbour) {
                        group.insert(neighbour);
                        open.push(neighbour);
                    }
                }
            }
            if group.len() > largest.len() {
                largest = group;
            }
        }
        self.corners.retain(|node, _| largest.contains(node));
    }

    /// Adds neighbours that are verified until no more are found.
    fn grow(&mut self, image: &GreyImage) {
        let mut refused = BTreeSet::new();
        loop {
            let open: Vec<Node> = self.frontier().into_iter().filter(|node| !refused.contains(node)).collect();
            let found: Vec<_> = open.par_iter().map(|&node| (node, self.try_node(image, node))).collect();
            if found.is_empty() {
                return;
            }
            let before = self.corners.len();
            for (node, fit) in found {
                match fit {
                    Some(fit) => {
                        self.corners.insert(node, fit);
                    }
                    None => {
                        refused.insert(node);
                    }
                }
            }
            if self.corners.len() == before {
                return;
            }
        }
    }

    /// Empty nodes beside a corner.
    fn frontier(&self) -> BTreeSet<Node> {
        self.corners.keys().flat_map(|&n| neighbours(n)).filter(|n| !self.corners.contains_key(n)).collect()
    }

    fn try_node(&self, image: &GreyImage, node: Node) -> Option<CornerFit> {
        let position = |n: Node| self.corners.get(&n).map(|c| c.position_px);
        let predicted = predict(node, position)?;
        let square_px = spacing(node, |n| if n == node { Some(predicted) } else { position(n) })?;
        if !self.alternates(image, node, predicted, square_px) {
            return None;
        }
        let fit = self.fit_at(image, predicted, square_px)?;
        self.fits_in(node, &fit).then_some(fit)
    }

    /// A quick check before the fit: whether the middles of the four squares around `centre` alternate between dark and
    /// bright as required at this node. Small squares and positions at the image border pass unchecked.
    fn alternates(&self, image: &GreyImage, node: Node, centre: [f64; 2], [c, r]: [[f64; 2]; 2]) -> bool {
        if c[0].hypot(c[1]).min(r[0].hypot(r[1])) < PRECHECK_MIN_SQUARE_PX {
            return true;
        }
        let sign = parity(node) * self.parity_sign;
        let square = |i: f64, j: f64| {
            let place = [0, 1].map(|k| (centre[k] + 0.25 * (i * c[k] + j * r[k])).round());
            let inside = |k: usize, side: usize| place[k] >= 1.0 && place[k] < side as f64 - 1.0;
            (inside(0, image.width()) && inside(1, image.height()))
                .then(|| sign * mean_around(image, place[0] as usize, place[1] as usize))
        };
        let [Some(a), Some(b), Some(c), Some(d)] =
            [square(1.0, 1.0), square(-1.0, -1.0), square(1.0, -1.0), square(-1.0, 1.0)]
        else {
            return true;
        };
        a.min(b) - c.max(d) >= PRECHECK_MIN_CONTRAST_RATIO * self.contrast
    }
}

/// Mean of three by three pixels.
fn mean_around(image: &GreyImage, u: usize, v: usize) -> f64 {
    let sum: f32 = (v - 1..=v + 1).flat_map(|y| (u - 1..=u + 1).map(move |x| image.at(x, y))).sum();
    f64::from(sum) / 9.0
}

fn parity((i, j): Node) -> f64 {
    if (i + j).rem_euclid(2) == 0 { 1.0 } else { -1.0 }
}

fn neighbours((i, j): Node) -> [Node; 4] {
    [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
}

/// Steps from `node` to the next node along both axes, from any known neighbours.
///
/// At the border, where an axis has no neighbour, a parallel step beside it is used.
fn spacing(node: Node, position: impl Fn(Node) -> Option<[f64; 2]>) -> Option<[[f64; 2]; 2]> {
    let step = |at: Node, axis: Node| {
        let ahead = position((at.0 + axis.0, at.1 + axis.1));
        let behind = position((at.0 - axis.0, at.1 - axis.1));
        match (behind, position(at), ahead) {
            (Some(a), _, Some(b)) => Some([0.5 * (b[0] - a[0]), 0.5 * (b[1] - a[1])]),
            (Some(a), Some(b), _) | (_, Some(a), Some(b)) => Some([b[0] - a[0], b[1] - a[1]]),
            _ => None,
        }
    };
    let along = |axis: Node| step(node, axis).or_else(|| neighbours(node).into_iter().find_map(|n| step(n, axis)));
    Some([along(AXES[0])?, along(AXES[1])?])
}

/// Where the neighbours predict `node`: midway between two, or extrapolated along a line; averaged over the axes.
fn predict((i, j): Node, position: impl Fn(Node) -> Option<[f64; 2]>) -> Option<[f64; 2]> {
    let mut guesses = Vec::new();
    for (di, dj) in AXES {
        let at = |k: i32| position((i + k * di, j + k * dj));
        let combine = |weights: &[(i32, f64)]| {
            weights
                .iter()
                .try_fold([0.0, 0.0], |sum, &(k, w)| at(k).map(|p| [sum[0] + w * p[0], sum[1] + w * p[1]]))
        };
        let between = combine(&[(-1, 0.5), (1, 0.5)]);
        let continued = [-1, 1].map(|s| {
            combine(&[(s, 3.0), (2 * s, -3.0), (3 * s, 1.0)]).or_else(|| combine(&[(s, 2.0), (2 * s, -1.0)]))
        });
        guesses.extend(between.or(continued[0]).or(continued[1]));
    }
    let n = guesses.len() as f64;
    (n > 0.0).then(|| [0, 1].map(|k| guesses.iter().map(|g| g[k]).sum::<f64>() / n))
}

fn angle_between(a: f64, b: f64) -> f64 {
    let d = a - b;
    d.sin().atan2(d.cos())
}
