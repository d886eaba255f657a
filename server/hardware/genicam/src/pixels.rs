//! Conversion of the pixels of GenICam cameras to grey images in one pass.
//!
//! Formats and their codes: Pixel Format Naming Convention (PFNC 2.4). Deeper pixels are shifted to the most
//! significant bits of 16. For a Bayer sensor the green pixels, every second one, are used; the others are the mean of
//! their green neighbours: red and blue light is ignored, and the resolution is that of the green pixels.

use vision::GreyImage;

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

/// Positions of the green pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Green {
    /// A monochrome sensor.
    All,
    /// Even column plus row: GR, GB.
    Even,
    /// Odd column plus row: RG, BG.
    Odd,
}

/// A supported pixel format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SourceFormat {
    /// Its name in the standard.
    pub name: &'static str,
    code: u32,
    packing: Packing,
    green: Green,
}

const fn row(name: &'static str, code: u32, packing: Packing, green: Green) -> SourceFormat {
    SourceFormat { name, code, packing, green }
}

/// All supported formats, in order of preference.
const FORMATS: [SourceFormat; 36] = {
    use Green::{All, Even, Odd};
    use Packing::{Bits, Eight, Packed, Sixteen};
    [
        row("Mono8", 0x0108_0001, Eight, All),
        row("Mono16", 0x0110_0007, Sixteen(16), All),
        row("Mono14", 0x0110_0025, Sixteen(14), All),
        row("Mono12p", 0x010C_0047, Bits(12), All),
        row("Mono12Packed", 0x010C_0006, Packed(12), All),
        row("Mono12", 0x0110_0005, Sixteen(12), All),
        row("Mono10p", 0x010A_0046, Bits(10), All),
        row("Mono10Packed", 0x010C_0004, Packed(10), All),
        row("Mono10", 0x0110_0003, Sixteen(10), All),
        row("BayerRG8", 0x0108_0009, Eight, Odd),
        row("BayerBG8", 0x0108_000B, Eight, Odd),
        row("BayerGR8", 0x0108_0008, Eight, Even),
        row("BayerGB8", 0x0108_000A, Eight, Even),
        row("BayerRG16", 0x0110_002F, Sixteen(16), Odd),
        row("BayerBG16", 0x0110_0031, Sixteen(16), Odd),
        row("BayerGR16", 0x0110_002E, Sixteen(16), Even),
        row("BayerGB16", 0x0110_0030, Sixteen(16), Even),
        row("BayerRG12p", 0x010C_0059, Bits(12), Odd),
        row("BayerBG12p", 0x010C_0053, Bits(12), Odd),
        row("BayerGR12p", 0x010C_0057, Bits(12), Even),
        row("BayerGB12p", 0x010C_0055, Bits(12), Even),
        row("BayerRG12Packed", 0x010C_002B, Packed(12), Odd),
        row("BayerBG12Packed", 0x010C_002D, Packed(12), Odd),
        row("BayerGR12Packed", 0x010C_002A, Packed(12), Even),
        row("BayerGB12Packed", 0x010C_002C, Packed(12), Even),
        row("BayerRG12", 0x0110_0011, Sixteen(12), Odd),
        row("BayerBG12", 0x0110_0013, Sixteen(12), Odd),
        row("BayerGR12", 0x0110_0010, Sixteen(12), Even),
        row("BayerGB12", 0x0110_0012, Sixteen(12), Even),
        row("BayerRG10p", 0x010A_0058, Bits(10), Odd),
        row("BayerBG10p", 0x010A_0052, Bits(10), Odd),
        row("BayerGR10p", 0x010A_0056, Bits(10), Even),
        row("BayerGB10p", 0x010A_0054, Bits(10), Even),
        row("BayerRG10", 0x0110_000D, Sixteen(10), Odd),
        row("BayerBG10", 0x0110_000F, Sixteen(10), Odd),
        row("BayerGR10", 0x0110_000C, Sixteen(10), Even),
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

    /// Description of the format and its conversion.
    pub fn description(&self) -> String {
        match self.green {
            Green::All => self.name.to_owned(),
            Green::Even | Green::Odd => format!("{}: green, interpolated", self.name),
        }
    }

    /// Writes `width` × `height` pixels into `image`, whose memory is reused; every row is followed by
    /// `padding_bytes`.
    ///
    /// # Errors
    /// [`InvalidImage`] if there are fewer bytes than pixels need, or no pixels.
    pub fn unpack(
        &self,
        bytes: &[u8],
        (width, height): (usize, usize),
        padding_bytes: usize,
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
            self.interpolate(pixels, width, |sum, n| (sum / n) as u8);
        } else {
            let pixels = image.sixteen_mut(width, height).map_err(|_| InvalidImage)?;
            pixels.chunks_exact_mut(row_px).enumerate().for_each(|(row, out)| self.unpack_row(rows(row), out));
            self.interpolate(pixels, width, |sum, n| (sum / n) as u16);
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
            Packing::Eight => out.iter_mut().zip(bytes).for_each(|(out, &byte)| *out = u16::from(byte) << 8),
            Packing::Sixteen(bits) => {
                let pixels = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
                out.iter_mut().zip(pixels).for_each(|(out, pixel)| *out = pixel << (16 - bits));
            }
            Packing::Bits(bits) => unpack_bits(bytes, bits, out),
            Packing::Packed(bits) => unpack_packed(bytes, bits, out),
        }
    }

    /// Sets the other pixels of a Bayer sensor to the mean of their two to four green neighbours.
    fn interpolate<T: Copy + Into<u32>>(&self, pixels: &mut [T], width: usize, mean: impl Fn(u32, u32) -> T) {
        let odd = match self.green {
            Green::All => return,
            Green::Odd => 1,
            Green::Even => 0,
        };
        let height = pixels.len() / width;
        for y in 0..height {
            for x in ((y + odd + 1) % 2..width).step_by(2) {
                let at = y * width + x;
                let mut sum_and_count = (0, 0);
                let mut add = |neighbour: usize| {
                    sum_and_count = (sum_and_count.0 + pixels[neighbour].into(), sum_and_count.1 + 1);
                };
                (x > 0).then(|| add(at - 1));
                (x + 1 < width).then(|| add(at + 1));
                (y > 0).then(|| add(at - width));
                (y + 1 < height).then(|| add(at + width));
                let (sum, count) = sum_and_count;
                if count > 0 {
                    pixels[at] = mean(sum, count);
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
        *out = ((held & mask) << (16 - bits)) as u16;
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
            *out = pixel << (16 - bits);
        }
    }
}

#[cfg(test)]
mod tests {
    use vision::Pixels;

    use super::*;

    fn sixteen(name: &str, bytes: &[u8], size: (usize, usize), padding: usize) -> Vec<u16> {
        let format = FORMATS.into_iter().find(|format| format.name == name).unwrap();
        let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
        format.unpack(bytes, size, padding, &mut image).unwrap();
        match image.pixels() {
            Pixels::Eight(pixels) => pixels.iter().map(|&pixel| u16::from(pixel)).collect(),
            Pixels::Sixteen(pixels) => pixels.clone(),
        }
    }

    /// Pixels 0xABC and 0x123 as the naming convention draws them.
    #[test]
    fn twelve_bit_pixels_of_every_packing_fill_the_most_significant_bits() {
        let expected = [0xABC0, 0x1230];
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
    fn ten_bit_pixels_of_every_packing_fill_the_most_significant_bits() {
        let expected = [0x3A5_u16, 0x012, 0x1FF, 0x200].map(|pixel| pixel << 6);
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

    #[test]
    fn only_green_pixels_of_a_bayer_sensor_are_used() {
        for (name, first_is_green) in
            [("BayerGR8", true), ("BayerGB8", true), ("BayerRG8", false), ("BayerBG8", false)]
        {
            let green = |x: usize, y: usize| (x + y).is_multiple_of(2) == first_is_green;
            let level = |x: usize, y: usize| (10 * x + 20 * y) as u8;
            let bytes: Vec<u8> =
                (0..20).map(|n| if green(n % 5, n / 5) { level(n % 5, n / 5) } else { 255 }).collect();
            let got = sixteen(name, &bytes, (5, 4), 0);
            // A ramp is its own interpolation where a pixel has all its neighbours.
            for (x, y) in (1..4).flat_map(|x| (1..3).map(move |y| (x, y))) {
                assert_eq!(got[y * 5 + x], u16::from(level(x, y)), "{name} {x} {y}");
            }
            assert!(got.iter().all(|&pixel| pixel < 255), "{name}: a red or blue pixel was used");
        }
    }

    #[test]
    fn too_few_bytes_are_not_an_image() {
        let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
        for format in FORMATS {
            let enough = format.bytes_of(12);
            assert_eq!(format.unpack(&vec![0; enough], (4, 3), 0, &mut image), Ok(()), "{}", format.name);
            assert_eq!(
                format.unpack(&vec![0; enough - 1], (4, 3), 0, &mut image),
                Err(InvalidImage),
                "{}",
                format.name
            );
        }
        assert_eq!(FORMATS[0].unpack(&[], (0, 3), 0, &mut image), Err(InvalidImage));
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
