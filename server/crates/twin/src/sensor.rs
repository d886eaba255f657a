//! The sensor: light to grey levels with shot and read noise, black level and saturation.

use crate::params::{BLACK_LEVEL, ELECTRONS_PER_LEVEL, READ_NOISE_LEVELS};
use crate::random::{derived_seed, scrambled};

/// Full scale in the levels that light is counted in here, whatever the bit depth.
pub(crate) const FULL_SCALE: f32 = 255.0;

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
        let table = L::dark(self);
        let mask = table.len() - 1;
        for (word, four) in target.chunks_mut(4).enumerate() {
            let bits = Self::bits(row_seed, from / 4 + word);
            for (part, slot) in four.iter_mut().enumerate() {
                *slot = table[(bits >> (16 * part)) as usize & mask];
            }
        }
    }

    /// Fills `target`, which begins at column `from` (a multiple of 4) of a row, from the light on it: noise comes
    /// before the amplification by `gain`, black level and saturation after it.
    pub(crate) fn expose<L: Level>(&self, row_seed: u64, from: usize, light: &[f32], gain: f32, target: &mut [L]) {
        let mask = self.quantiles.len() - 1;
        let on = if self.noise == Noise::On { gain } else { 0.0 };
        for (word, (four, light)) in target.chunks_mut(4).zip(light.chunks(4)).enumerate() {
            let bits = Self::bits(row_seed, from / 4 + word);
            for (part, (slot, &light)) in four.iter_mut().zip(light).enumerate() {
                let variance = READ_NOISE_LEVELS * READ_NOISE_LEVELS + light / ELECTRONS_PER_LEVEL;
                let deviate = self.quantiles[(bits >> (16 * part)) as usize & mask];
                let level = BLACK_LEVEL + light * gain + on * variance.sqrt() * deviate;
                *slot = L::from_light(level.clamp(0.0, FULL_SCALE));
            }
        }
    }
}
