//! Conversion of the pixels of GenICam cameras to grey images in one pass.
//!
//! Formats and their codes: Pixel Format Naming Convention (PFNC 2.4). Deeper pixels fill 16 bits, white at
//! full scale. For a Bayer sensor the pixels of one colour are used, that of the laser; the others are the
//! mean of their neighbours of this colour: other light is ignored, and the resolution is that of these pixels (every
//! second one is green, every fourth red, every fourth blue).

use vision::GreyImage;
use vision::white_level::widened;

use crate::settings::SensorColour;

/// Memory layout of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Packing {
    /// One byte each.
    Eight,
    /// Two bytes each, little endian, with so many bits used.
    Sixteen(u32),
    /// A bit stream, least significant first: `Mono10p`, `Mono12p`.
    Bits(u32),
    /// Two pixels in three bytes, least significant bits in the middle: GigE Vision's `Mono10Packed`, `Mono12Packed`.
    Packed(u32),
}

/// Colours of the pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mosaic {
    /// A monochrome sensor.
    None,
    /// A Bayer sensor with its red pixels in even (0) or odd (1) columns and rows, and its blue ones in the others.
    Bayer { red: [usize; 2] },
}

impl Mosaic {
    /// Whether the pixel in column `x`, row `y` has this colour.
    fn has(self, colour: SensorColour, x: usize, y: usize) -> bool {
        let Self::Bayer { red: [column, row] } = self else { return true };
        let (is_red_column, is_red_row) = (x % 2 == column, y % 2 == row);
        match colour {
            SensorColour::Green => is_red_column != is_red_row,
            SensorColour::Red => is_red_column && is_red_row,
            SensorColour::Blue => !is_red_column && !is_red_row,
        }
    }

    /// Steps, right and down, from a pixel in such a column and row to its neighbours of a colour; none if it has that
    /// colour itself.
    fn neighbours(self, colour: SensorColour, x: usize, y: usize) -> Vec<(isize, isize)> {
        if self.has(colour, x, y) {
            return Vec::new();
        }
        let around = (-1..=1).flat_map(|down| (-1..=1).map(move |right| (right, down)));
        // Two more columns and rows do not change the mosaic.
        let is_of = |&(right, down): &(isize, isize)| {
            self.has(colour, (x + 2).wrapping_add_signed(right), (y + 2).wrapping_add_signed(down))
        };
        around.filter(is_of).collect()
    }
}

/// A supported pixel format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SourceFormat {
    /// Its name in the standard.
    pub name: &'static str,
    code: u32,
    packing: Packing,
    mosaic: Mosaic,
}

const fn row(name: &'static str, code: u32, packing: Packing, mosaic: Mosaic) -> SourceFormat {
    SourceFormat { name, code, packing, mosaic }
}

/// All supported formats, in order of preference.
const FORMATS: [SourceFormat; 36] = {
    use Packing::{Bits, Eight, Packed, Sixteen};
    const MONO: Mosaic = Mosaic::None;
    const RG: Mosaic = Mosaic::Bayer { red: [0, 0] };
    const GR: Mosaic = Mosaic::Bayer { red: [1, 0] };
    const GB: Mosaic = Mosaic::Bayer { red: [0, 1] };
    const BG: Mosaic = Mosaic::Bayer { red: [1, 1] };
    [
        row("Mono8", 0x0108_0001, Eight, MONO),
        row("Mono16", 0x0110_0007, Sixteen(16), MONO),
        row("Mono14", 0x0110_0025, Sixteen(14), MONO),
        row("Mono12p", 0x010C_0047, Bits(12), MONO),
        row("Mono12Packed", 0x010C_0006, Packed(12), MONO),
        row("Mono12", 0x0110_0005, Sixteen(12), MONO),
        row("Mono10p", 0x010A_0046, Bits(10), MONO),
        row("Mono10Packed", 0x010C_0004, Packed(10), MONO),
        row("Mono10", 0x0110_0003, Sixteen(10), MONO),
        row("BayerRG8", 0x0108_0009, Eight, RG),
        row("BayerBG8", 0x0108_000B, Eight, BG),
        row("BayerGR8", 0x0108_0008, Eight, GR),
        row("BayerGB8", 0x0108_000A, Eight, GB),
        row("BayerRG16", 0x0110_002F, Sixteen(16), RG),
        row("BayerBG16", 0x0110_0031, Sixteen(16), BG),
        row("BayerGR16", 0x0110_002E, Sixteen(16), GR),
        row("BayerGB16", 0x0110_0030, Sixteen(16), GB),
        row("BayerRG12p", 0x010C_0059, Bits(12), RG),
        row("BayerBG12p", 0x010C_0053, Bits(12), BG),
        row("BayerGR12p", 0x010C_0057, Bits(12), GR),
        row("BayerGB12p", 0x010C_0055, Bits(12), GB),
        row("BayerRG12Packed", 0x010C_002B, Packed(12), RG),
        row("BayerBG12Packed", 0x010C_002D, Packed(12), BG),
        row("BayerGR12Packed", 0x010C_002A, Packed(12), GR),
        row("BayerGB12Packed", 0x010C_002C, Packed(12), GB),
        row("BayerRG12", 0x0110_0011, Sixteen(12), RG),
        row("BayerBG12", 0x0110_0013, Sixteen(12), BG),
        row("BayerGR12", 0x0110_0010, Sixteen(12), GR),
        row("BayerGB12", 0x0110_0012, Sixteen(12), GB),
        row("BayerRG10p", 0x010A_0058, Bits(10), RG),
        row("BayerBG10p", 0x010A_0052, Bits(10), BG),
        row("BayerGR10p", 0x010A_0056, Bits(10), GR),
        row("BayerGB10p", 0x010A_0054, Bits(10), GB),
        row("BayerRG10", 0x0110_000D, Sixteen(10), RG),
        row("BayerBG10", 0x0110_000F, Sixteen(10), BG),
        row("BayerGR10", 0x0110_000C, Sixteen(10), GR),
    ]
};

