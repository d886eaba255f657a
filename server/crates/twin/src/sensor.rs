//! The sensor: light to grey levels with shot and read noise, black level and saturation.

use crate::params::{BLACK_LEVEL, ELECTRONS_PER_LEVEL, QUANTILE_BITS, READ_NOISE_LEVELS};
use crate::random::{derived_seed, scrambled};

/// Full scale in the levels that light is counted in here, whatever the bit depth.
pub(crate) const FULL_SCALE: f32 = 255.0;

/// Values of the table of normal quantiles.
const QUANTILES: usize = 1 << QUANTILE_BITS;

/// Levels of a 16-bit image per level of an 8-bit one.
const SIXTEEN_BY_EIGHT: f32 = 257.0;

/// Noise on or off: without, images are the mean of infinitely many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Noise {
    On,
    Off,
}

/// Turns light (levels of 255 above black) into pixels.
#[derive(Debug, Clone)]
pub(crate) struct Sensor {
    quantiles: Vec<f32>,
    dark_eight: Vec<u8>,
    dark_sixteen: Vec<u16>,
    noise: Noise,
}

/// A pixel type.
pub(crate) trait Level: Copy + Send + Sync {
    /// The nearest level, held within the type's range.
    fn from_light(level: f32) -> Self;
    /// What unlit pixels give, by random index.
    fn dark(sensor: &Sensor) -> &[Self];
}

impl Level for u8 {
    fn from_light(level: f32) -> Self {
        (level + 0.5) as u8
    }

    fn dark(sensor: &Sensor) -> &[Self] {
        &sensor.dark_eight
    }
}

impl Level for u16 {
    fn from_light(level: f32) -> Self {
        (level * SIXTEEN_BY_EIGHT + 0.5) as u16
    }

    fn dark(sensor: &Sensor) -> &[Self] {
        &sensor.dark_sixteen
    }
}

impl Sensor {
    pub(crate) fn new(quantiles: &[f32], noise: Noise) -> Self {
        let read = if noise == Noise::On { READ_NOISE_LEVELS } else { 0.0 };
        let dark: Vec<f32> = quantiles.iter().map(|q| BLACK_LEVEL + read * q).collect();
        Self {
            quantiles: quantiles.to_vec(),
            dark_eight: dark.iter().map(|&level| u8::from_light(level)).collect(),
            dark_sixteen: dark.iter().map(|&level| u16::from_light(level)).collect(),
            noise,
        }
    }

    /// Random bits of pixel (u, v) of a picture, the same however the picture is cut: one word serves four pixels.
    #[inline]
    fn bits(row_seed: u64, word: usize) -> u64 {
        scrambled(row_seed.wrapping_add((word as u64).wrapping_mul(0xA076_1D64_78BD_642F)))
    }

    /// The seed of a row of a picture.
    pub(crate) fn row_seed(picture_seed: u64, v: usize) -> u64 {
        derived_seed(picture_seed, v as u64)
    }

    /// Fills `target`, which begins at column `from` (a multiple of 4) of a row, with unlit pixels.
    pub(crate) fn expose_dark<L: Level>(&self, row_seed: u64, from: usize, target: &mut [L]) {
        let table: &[L; QUANTILES] = L::dark(self).try_into().expect("a level per quantile was made");
        let (fours, rest) = target.as_chunks_mut();
        let last = fours.len();
        for (word, slots) in fours.iter_mut().enumerate() {
            *slots = dark_four(table, Self::bits(row_seed, from / 4 + word));
        }
        if !rest.is_empty() {
            let four = dark_four(table, Self::bits(row_seed, from / 4 + last));
            rest.copy_from_slice(&four[..rest.len()]);
        }
    }

    /// Fills `target`, which begins at column `from` (a multiple of 4) of a row, from the light on it: noise comes
    /// before the amplification by `gain`, black level and saturation after it.
    pub(crate) fn expose<L: Level>(&self, row_seed: u64, from: usize, light: &[f32], gain: f32, target: &mut [L]) {
        let quantiles: &[f32; QUANTILES] = self.quantiles.as_slice().try_into().expect("as many as were made");
        let on = if self.noise == Noise::On { gain } else { 0.0 };
        let four = |word: usize, light: [f32; 4]| {
            let bits = Self::bits(row_seed, from / 4 + word);
            let deviates = [0, 16, 32, 48].map(|shift| quantiles[(bits >> shift) as usize % QUANTILES]);
            let levels: [f32; 4] = std::array::from_fn(|part| {
                let variance = READ_NOISE_LEVELS * READ_NOISE_LEVELS + light[part] / ELECTRONS_PER_LEVEL;
                let level = BLACK_LEVEL + light[part] * gain + on * variance.sqrt() * deviates[part];
                level.clamp(0.0, FULL_SCALE)
            });
            levels.map(L::from_light)
        };
        let ((fours, rest), (lights, light_rest)) = (target.as_chunks_mut(), light.as_chunks());
        let last = fours.len();
        for (word, (slots, light)) in fours.iter_mut().zip(lights).enumerate() {
            *slots = four(word, *light);
        }
        if !rest.is_empty() {
            let light = std::array::from_fn(|part| light_rest.get(part).copied().unwrap_or(0.0));
            rest.copy_from_slice(&four(last, light)[..rest.len()]);
        }
    }
}

/// Four unlit pixels by random bits.
#[inline(always)]
fn dark_four<L: Level>(table: &[L; QUANTILES], bits: u64) -> [L; 4] {
    [0, 16, 32, 48].map(|shift| table[(bits >> shift) as usize % QUANTILES])
}
