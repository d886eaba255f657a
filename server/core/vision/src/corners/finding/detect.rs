//! Seeds: labelled corners from the fast search, then from `calib-targets` (ChESS responses, topological grid) in
//! several views of the image.
//!
//! They are initial estimates only: the detector may miss border corners of a dim board and add false ones beyond the
//! border.

use std::collections::BTreeMap;

use calib_targets::chessboard::{
    ChessCorner, ChessboardDetection, ChessboardDetector, ChessboardParams, detect_corners,
};
use calib_targets::detect::{DetectorConfig, ImageRefiner, default_chess_config};

use crate::{GreyImage, Pixels};

use super::fast::fast_seed;
use super::lattice::Node;
use crate::corners::params::{
    DETECTION_MIN_SIDE_PX, DETECTION_THRESHOLDS, DOUBLE_MAX_PIXELS, MIN_SEED_CORNERS, STRETCH_CLIP_FRACTION,
    STRETCH_SAMPLE_STEP,
};

/// Corner positions (px of the original image) by lattice index.
pub type Seed = BTreeMap<Node, [f64; 2]>;

/// A preprocessed version of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
enum View {
    /// Two by two pixels averaged: enough for a seed, at a quarter of the cost.
    Half,
    /// Full resolution: squares of ten to twenty pixels.
    Plain,
    /// Half resolution, each pixel normalised by its surroundings: uneven light.
    Flattened,
    /// Four by four pixels averaged: large, blurred or noisy boards.
    Quarter,
    /// Enlarged twice: squares of a few pixels.
    Double,
}

/// All views, in the order in which they are tried.
const VIEWS: [View; 5] = [View::Half, View::Plain, View::Flattened, View::Quarter, View::Double];

/// A preprocessed, possibly rescaled image for the detector.
struct ScaledImage {
    width: usize,
    height: usize,
    levels: Vec<f32>,
    /// Pixels of the original image per pixel of this one.
    scale: f64,
}

/// Passes seeds to `accept`, from the fast search and the cheapest view to the most tolerant one, until it returns a
/// value.
pub fn search_seeds<T>(image: &GreyImage, mut accept: impl FnMut(&Seed) -> Option<T>) -> Option<T> {
    let fast = fast_seed(image);
    let accepted = if fast.len() >= MIN_SEED_CORNERS { accept(&fast) } else { None };
    accepted.or_else(|| exhaustive_search(image, accept))
}

/// Seeds of all views.
///
/// Within a view the detector's settings are varied: thresholds of the corner response, then tolerances of the grid;
/// the largest grid of each comes first. No seed is passed twice.
pub fn exhaustive_search<T>(image: &GreyImage, mut accept: impl FnMut(&Seed) -> Option<T>) -> Option<T> {
    let too_large = |view: View| view == View::Double && image.width() * image.height() > DOUBLE_MAX_PIXELS;
    for view in VIEWS.into_iter().filter(|view| !too_large(*view)) {
        let scaled = scaled(image, view);
        if scaled.width.min(scaled.height) < DETECTION_MIN_SIDE_PX {
            continue;
        }
        let bytes = stretched(&scaled.levels);
        let frame =
            calib_targets::core::GrayImageView { width: scaled.width, height: scaled.height, data: &bytes };
        let mut offered = Vec::new();
        for threshold in DETECTION_THRESHOLDS {
            let corners = detect_corners(&frame, &front_end(threshold));
            for seed in grids(&corners, threshold).map(|grid| seed_from_detection(&grid, scaled.scale)) {
                if seed.len() < MIN_SEED_CORNERS || offered.contains(&seed) {
                    continue;
                }
                if let Some(accepted) = accept(&seed) {
                    return Some(accepted);
                }
                offered.push(seed);
            }
        }
    }
    None
}

fn front_end(threshold: f32) -> DetectorConfig {
    default_chess_config().with_threshold(threshold).with_refiner(ImageRefiner::saddle_point())
}

/// Grids among the corners, computed lazily.
fn grids(corners: &[ChessCorner], threshold: f32) -> impl Iterator<Item = ChessboardDetection> + '_ {
    ChessboardParams::sweep_default().into_iter().flat_map(move |mut params| {
        params.min_corner_strength = threshold;
        ChessboardDetector::new(params).map(|detector| detector.detect_all(corners)).unwrap_or_default()
    })
}

fn seed_from_detection(detection: &ChessboardDetection, scale: f64) -> Seed {
    let to_original = |x: f32| (f64::from(x) + 0.5) * scale - 0.5;
    let corner = |c: &calib_targets::chessboard::ChessboardCorner| {
        ((c.grid.u, c.grid.v), [to_original(c.position.x), to_original(c.position.y)])
    };
    detection.corners.iter().map(corner).collect()
}

fn scaled(image: &GreyImage, view: View) -> ScaledImage {
    match view {
        View::Plain => plain(image),
        View::Half => binned(&plain(image)),
        View::Quarter => binned(&binned(&plain(image))),
        View::Flattened => flattened(&binned(&plain(image))),
        View::Double => doubled(&plain(image)),
    }
}

