//! The sensor: light to grey levels with shot and read noise, black level and saturation.

use multiversion::multiversion;

use crate::model::random::{derived_seed, scrambled};
use crate::params::{BLACK_LEVEL, DARK_STRIP_PX, ELECTRONS_PER_LEVEL, QUANTILE_BITS, READ_NOISE_LEVELS};
use crate::render::view::lit_pixels::WORD_PX;

/// Full scale of the light levels used here, for any bit depth.
pub(crate) const FULL_SCALE: f32 = 255.0;

/// Size of the table of normal quantiles.
const QUANTILES: usize = 1 << QUANTILE_BITS;

/// Levels of a 16-bit image per level of an 8-bit one.
const SIXTEEN_PER_EIGHT: f32 = 257.0;

/// Noise on or off; without noise, images are the mean of infinitely many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Noise {
    On,
    Off,
}

/// Converts light (levels of 255 above black) to pixels.
#[derive(Debug, Clone)]
pub(crate) struct Sensor {
    quantiles: Vec<f32>,
    /// A strip of unlit pixels, followed by its first word again.
    dark_eight: Vec<u8>,
    dark_sixteen: Vec<u16>,
    noise: Noise,
}

/// A pixel type.
pub(crate) trait Level: Copy + Send + Sync {
    /// The nearest level, clamped to the type's range.
    fn from_light(level: f32) -> Self;
    /// A strip of unlit pixels.
    fn dark(sensor: &Sensor) -> &[Self];
}

impl Level for u8 {
    #[inline(always)]
    fn from_light(level: f32) -> Self {
        (level + 0.5) as u8
    }

    fn dark(sensor: &Sensor) -> &[Self] {
        &sensor.dark_eight
    }
}

impl Level for u16 {
    #[inline(always)]
    fn from_light(level: f32) -> Self {
        (level * SIXTEEN_PER_EIGHT + 0.5) as u16
    }

    fn dark(sensor: &Sensor) -> &[Self] {
        &sensor.dark_sixteen
    }
}

impl Sensor {
    pub(crate) fn new(quantiles: &[f32], noise: Noise) -> Self {
        let read = if noise == Noise::On { READ_NOISE_LEVELS } else { 0.0 };
        let dark: Vec<f32> = shuffled(quantiles).iter().map(|q| BLACK_LEVEL + read * q).collect();
        Self {
            quantiles: quantiles.to_vec(),
            dark_eight: dark.iter().map(|&level| u8::from_light(level)).collect(),
            dark_sixteen: dark.iter().map(|&level| u16::from_light(level)).collect(),
            noise,
        }
    }

    /// Random bits of pixel (u, v) of an image, independent of how the image is divided: one word serves four pixels.
    #[inline]
    fn bits(row_seed: u64, word: usize) -> u64 {
        scrambled(row_seed.wrapping_add((word as u64).wrapping_mul(0xA076_1D64_78BD_642F)))
    }

    /// Seed of a row of an image.
    pub(crate) fn row_seed(image_seed: u64, v: usize) -> u64 {
        derived_seed(image_seed, v as u64)
    }

    /// Fills `target`, which begins at column `from` (the start of a word) of a row, with unlit pixels: each word from
    /// a random offset of the strip.
    pub(crate) fn expose_dark<L: Level>(&self, row_seed: u64, from: usize, target: &mut [L]) {
        let strip = L::dark(self);
        let place = |word: usize| Self::bits(row_seed, from / 4 + word * (WORD_PX / 4)) as usize % DARK_STRIP_PX;
        let (words, rest) = target.as_chunks_mut::<WORD_PX>();
        let last = words.len();
        for (word, pixels) in words.iter_mut().enumerate() {
            pixels.copy_from_slice(&strip[place(word)..][..WORD_PX]);
        }
        rest.copy_from_slice(&strip[place(last)..][..rest.len()]);
    }

