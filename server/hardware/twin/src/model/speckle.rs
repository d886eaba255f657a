//! Speckle: the multiplicative grain of coherent light on a rough surface.
//!
//! Sums of |complex Gaussian field|² (Goodman 2007, ch. 4): one look has contrast 1 and an exponential
//! distribution; n equal independent looks have contrast 1/√n. A last, weaker look makes any contrast exact.
//!
//! Speckle belongs to the surface: it changes because the stage carries other grains into the light sheet, not because
//! another image is taken. Between two images Δ of travel apart its correlation is that of the lit strips,
//! exp(−Δ²/4s²) for a sheet of thickness s. Here independent patterns lie [`KNOTS_PER_SIGMA`]·s apart along the travel,
//! and between two of them the grain is cos·first + sin·second: the correlation is within 0.03 of the Gaussian, its sum
//! over all Δ, which determines the mean of many frames, the same.

use rayon::prelude::*;

use crate::model::random::{derived_seed, scrambled};
use crate::params::{SPECKLE_BLOCK_PX, SPECKLE_LOOKS_MAX, SPECKLE_TILE_PX};

/// Full width at half height of a Gaussian in standard deviations.
const FWHM_PER_SIGMA: f64 = 2.354_820;

/// Distance of independent patterns along the travel, in thicknesses of the sheet: π²·√π/8. The correlation between
/// them, (1 − Δ/2h)·cos(πΔ/2h) + sin(πΔ/2h)/π, then has the integral of the Gaussian, 16h/π² = 2√π·s.
const KNOTS_PER_SIGMA: f64 = 2.186_7;

/// A periodic pattern of mean 1 that images sample at random offsets.
#[derive(Debug, Clone)]
pub(crate) struct Speckle {
    tile: Vec<f32>,
}

/// The pattern of a surface at the stage's position.
pub(crate) struct SpeckleView<'s> {
    tile: &'s [f32],
    /// Seed of the surface.
    seed: u64,
    /// Travel in distances of independent patterns.
    knots: f64,
}

/// Sampling of one image block: two offsets in the tile and the weights of the grain there.
struct BlockView {
    places: [(usize, usize); 2],
    weights: [f32; 2],
}

impl Speckle {
    /// A pattern of the given contrast whose grain (full width of the intensity's correlation) is `grain_px`.
    pub(crate) fn new(seed: u64, contrast: f64, grain_px: f64, quantiles: &[f32]) -> Self {
        let n_pixels = SPECKLE_TILE_PX * SPECKLE_TILE_PX;
        if contrast <= 0.0 {
            return Self { tile: vec![1.0; n_pixels] };
        }
        let n_looks = ((1.0 / (contrast * contrast)).ceil() as usize).clamp(1, SPECKLE_LOOKS_MAX);
        let taps = field_taps(grain_px / FWHM_PER_SIGMA);
        let looks: Vec<Vec<f32>> = (0..n_looks)
            .into_par_iter()
            .map(|look| one_look(derived_seed(seed, look as u64), &taps, quantiles))
            .collect();
        let last = last_weight(n_looks, contrast);
        let mut tile = vec![0.0; n_pixels];
        for (idx, look) in looks.iter().enumerate() {
            let weight = if idx + 1 == n_looks { last } else { 1.0 };
            for (slot, value) in tile.iter_mut().zip(look) {
                *slot += weight * value;
            }
        }
        normalise(&mut tile, contrast);
        Self { tile }
    }

    /// The view of the surface `seed` moved by `travel_mm` under sheets of thickness `sheet_sigma_mm` (one σ):
    /// independent of every other surface's, and of its own after a travel longer than the sheet thickness.
    pub(crate) fn view(&self, seed: u64, travel_mm: f64, sheet_sigma_mm: f64) -> SpeckleView<'_> {
        SpeckleView { tile: &self.tile, seed, knots: travel_mm / (KNOTS_PER_SIGMA * sheet_sigma_mm) }
    }
}