/// The bytes are not an image of the stated size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InvalidImage;

impl SourceFormat {
    /// The format with that code, if it is supported.
    pub fn from_code(code: u32) -> Option<Self> {
        FORMATS.into_iter().find(|format| format.code == code)
    }

    /// The best format among those offered by a camera, with 8 bits or with more.
    ///
    /// `preferred` is used if it is offered and has the depth; otherwise monochrome before Bayer, more bits before
    /// fewer.
    pub fn choose<'o>(offered: &'o [String], is_deep: bool, preferred: &str) -> Option<(Self, &'o str)> {
        let has_depth = |format: &SourceFormat| (format.packing != Packing::Eight) == is_deep;
        let offered_name = |format: SourceFormat| {
            offered.iter().find(|name| *name == format.name).map(|name| (format, name.as_str()))
        };
        let mut known = FORMATS.into_iter().filter(has_depth).filter_map(offered_name);
        let preferred_format = known.clone().find(|(format, _)| format.name == preferred);
        preferred_format.or_else(|| known.next())
    }

    /// Whether its pixels have more than 8 bits.
    pub fn is_deep(&self) -> bool {
        self.packing != Packing::Eight
    }

    /// Description of the format and its conversion with this colour of a Bayer sensor.
    pub fn description(&self, colour: SensorColour) -> String {
        match self.mosaic {
            Mosaic::None => self.name.to_owned(),
            Mosaic::Bayer { .. } => format!("{}: {}, interpolated", self.name, colour.name()),
        }
    }

    /// Writes `width` × `height` pixels into `image`, whose memory is reused; every row is followed by
    /// `padding_bytes`. Of a Bayer sensor, the pixels of this colour.
    ///
    /// # Errors
    /// [`InvalidImage`] if there are fewer bytes than pixels need, or no pixels.
    pub fn unpack(
        &self,
        bytes: &[u8],
        (width, height): (usize, usize),
        padding_bytes: usize,
        colour: SensorColour,
        image: &mut GreyImage,
    ) -> Result<(), InvalidImage> {
        // Without padding, rows follow each other within a byte.
        let (n_rows, row_px) = if padding_bytes == 0 { (1, width * height) } else { (height, width) };
        let row_bytes = self.bytes_of(row_px) + padding_bytes;
        if width == 0 || height == 0 || bytes.len() + padding_bytes < n_rows * row_bytes {
            return Err(InvalidImage);
        }
        let rows = |row: usize| &bytes[row * row_bytes..][..row_bytes - padding_bytes];
        if self.packing == Packing::Eight {
            let pixels = image.eight_mut(width, height).map_err(|_| InvalidImage)?;
            pixels.chunks_exact_mut(row_px).enumerate().for_each(|(row, out)| out.copy_from_slice(rows(row)));
            self.interpolate(pixels, width, colour, |sum, n| (sum / n) as u8);
        } else {
            let pixels = image.sixteen_mut(width, height).map_err(|_| InvalidImage)?;
            pixels.chunks_exact_mut(row_px).enumerate().for_each(|(row, out)| self.unpack_row(rows(row), out));
            self.interpolate(pixels, width, colour, |sum, n| (sum / n) as u16);
        }
        Ok(())
    }

    fn bytes_of(&self, n_pixels: usize) -> usize {
        match self.packing {
            Packing::Eight => n_pixels,
            Packing::Sixteen(_) => 2 * n_pixels,
            Packing::Bits(bits) => (n_pixels * bits as usize).div_ceil(8),
            Packing::Packed(_) => (n_pixels * 3).div_ceil(2),
        }
    }

    fn unpack_row(&self, bytes: &[u8], out: &mut [u16]) {
        match self.packing {
            Packing::Eight => {
                out.iter_mut().zip(bytes).for_each(|(out, &byte)| *out = widened(u16::from(byte), 8))
            }
            Packing::Sixteen(bits) => {
                let pixels = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
                out.iter_mut().zip(pixels).for_each(|(out, pixel)| *out = widened(pixel, bits));
            }
            Packing::Bits(bits) => unpack_bits(bytes, bits, out),
            Packing::Packed(bits) => unpack_packed(bytes, bits, out),
        }
    }

    /// Sets the other pixels of a Bayer sensor to the mean of their neighbours of this colour.
    fn interpolate<T: Copy + Into<u32>>(
        &self,
        pixels: &mut [T],
        width: usize,
        colour: SensorColour,
        mean: impl Fn(u32, u32) -> T,
    ) {
        if self.mosaic == Mosaic::None {
            return;
        }
        let height = pixels.len() / width;
        let neighbours = [0, 1].map(|y| [0, 1].map(|x| self.mosaic.neighbours(colour, x, y)));
        for y in 0..height {
            for x in 0..width {
                let beside = &neighbours[y % 2][x % 2];
                let (mut sum, mut n) = (0, 0);
                for &(right, down) in beside {
                    if let (Some(x), Some(y)) = (x.checked_add_signed(right), y.checked_add_signed(down))
                        && x < width
                        && y < height
                    {
                        (sum, n) = (sum + pixels[y * width + x].into(), n + 1);
                    }
                }
                if n > 0 {
                    pixels[y * width + x] = mean(sum, n);
                }
            }
        }
    }
}