    /// Fills `target`, which begins at column `from` (a multiple of 4) of a row, from the light on it: noise precedes
    /// the amplification by `gain`, black level and saturation follow it.
    pub(crate) fn expose<L: Level>(&self, row_seed: u64, from: usize, light: &[f32], gain: f32, target: &mut [L]) {
        let quantiles: &[f32; QUANTILES] = self.quantiles.as_slice().try_into().expect("as many as were made");
        let noise = if self.noise == Noise::On { gain } else { 0.0 };
        let words = target.chunks_mut(WORD_PX).zip(light.chunks(WORD_PX)).enumerate();
        for (word, (pixels, light)) in words {
            let mut deviates = [0.0; WORD_PX];
            for (four, deviates) in deviates.as_chunks_mut().0.iter_mut().enumerate() {
                let bits = Self::bits(row_seed, from / 4 + word * (WORD_PX / 4) + four);
                *deviates = [0, 16, 32, 48].map(|shift| quantiles[(bits >> shift) as usize % QUANTILES]);
            }
            levels_from_light(light, &deviates, (gain, noise), pixels);
        }
    }
}

/// Grey levels of pixels from the light on them and a normal deviate each.
#[multiversion(targets("x86_64+avx2"))]
fn levels_from_light<L: Level>(
    light: &[f32],
    deviates: &[f32; WORD_PX],
    (gain, noise): (f32, f32),
    pixels: &mut [L],
) {
    for ((pixel, light), deviate) in pixels.iter_mut().zip(light).zip(deviates) {
        let variance = READ_NOISE_LEVELS * READ_NOISE_LEVELS + light / ELECTRONS_PER_LEVEL;
        let level = BLACK_LEVEL + light * gain + noise * variance.sqrt() * deviate;
        *pixel = L::from_light(level.clamp(0.0, FULL_SCALE));
    }
}

/// Quantiles in random order, each equally often, followed by the first word again.
fn shuffled(quantiles: &[f32]) -> Vec<f32> {
    let mut strip: Vec<f32> = quantiles.iter().copied().cycle().take(DARK_STRIP_PX).collect();
    for idx in (1..strip.len()).rev() {
        strip.swap(idx, (scrambled(idx as u64) % (idx as u64 + 1)) as usize);
    }
    strip.extend_from_within(..WORD_PX);
    strip
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::random::normal_quantiles;

    fn dark_rows(sensor: &Sensor, image_seed: u64) -> Vec<f64> {
        let mut rows = vec![0_u16; 1280 * 256];
        for (v, row) in rows.chunks_exact_mut(1280).enumerate() {
            sensor.expose_dark(Sensor::row_seed(image_seed, v), 0, row);
        }
        rows.iter()
            .map(|&level| f64::from(level) / f64::from(SIXTEEN_PER_EIGHT) - f64::from(BLACK_LEVEL))
            .collect()
    }

    #[test]
    fn unlit_pixels_have_independent_read_noise() {
        let sensor = Sensor::new(&normal_quantiles(), Noise::On);
        let (one, other) = (dark_rows(&sensor, 1), dark_rows(&sensor, 2));
        let variance = f64::from(READ_NOISE_LEVELS * READ_NOISE_LEVELS);
        let product =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / variance / a.len() as f64;
        // The normal distribution cut at −2.5 σ, grey level 0: 1 − ((1 − 2.5²)·Q(2.5) + 2.5·φ(2.5)); 1.6 σ of chance.
        assert!((product(&one, &one) - 0.9888).abs() < 0.004, "{}", product(&one, &one));
        // 5 σ of the mean of 3·10⁵ products.
        const CHANCE: f64 = 0.009;
        assert!(product(&one, &other).abs() < CHANCE, "images");
        for shift in [1, 2, WORD_PX, 1280] {
            assert!(product(&one[shift..], &one[..one.len() - shift]).abs() < CHANCE, "{shift} px");
        }
    }

    #[test]
    fn unlit_pixels_do_not_depend_on_how_a_row_is_divided() {
        let sensor = Sensor::new(&normal_quantiles(), Noise::On);
        let (mut whole, mut cut) = ([0_u8; 200], [0_u8; 200]);
        sensor.expose_dark(5, 0, &mut whole);
        for (from, to) in [(0, 64), (64, 192), (192, 200)] {
            sensor.expose_dark(5, from, &mut cut[from..to]);
        }
        assert_eq!(whole, cut);
    }
}