fn plain(image: &GreyImage) -> ScaledImage {
    let levels = match image.pixels() {
        Pixels::Eight(p) => p.iter().map(|&l| f32::from(l)).collect(),
        Pixels::Sixteen(p) => p.iter().map(|&l| f32::from(l)).collect(),
    };
    ScaledImage { width: image.width(), height: image.height(), levels, scale: 1.0 }
}

fn binned(scaled: &ScaledImage) -> ScaledImage {
    let (width, height) = ((scaled.width / 2).max(1), (scaled.height / 2).max(1));
    let at = |u: usize, v: usize| scaled.levels[v.min(scaled.height - 1) * scaled.width + u.min(scaled.width - 1)];
    let mean = |u: usize, v: usize| {
        0.25 * (at(2 * u, 2 * v) + at(2 * u + 1, 2 * v) + at(2 * u, 2 * v + 1) + at(2 * u + 1, 2 * v + 1))
    };
    let levels = (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| mean(u, v)).collect();
    ScaledImage { width, height, levels, scale: 2.0 * scaled.scale }
}

fn doubled(scaled: &ScaledImage) -> ScaledImage {
    let (width, height) = (2 * scaled.width, 2 * scaled.height);
    // Bilinear: weights 3/4 and 1/4 of the two nearest pixels.
    let pair = |k: usize, side: usize| {
        let near = k / 2;
        let far = if k.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(side - 1) };
        (near, far)
    };
    let mut levels = Vec::with_capacity(width * height);
    for v in 0..height {
        let (v0, v1) = pair(v, scaled.height);
        for u in 0..width {
            let (u0, u1) = pair(u, scaled.width);
            let at = |u: usize, v: usize| scaled.levels[v * scaled.width + u];
            let rows = [0.75 * at(u0, v0) + 0.25 * at(u1, v0), 0.75 * at(u0, v1) + 0.25 * at(u1, v1)];
            levels.push(0.75 * rows[0] + 0.25 * rows[1]);
        }
    }
    ScaledImage { width, height, levels, scale: 0.5 * scaled.scale }
}

/// Each pixel's difference from the mean of its surroundings over their spread, in a square of a twelfth of the image.
fn flattened(scaled: &ScaledImage) -> ScaledImage {
    let (w, h) = (scaled.width, scaled.height);
    let radius = (w.max(h) / 24).max(4);
    let mut sums = vec![[0.0f64; 2]; (w + 1) * (h + 1)];
    for v in 0..h {
        let mut row = [0.0; 2];
        for u in 0..w {
            let level = f64::from(scaled.levels[v * w + u]);
            row = [row[0] + level, row[1] + level * level];
            let above = sums[v * (w + 1) + u + 1];
            sums[(v + 1) * (w + 1) + u + 1] = [above[0] + row[0], above[1] + row[1]];
        }
    }
    let all = sums[(w + 1) * (h + 1) - 1].map(|s| s / (w * h) as f64);
    let spread_floor = 0.1 * (all[1] - all[0] * all[0]).max(1e-6).sqrt();
    let mut levels = Vec::with_capacity(w * h);
    for v in 0..h {
        let (v0, v1) = (v.saturating_sub(radius), (v + radius + 1).min(h));
        for u in 0..w {
            let (u0, u1) = (u.saturating_sub(radius), (u + radius + 1).min(w));
            let n = ((u1 - u0) * (v1 - v0)) as f64;
            let sum = |k: usize| {
                let at = |u: usize, v: usize| sums[v * (w + 1) + u][k];
                (at(u1, v1) - at(u0, v1) - at(u1, v0) + at(u0, v0)) / n
            };
            let spread = (sum(1) - sum(0) * sum(0)).max(0.0).sqrt().max(spread_floor);
            levels.push(((f64::from(scaled.levels[v * w + u]) - sum(0)) / spread).clamp(-2.0, 2.0) as f32);
        }
    }
    ScaledImage { width: w, height: h, levels, scale: scaled.scale }
}

/// The image as 8-bit levels for the detector, stretched.
pub fn bytes_of(image: &GreyImage) -> Vec<u8> {
    stretched(&plain(image).levels)
}

/// Grey levels between the 0.5 % and 99.5 % quantile (of a sample), stretched to 0–255.
fn stretched(levels: &[f32]) -> Vec<u8> {
    let mut sorted: Vec<f32> = levels.iter().step_by(STRETCH_SAMPLE_STEP).copied().collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let clipped = (STRETCH_CLIP_FRACTION * sorted.len() as f64) as usize;
    let (low, high) = (sorted[clipped], sorted[sorted.len() - 1 - clipped]);
    let gain = if high > low { 255.0 / (high - low) } else { 0.0 };
    levels.iter().map(|l| ((l - low) * gain).round().clamp(0.0, 255.0) as u8).collect()
}