impl SpeckleView<'_> {
    /// Fills `target` with a fraction of the light on a run of pixels of row `v` from column `from`, multiplied by the
    /// pattern.
    pub(crate) fn grain(&self, v: usize, from: usize, light: &[f32], fraction: f32, target: &mut [f32]) {
        let mut u = from;
        let to = from + light.len();
        while u < to {
            let block_end = ((u / SPECKLE_BLOCK_PX + 1) * SPECKLE_BLOCK_PX).min(to);
            let BlockView { places, weights: [a, b] } = self.block(u, v);
            let at = places.map(|(right, _)| (u + right) % SPECKLE_TILE_PX);
            let n = at.iter().fold(block_end - u, |n, at| n.min(SPECKLE_TILE_PX - at));
            let [first, second] = [0, 1].map(|idx| {
                let row = (v + places[idx].1) % SPECKLE_TILE_PX * SPECKLE_TILE_PX;
                &self.tile[row + at[idx]..][..n]
            });
            let run = u - from..u - from + n;
            // 1 + a·(first − 1) + b·(second − 1) keeps the mean and, with a² + b² = 1, the contrast.
            let rest = 1.0 - a - b;
            let grains = first.iter().zip(second).map(|(first, second)| rest + a * first + b * second);
            for ((slot, level), grain) in target[run.clone()].iter_mut().zip(&light[run]).zip(grains) {
                *slot = level * grain.max(0.0) * fraction;
            }
            u += n;
        }
    }

    /// Sampling of the block that contains pixel (u, v). Each block changes from one pattern to the next at its own
    /// positions.
    fn block(&self, u: usize, v: usize) -> BlockView {
        let block = ((v / SPECKLE_BLOCK_PX) as u64) << 32 | (u / SPECKLE_BLOCK_PX) as u64;
        let own = scrambled(self.seed ^ block.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let knots = self.knots + own as f64 / u64::MAX as f64;
        let place = |knot: i64| {
            let bits = derived_seed(own, knot as u64);
            (bits as usize % SPECKLE_TILE_PX, (bits >> 32) as usize % SPECKLE_TILE_PX)
        };
        let knot = knots.floor();
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * (knots - knot)).sin_cos();
        BlockView { places: [place(knot as i64), place(knot as i64 + 1)], weights: [cos as f32, sin as f32] }
    }
}

/// Weight x of the last look, so that (n−1+x²)/(n−1+x)² = contrast².
fn last_weight(n_looks: usize, contrast: f64) -> f32 {
    let (n, c2) = (n_looks as f64 - 1.0, contrast * contrast);
    // x²(1−c²) − 2nc²x + n − n²c² = 0; the smaller root lies in 0–1 because 1/(n+1) ≤ c² < 1/n.
    let (a, b, c) = (1.0 - c2, -2.0 * n * c2, n - n * n * c2);
    if a <= f64::EPSILON {
        return 1.0;
    }
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    (((-b - root) / (2.0 * a)).clamp(0.0, 1.0)) as f32
}

/// Normalises to mean 1 and exactly the given contrast (only a tile of many looks changes by more than its sampling
/// error).
fn normalise(tile: &mut [f32], contrast: f64) {
    let n = tile.len() as f64;
    let mean = tile.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
    let variance = tile.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n;
    let segment = (contrast * mean / variance.sqrt()).min(1.0);
    for value in tile {
        *value = (1.0 + (f64::from(*value) - mean) / mean * segment) as f32;
    }
}

/// Gaussian smoothing of the field; the intensity's correlation then has the width of the field filter.
fn field_taps(sigma_px: f64) -> Vec<f32> {
    let radius = (4.0 * sigma_px).ceil().max(1.0) as i64;
    (-radius..=radius).map(|x| (-(x as f64 / sigma_px).powi(2) / 2.0).exp() as f32).collect()
}

fn one_look(seed: u64, taps: &[f32], quantiles: &[f32]) -> Vec<f32> {
    let real = smooth_field(derived_seed(seed, 0), taps, quantiles);
    let imaginary = smooth_field(derived_seed(seed, 1), taps, quantiles);
    real.iter().zip(&imaginary).map(|(re, im)| re * re + im * im).collect()
}