/// Pixels in a bit stream, least significant bit first.
fn unpack_bits(bytes: &[u8], bits: u32, out: &mut [u16]) {
    let mask = (1_u32 << bits) - 1;
    let (mut held, mut n_held, mut bytes) = (0_u32, 0, bytes.iter());
    for out in out {
        while n_held < bits {
            held |= u32::from(bytes.next().copied().unwrap_or(0)) << n_held;
            n_held += 8;
        }
        *out = widened((held & mask) as u16, bits);
        (held, n_held) = (held >> bits, n_held - bits);
    }
}

/// Two pixels in three bytes: the outer ones hold the most significant bits, the middle one the least significant of
/// both.
fn unpack_packed(bytes: &[u8], bits: u32, out: &mut [u16]) {
    let low = bits - 8;
    let mask = (1_u16 << low) - 1;
    for (pair, bytes) in out.chunks_mut(2).zip(bytes.chunks(3)) {
        let byte = |idx: usize| u16::from(bytes.get(idx).copied().unwrap_or(0));
        let first = (byte(0) << low) | (byte(1) & mask);
        let second = (byte(2) << low) | ((byte(1) >> 4) & mask);
        for (out, pixel) in pair.iter_mut().zip([first, second]) {
            *out = widened(pixel, bits);
        }
    }
}

#[cfg(test)]
mod tests {
    use vision::Pixels;

    use super::*;

    fn sixteen(name: &str, bytes: &[u8], size: (usize, usize), padding: usize) -> Vec<u16> {
        in_colour(SensorColour::Green, name, bytes, size, padding)
    }

    fn in_colour(
        colour: SensorColour,
        name: &str,
        bytes: &[u8],
        size: (usize, usize),
        padding: usize,
    ) -> Vec<u16> {
        let format = FORMATS.into_iter().find(|format| format.name == name).unwrap();
        let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
        format.unpack(bytes, size, padding, colour, &mut image).unwrap();
        match image.pixels() {
            Pixels::Eight(pixels) => pixels.iter().map(|&pixel| u16::from(pixel)).collect(),
            Pixels::Sixteen(pixels) => pixels.clone(),
        }
    }

    /// Pixels 0xABC and 0x123 as the naming convention draws them.
    #[test]
    fn twelve_bit_pixels_of_every_packing_fill_sixteen_bits() {
        let expected = [0xABCA, 0x1231];
        for (name, bytes) in [
            ("Mono12", vec![0xBC, 0x0A, 0x23, 0x01]),
            ("Mono12p", vec![0xBC, 0x3A, 0x12]),
            ("Mono12Packed", vec![0xAB, 0x3C, 0x12]),
        ] {
            assert_eq!(sixteen(name, &bytes, (2, 1), 0), expected, "{name}");
        }
    }

