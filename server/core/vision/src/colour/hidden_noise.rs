//! Noise of a difference before it is clamped at zero.
//!
//! Where a difference is negative on average, clamped levels are mostly zero and seem to have no noise, so that the rest of
//! it would be taken for lines.

use statistics::{SIGMA_PER_MAD, median};

/// Tiles along each side of the image.
const TILES: usize = 16;
/// Samples along each side of a tile.
const SAMPLES: usize = 8;
/// Rows of the boxes whose means are compared: about as many as in the search, where noise that neighbouring pixels share
/// counts more than independent noise.
const BOX_ROWS: usize = 4;
/// Index of the tile, in the order of spreads, whose spread is the noise: that of the darkest surfaces, where light has
/// the least noise of its own, and of no texture or line.
const QUIET_TILE: usize = TILES * TILES / 16;

/// Standard deviation of independent noise of pixels with which boxes would vary as they do; zero for images that are too
/// small to tell. `level`: signed, of a column and row.
pub(super) fn hidden_noise(width: usize, height: usize, level: impl Fn(usize, usize) -> f32) -> f32 {
    let (across, down) = (width / TILES, (height - height.min(2 * BOX_ROWS)) / TILES);
    if across < SAMPLES || down < SAMPLES {
        return 0.0;
    }
    let tile = |idx: usize| {
        let (u0, v0) = (idx % TILES * across, idx / TILES * down);
        let sample = |idx: usize| {
            let (u, v) = (u0 + idx % SAMPLES * across / SAMPLES, v0 + idx / SAMPLES * down / SAMPLES);
            let sum = |from: usize| (from..from + BOX_ROWS).map(|v| level(u, v)).sum::<f32>();
            (sum(v) - sum(v + BOX_ROWS)).abs()
        };
        let mut differences: Vec<f32> = (0..SAMPLES * SAMPLES).map(sample).collect();
        median(&mut differences).unwrap_or(0.0)
    };
    let mut spreads: Vec<f32> = (0..TILES * TILES).map(tile).collect();
    let (_, spread, _) = spreads.select_nth_unstable_by(QUIET_TILE, f32::total_cmp);
    SIGMA_PER_MAD as f32 * *spread / (2.0 * BOX_ROWS as f32).sqrt()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::{CameraImage, CentrelineParams, Channel, GreyImage, Pixels, find_centrelines};

    #[test]
    fn noise_is_found_beside_texture_and_lines() {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let noise: Vec<f32> = (0..320 * 240)
            .map(|idx| {
                let noise: f32 = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
                let (u, v): (usize, usize) = (idx % 320, idx / 320);
                let texture = if u < 160 && v < 120 { (idx * 7919 % 50) as f32 } else { 0.0 };
                let line = if v.abs_diff(180) < 4 { 150.0 } else { 0.0 };
                5.0 * noise + texture + line
            })
            .collect();
        let sigma = hidden_noise(320, 240, |u, v| noise[v * 320 + u]);
        assert!((4.0..5.5).contains(&sigma), "{sigma}");
        assert_eq!(hidden_noise(60, 60, |_, _| 1.0), 0.0);
    }

    /// Laser on and off without a line; the ambient light is a little weaker with the laser on.
    #[test]
    fn clamped_noise_is_not_taken_for_lines() {
        let mut rng = Pcg64Mcg::seed_from_u64(8);
        // Demosaicing and JPEG make neighbouring pixels share noise.
        let mut image = |mean: f32| {
            let white: Vec<f32> = (0..642 * 482).map(|_| 20.0 * (rng.random::<f32>() - 0.5)).collect();
            let level = |idx: usize| {
                let (u, v) = (idx % 640, idx / 640);
                let near = (0..9).map(|k| white[(v + k / 3) * 642 + u + k % 3]).sum::<f32>();
                (mean + near / 3.0).round() as u8
            };
            let levels = (0..640 * 480).map(level).collect();
            CameraImage::Grey(GreyImage::new(640, 480, Pixels::Eight(levels)).unwrap())
        };
        let difference = image(90.0).minus(&image(97.0)).unwrap().channel(Channel::Luma);
        let n_points = |image: &GreyImage| {
            let lines = find_centrelines(image, &CentrelineParams::default());
            lines.segments.iter().map(|segment| segment.points.len()).sum::<usize>()
        };
        assert_eq!(n_points(&difference), 0);
        // What would be found if it were not stated.
        assert!(n_points(&difference.with_hidden_noise(0.0)) > 100);
    }
}