/// White normal noise, smoothed and periodic.
fn smooth_field(seed: u64, taps: &[f32], quantiles: &[f32]) -> Vec<f32> {
    let side = SPECKLE_TILE_PX;
    let mask = quantiles.len() as u64 - 1;
    let mut white = Vec::with_capacity(side * side);
    for word in 0..(side * side / 4) as u64 {
        let bits = scrambled(seed ^ scrambled(word));
        white.extend((0..4).map(|part| quantiles[((bits >> (16 * part)) & mask) as usize]));
    }
    let radius = taps.len() / 2;
    let mut along = vec![0.0; side * side];
    let mut periodic: Vec<f32> = Vec::with_capacity(side + 2 * radius);
    for (row, target) in white.chunks_exact(side).zip(along.chunks_exact_mut(side)) {
        periodic.clear();
        periodic.extend(row[side - radius..].iter().chain(row).chain(&row[..radius]));
        for (tap, weight) in taps.iter().enumerate() {
            for (slot, value) in target.iter_mut().zip(&periodic[tap..]) {
                *slot += weight * value;
            }
        }
    }
    let mut across = vec![0.0; side * side];
    for (v, target) in across.chunks_exact_mut(side).enumerate() {
        for (tap, weight) in taps.iter().enumerate() {
            let start = (v + tap + side - radius) % side * side;
            for (slot, value) in target.iter_mut().zip(&along[start..start + side]) {
                *slot += weight * value;
            }
        }
    }
    across
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::random::normal_quantiles;

    #[test]
    fn the_pattern_has_the_requested_contrast_and_grain() {
        let quantiles = normal_quantiles();
        for contrast in [0.1, 0.3, 0.6, 1.0] {
            let tile = Speckle::new(7, contrast, 3.0, &quantiles).tile;
            let n = tile.len() as f64;
            let mean = tile.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
            let covariance = |shift: usize| {
                let moved = tile.iter().cycle().skip(shift);
                tile.iter().zip(moved).map(|(&a, &b)| (f64::from(a) - mean) * (f64::from(b) - mean)).sum::<f64>()
                    / n
            };
            assert!((mean - 1.0).abs() < 1e-4);
            // 512² pixels contain about 3·10⁴ grains: the sample contrast is accurate to half a per cent.
            assert!((covariance(0).sqrt() - contrast).abs() < 0.01 * contrast, "{contrast}");
            let at_grain = covariance(1) / covariance(0);
            // Half maximum at 1.5 px from the centre: exp(−ln2·(1/1.5)²) = 0.735 at 1 px.
            assert!((at_grain - 0.735).abs() < 0.02, "{contrast}: {at_grain}");
        }
    }

    #[test]
    fn speckle_moves_with_the_surface_through_the_light_sheet() {
        const SHEET_SIGMA_MM: f64 = 0.35;
        let side = 1024;
        let speckle = Speckle::new(7, 0.3, 1.5, &normal_quantiles());
        let image_of = |surface: u64, travel_mm: f64| -> Vec<f32> {
            let view = speckle.view(surface, travel_mm, SHEET_SIGMA_MM);
            let (light, mut row) = (vec![1.0; side], vec![0.0; side]);
            let mut rows = Vec::new();
            for v in 0..side {
                view.grain(v, 0, &light, 1.0, &mut row);
                rows.extend_from_slice(&row);
            }
            rows
        };
        let moments = |a: &[f32], b: &[f32]| {
            let n = a.len() as f64;
            let mean = |values: &[f32]| values.iter().map(|&value| f64::from(value)).sum::<f64>() / n;
            let (mean_a, mean_b) = (mean(a), mean(b));
            let product = |(a, b): (&f32, &f32)| (f64::from(*a) - mean_a) * (f64::from(*b) - mean_b);
            (mean_a, a.iter().zip(b).map(product).sum::<f64>() / n)
        };
        let start = image_of(3, -0.2);
        let (mean, variance) = moments(&start, &start);
        // 64 blocks sample a tile of 3·10⁴ grains: mean and contrast are accurate to a few per cent.
        assert!((mean - 1.0).abs() < 0.01 && (variance.sqrt() - 0.3).abs() < 0.02, "{mean} {variance}");
        for travel_mm in [0.0, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 3.0] {
            let correlation = moments(&start, &image_of(3, travel_mm - 0.2)).1 / variance;
            let expected = (-(travel_mm / SHEET_SIGMA_MM).powi(2) / 4.0).exp();
            // 0.03 from the crossfade itself, and 64 blocks, each at a different phase of it.
            assert!((correlation - expected).abs() < 0.06, "{travel_mm} mm: {correlation}, not {expected}");
        }
        let other = moments(&start, &image_of(4, -0.2)).1 / variance;
        assert!(other.abs() < 0.05, "another surface: {other}");
        assert_eq!(start, image_of(3, -0.2), "the same position shows the same speckle again");
    }
}