    /// Pixels 0x3A5, 0x012, 0x1FF and 0x200.
    #[test]
    fn ten_bit_pixels_of_every_packing_fill_sixteen_bits() {
        let expected = [0x3A5_u16, 0x012, 0x1FF, 0x200].map(|pixel| pixel << 6 | pixel >> 4);
        for (name, bytes) in [
            ("Mono10", vec![0xA5, 0x03, 0x12, 0x00, 0xFF, 0x01, 0x00, 0x02]),
            ("Mono10p", vec![0xA5, 0x4B, 0xF0, 0x1F, 0x80]),
            ("Mono10Packed", vec![0xE9, 0x21, 0x04, 0x7F, 0x03, 0x80]),
        ] {
            assert_eq!(sixteen(name, &bytes, (2, 2), 0), expected, "{name}");
        }
    }

    #[test]
    fn row_padding_is_ignored() {
        assert_eq!(sixteen("Mono8", &[1, 2, 99, 3, 4], (2, 2), 1), [1, 2, 3, 4]);
        assert_eq!(sixteen("Mono16", &[0, 1, 9, 9, 0, 2, 9, 9], (1, 2), 2), [256, 512]);
    }

    /// First pixel of each colour, column and row, in the four mosaics.
    #[test]
    fn only_pixels_of_the_chosen_colour_of_a_bayer_sensor_are_used() {
        for (name, red, blue) in [
            ("BayerRG8", [0, 0], [1, 1]),
            ("BayerGR8", [1, 0], [0, 1]),
            ("BayerGB8", [0, 1], [1, 0]),
            ("BayerBG8", [1, 1], [0, 0]),
        ] {
            let is_at = |first: [usize; 2], x: usize, y: usize| [x % 2, y % 2] == first;
            for colour in [SensorColour::Green, SensorColour::Red, SensorColour::Blue] {
                let is_of = |x: usize, y: usize| match colour {
                    SensorColour::Green => !is_at(red, x, y) && !is_at(blue, x, y),
                    SensorColour::Red => is_at(red, x, y),
                    SensorColour::Blue => is_at(blue, x, y),
                };
                let level = |x: usize, y: usize| (10 * x + 20 * y) as u8;
                let bytes: Vec<u8> =
                    (0..42).map(|n| if is_of(n % 7, n / 7) { level(n % 7, n / 7) } else { 255 }).collect();
                let got = in_colour(colour, name, &bytes, (7, 6), 0);
                // A ramp is its own interpolation where a pixel has all its neighbours.
                for (x, y) in (1..6).flat_map(|x| (1..5).map(move |y| (x, y))) {
                    assert_eq!(got[y * 7 + x], u16::from(level(x, y)), "{name} {colour:?} {x} {y}");
                }
                assert!(got.iter().all(|&pixel| pixel < 255), "{name}: a pixel of another colour than {colour:?}");
            }
        }
    }

    #[test]
    fn too_few_bytes_are_not_an_image() {
        let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
        for format in FORMATS {
            let enough = format.bytes_of(12);
            assert_eq!(
                format.unpack(&vec![0; enough], (4, 3), 0, SensorColour::Green, &mut image),
                Ok(()),
                "{}",
                format.name
            );
            assert_eq!(
                format.unpack(&vec![0; enough - 1], (4, 3), 0, SensorColour::Green, &mut image),
                Err(InvalidImage),
                "{}",
                format.name
            );
        }
        assert_eq!(FORMATS[0].unpack(&[], (0, 3), 0, SensorColour::Green, &mut image), Err(InvalidImage));
    }

    #[test]
    fn the_best_format_offered_is_chosen_unless_another_is_preferred() {
        let offered = ["BayerRG8", "Mono10", "Mono12p", "Mono8"].map(str::to_owned);
        let chosen = |is_deep, preferred| SourceFormat::choose(&offered, is_deep, preferred).map(|(_, name)| name);
        assert_eq!(chosen(false, ""), Some("Mono8"));
        assert_eq!(chosen(true, ""), Some("Mono12p"));
        assert_eq!(chosen(true, "Mono10"), Some("Mono10"));
        assert_eq!(chosen(false, "Mono10"), Some("Mono8"), "a preferred format of another depth");
        assert_eq!(SourceFormat::choose(&["RGB8".to_owned()], false, ""), None);
    }

    #[test]
    fn every_pfnc_code_contains_its_bits_per_pixel() {
        for format in FORMATS {
            let bits = (format.code >> 16) & 0xFF;
            assert_eq!(format.bytes_of(8), bits as usize, "{}", format.name);
            assert_eq!(SourceFormat::from_code(format.code), Some(format));
        }
    }
}
