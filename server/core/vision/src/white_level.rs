//! White level: the grey level of a saturated pixel, where sensors with fewer bits fill images of 16.

use crate::colour::{CameraImage, ColourImage};
use crate::image::{GreyImage, Pixels};

/// Bits of sensors; the number of bits that levels use is rounded up to one of these.
const SENSOR_BITS: [u32; 5] = [8, 10, 12, 14, 16];

/// Most low bits that a sensor leaves unused: one with 8 bits in images of 16.
const MAX_UNUSED_BITS: u32 = 8;

/// The grey level of a saturated pixel in images of 16 bits: 4095 if a sensor of 12 bits fills the lower ones, 65520 if
/// it fills the upper ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WhiteLevel(u16);

impl Default for WhiteLevel {
    fn default() -> Self {
        Self::FULL
    }
}

impl WhiteLevel {
    /// That of a sensor that uses all bits.
    pub const FULL: Self = Self(u16::MAX);

    /// This level; zero is taken as [`WhiteLevel::FULL`].
    pub fn new(level: u16) -> Self {
        if level == 0 { Self::FULL } else { Self(level) }
    }

    /// That of a sensor whose images use these bits ([`bits_used`]).
    pub fn of_bits(used: u16) -> Self {
        let n_bits = u16::BITS - used.leading_zeros();
        let Some(n_bits) = SENSOR_BITS.into_iter().find(|&bits| n_bits > 0 && bits >= n_bits) else {
            return Self::FULL;
        };
        // Sensors have an even number of bits.
        let n_unused = used.trailing_zeros().min(MAX_UNUSED_BITS) & !1;
        let all = u16::MAX >> (u16::BITS - n_bits);
        Self::new(all >> n_unused << n_unused)
    }

    /// The level.
    pub fn level(self) -> u16 {
        self.0
    }

    /// Whether levels need no scaling.
    pub fn is_full(self) -> bool {
        self == Self::FULL
    }

    /// The image with its levels scaled so that white is full scale; levels above white are clamped. Images of 8 bits
    /// stay as they are.
    pub fn scaled(self, image: CameraImage) -> CameraImage {
        if self.is_full() || image.bit_depth() == 8 {
            return image;
        }
        let (width, height) = (image.width(), image.height());
        let pixels = match image {
            CameraImage::Grey(image) => image.into_pixels(),
            CameraImage::Colour(image) => image.into_pixels(),
        };
        let n_samples = match &pixels {
            Pixels::Eight(levels) => levels.len(),
            Pixels::Sixteen(levels) => levels.len(),
        };
        let pixels = self.scaled_pixels(pixels);
        const SAME: &str = "the number of samples did not change";
        if n_samples == width * height {
            CameraImage::Grey(GreyImage::new(width, height, pixels).expect(SAME))
        } else {
            CameraImage::Colour(ColourImage::new(width, height, pixels).expect(SAME))
        }
    }

    fn scaled_pixels(self, pixels: Pixels) -> Pixels {
        let gain = f32::from(u16::MAX) / f32::from(self.0);
        match pixels {
            Pixels::Eight(levels) => Pixels::Eight(levels),
            Pixels::Sixteen(mut levels) => {
                // The cast saturates. 24 bits of precision round every level to the nearest.
                levels.iter_mut().for_each(|level| *level = (f32::from(*level) * gain).round() as u16);
                Pixels::Sixteen(levels)
            }
        }
    }
}

/// The bits that are set in any sample of an image of 16 bits; none of an image of 8.
pub fn bits_used(image: &CameraImage) -> u16 {
    let pixels = match image {
        CameraImage::Grey(image) => image.pixels(),
        CameraImage::Colour(image) => image.pixels(),
    };
    match pixels {
        Pixels::Eight(_) => 0,
        Pixels::Sixteen(levels) => levels.iter().fold(0, |used, level| used | level),
    }
}

/// A level of a sensor with 8 to 16 `bits` in 16 bits, white at full scale: its upper bits are repeated below.
#[inline]
pub fn widened(level: u16, bits: u32) -> u16 {
    let high = level << (u16::BITS - bits);
    high | high.checked_shr(bits).unwrap_or(0)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn deep(levels: &[u16]) -> CameraImage {
        CameraImage::Grey(GreyImage::new(levels.len(), 1, Pixels::Sixteen(levels.to_vec())).unwrap())
    }

    #[test]
    fn white_is_that_of_the_sensor_whose_bits_are_used() {
        let white = |levels: &[u16]| WhiteLevel::of_bits(bits_used(&deep(levels))).level();
        assert_eq!(white(&[7, 300, 1001]), 1023, "10 bits");
        assert_eq!(white(&[7, 300, 1024]), 4095, "12 bits, exposed to a quarter");
        assert_eq!(white(&[7, 16_000]), 16_383, "14 bits");
        assert_eq!(white(&[16, 48, 65_520]), 65_520, "the upper 12 bits");
        assert_eq!(white(&[64, 192, 65_472]), 65_472, "the upper 10 bits");
        assert_eq!(white(&[0, 255]), 255, "8 bits");
        assert_eq!(white(&[257, 65_535]), 65_535);
        assert_eq!(white(&[33_000, 1]), 65_535);
        assert_eq!(white(&[0, 0]), 65_535, "nothing to tell it by");
        let eight = CameraImage::Grey(GreyImage::new(1, 1, Pixels::Eight(vec![200])).unwrap());
        assert_eq!(WhiteLevel::of_bits(bits_used(&eight)), WhiteLevel::FULL);
        assert_eq!(WhiteLevel::new(4095).scaled(eight.clone()), eight);
    }

    #[test]
    fn scaled_levels_end_at_full_scale_and_stay_in_proportion() {
        let scaled = WhiteLevel::new(4095).scaled(deep(&[0, 1, 2048, 4095, 5000]));
        assert_eq!(scaled, deep(&[0, 16, 32_776, 65_535, 65_535]));
        let samples = Pixels::Sixteen(vec![0, 2048, 4095]);
        let colour = CameraImage::Colour(ColourImage::new(1, 1, samples).unwrap());
        let CameraImage::Colour(scaled) = WhiteLevel::new(4095).scaled(colour) else { panic!() };
        assert_eq!(scaled.at(0, 0), [0.0, 32_776.0, 65_535.0]);
    }

    #[test]
    fn widened_levels_are_scaled_ones() {
        for bits in [8_u32, 10, 12, 14, 16] {
            let white = u16::MAX >> (16 - bits);
            for level in [0, 1, white / 3, white - 1, white] {
                let scaled = f64::from(level) * 65_535.0 / f64::from(white);
                assert!((f64::from(widened(level, bits)) - scaled).abs() < 1.0, "{level} of {bits} bits");
            }
            assert_eq!(widened(white, bits), u16::MAX);
        }
    }
}
