//! Grey pictures as baseline JPEG (ITU-T T.81), fast enough to cost a live view little.
//!
//! Of each block of 8 × 8 pixels eight columns are transformed side by side (the fast cosine transform of Arai, Agui and
//! Nakajima; its scale factors are part of the quantisation), and only coefficients that are not zero are looked at
//! after that: in a dark picture with some laser lines most are.

use multiversion::multiversion;

/// Pixels of a block along each side.
const SIDE: usize = 8;
/// Pixels, and coefficients, of a block.
const BLOCK: usize = SIDE * SIDE;

/// Quantisation of brightness, T.81 table K.1, row by row.
const QUANTISATION: [u8; BLOCK] = [
    16, 11, 10, 16, 24, 40, 51, 61, 12, 12, 14, 19, 26, 58, 60, 55, 14, 13, 16, 24, 40, 57, 69, 56, 14, 17, 22,
    29, 51, 87, 80, 62, 18, 22, 37, 56, 68, 109, 103, 77, 24, 35, 55, 64, 81, 104, 113, 92, 49, 64, 78, 87, 103,
    121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99,
];

/// Where in a block, row by row, the coefficients stand in the order of T.81 figure A.6.
const ZIGZAG: [u8; BLOCK] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20, 13, 6, 7, 14,
    21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59, 52, 45, 38, 31, 39, 46, 53,
    60, 61, 54, 47, 55, 62, 63,
];

/// Codes of the sizes of DC differences, T.81 table K.3: how many there are of each length, and what they stand for.
const DC_CODES: ([u8; 16], &[u8]) =
    ([0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0], &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);

/// Codes of zeros before a coefficient and its size, T.81 table K.5.
const AC_CODES: ([u8; 16], &[u8]) = (
    [0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 0x7d],
    &[
        0x01, 0x02, 0x03, 0x00, 0x04, 0x11, 0x05, 0x12, 0x21, 0x31, 0x41, 0x06, 0x13, 0x51, 0x61, 0x07, 0x22,
        0x71, 0x14, 0x32, 0x81, 0x91, 0xa1, 0x08, 0x23, 0x42, 0xb1, 0xc1, 0x15, 0x52, 0xd1, 0xf0, 0x24, 0x33,
        0x62, 0x72, 0x82, 0x09, 0x0a, 0x16, 0x17, 0x18, 0x19, 0x1a, 0x25, 0x26, 0x27, 0x28, 0x29, 0x2a, 0x34,
        0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49, 0x4a, 0x53, 0x54, 0x55,
        0x56, 0x57, 0x58, 0x59, 0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x6a, 0x73, 0x74, 0x75, 0x76,
        0x77, 0x78, 0x79, 0x7a, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8a, 0x92, 0x93, 0x94, 0x95, 0x96,
        0x97, 0x98, 0x99, 0x9a, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4, 0xb5,
        0xb6, 0xb7, 0xb8, 0xb9, 0xba, 0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4,
        0xd5, 0xd6, 0xd7, 0xd8, 0xd9, 0xda, 0xe1, 0xe2, 0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf1,
        0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8, 0xf9, 0xfa,
    ],
);

/// Sixteen zeros in a row.
const SIXTEEN_ZEROS: usize = 0xf0;
/// Nothing but zeros until the end of the block.
const END_OF_BLOCK: usize = 0;

/// Encodes grey pictures at one quality; keeps its memory from picture to picture.
pub struct GreyJpeg {
    /// What coefficients are divided by, row by row.
    steps: [u8; BLOCK],
    /// One over that and over the scale of the transform, column by column, as the transform leaves its coefficients.
    inverse: [[f32; SIDE]; SIDE],
    dc: [Code; 256],
    ac: [Code; 256],
    rows: Vec<u8>,
    blocks: Vec<[i16; BLOCK]>,
}

/// A code word.
#[derive(Debug, Clone, Copy, Default)]
struct Code {
    bits: u32,
    n_bits: u32,
}

impl GreyJpeg {
    /// `quality` from 1 to 100, as of the Independent JPEG Group.
    pub fn new(quality: u8) -> Self {
        let quality = u32::from(quality.clamp(1, 100));
        let percent = if quality < 50 { 5000 / quality } else { 200 - 2 * quality };
        let steps = QUANTISATION.map(|step| ((u32::from(step) * percent + 50) / 100).clamp(1, 255) as u8);
        let inverse = std::array::from_fn(|u| {
            std::array::from_fn(|v| {
                (1.0 / (f64::from(steps[v * SIDE + u]) * scale(u) * scale(v) * SIDE as f64)) as f32
            })
        });
        Self { steps, inverse, dc: codes(DC_CODES), ac: codes(AC_CODES), rows: Vec::new(), blocks: Vec::new() }
    }

    /// The picture, row by row; `None` if there are not `width` × `height` pixels or none at all.
    pub fn encode(&mut self, pixels: &[u8], width: u16, height: u16) -> Option<Vec<u8>> {
        let columns = usize::from(width);
        if pixels.is_empty() || pixels.len() != columns * usize::from(height) {
            return None;
        }
        let mut bits = Bits { bytes: self.header(width, height), ..Bits::default() };
        let mut dc_before = 0;
        for strip in pixels.chunks(SIDE * columns) {
            self.pad(strip, columns);
            let stride = columns.next_multiple_of(SIDE);
            self.blocks.resize(stride / SIDE, [0; BLOCK]);
            transform(&self.rows, stride, &self.inverse, &mut self.blocks);
            for block in &self.blocks {
                self.write(block, dc_before, &mut bits);
                dc_before = block[0];
            }
        }
        Some(bits.end())
    }

    /// Eight rows of whole blocks: the last column and row are repeated.
    fn pad(&mut self, strip: &[u8], columns: usize) {
        self.rows.clear();
        let last = strip.len() / columns - 1;
        for row in 0..SIDE {
            let start = row.min(last) * columns;
            let pixels = &strip[start..start + columns];
            self.rows.extend_from_slice(pixels);
            let padded = (row + 1) * columns.next_multiple_of(SIDE);
            self.rows.resize(padded, pixels[columns - 1]);
        }
    }

    fn write(&self, block: &[i16; BLOCK], dc_before: i16, bits: &mut Bits) {
        let difference = i32::from(block[0]) - i32::from(dc_before);
        let n_bits = size(difference);
        bits.put_value(self.dc[n_bits as usize], difference, n_bits);
        // The first is the brightness of the whole block, which was just written.
        let mut left = not_zero(block) & !1;
        let mut next = 1;
        while left != 0 {
            let at = left.trailing_zeros();
            left &= left - 1;
            let mut zeros = at - next;
            while zeros >= 16 {
                bits.put(self.ac[SIXTEEN_ZEROS]);
                zeros -= 16;
            }
            let value = i32::from(block[at as usize]);
            let n_bits = size(value);
            bits.put_value(self.ac[(zeros << 4 | n_bits) as usize], value, n_bits);
            next = at + 1;
        }
        if next < BLOCK as u32 {
            bits.put(self.ac[END_OF_BLOCK]);
        }
    }

    /// Everything before the coefficients.
    fn header(&self, width: u16, height: u16) -> Vec<u8> {
        let mut bytes = vec![0xff, 0xd8];
        segment(&mut bytes, 0xe0, b"JFIF\0\x01\x01\0\0\x01\0\x01\0\0");
        let steps: Vec<u8> = std::iter::once(0).chain(ZIGZAG.map(|at| self.steps[usize::from(at)])).collect();
        segment(&mut bytes, 0xdb, &steps);
        let ([h0, h1], [w0, w1]) = (height.to_be_bytes(), width.to_be_bytes());
        segment(&mut bytes, 0xc0, &[8, h0, h1, w0, w1, 1, 1, 0x11, 0]);
        for (class, (counts, values)) in [(0x00, DC_CODES), (0x10, AC_CODES)] {
            segment(&mut bytes, 0xc4, &[&[class], &counts[..], values].concat());
        }
        segment(&mut bytes, 0xda, &[1, 1, 0, 0, 63, 0]);
        bytes
    }
}

/// A marker, the length and what follows.
fn segment(bytes: &mut Vec<u8>, marker: u8, content: &[u8]) {
    bytes.extend_from_slice(&[0xff, marker]);
    bytes.extend_from_slice(&(content.len() as u16 + 2).to_be_bytes());
    bytes.extend_from_slice(content);
}

/// The code words by what they stand for, T.81 annex C.
fn codes((counts, values): ([u8; 16], &[u8])) -> [Code; 256] {
    let mut codes = [Code::default(); 256];
    let (mut bits, mut values) = (0, values.iter());
    for (idx, count) in counts.into_iter().enumerate() {
        for value in values.by_ref().take(usize::from(count)) {
            codes[usize::from(*value)] = Code { bits, n_bits: idx as u32 + 1 };
            bits += 1;
        }
        bits <<= 1;
    }
    codes
}

/// A bit for every coefficient that is not zero, from bit 0.
fn not_zero(block: &[i16; BLOCK]) -> u64 {
    /// Multiplied by it, eight bytes of 0 or 1 become the bits of the highest byte.
    const PACKS: u64 = 0x0102_0408_1020_4080;
    let eight = |eight: &[i16]| {
        let mut bytes = [0; SIDE];
        bytes.iter_mut().zip(eight).for_each(|(byte, coefficient)| *byte = u8::from(*coefficient != 0));
        u64::from_le_bytes(bytes).wrapping_mul(PACKS) >> 56
    };
    block.chunks_exact(SIDE).enumerate().fold(0, |bits, (idx, chunk)| bits | eight(chunk) << (SIDE * idx))
}

/// Bits that a value needs, T.81 table F.1.
fn size(value: i32) -> u32 {
    32 - value.unsigned_abs().leading_zeros()
}

/// What the transform multiplies frequency `k` by along one direction, over √8.
fn scale(k: usize) -> f64 {
    if k == 0 { 1.0 } else { (k as f64 * std::f64::consts::PI / 16.0).cos() * std::f64::consts::SQRT_2 }
}

/// Bits on their way into bytes.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    held: u64,
    n_held: u32,
}

impl Bits {
    fn put(&mut self, code: Code) {
        self.held = self.held << code.n_bits | u64::from(code.bits);
        self.n_held += code.n_bits;
        if self.n_held >= 32 {
            self.n_held -= 32;
            self.write(((self.held >> self.n_held) as u32).to_be_bytes());
        }
    }

    /// A code and behind it the value itself, negative ones less one.
    fn put_value(&mut self, code: Code, value: i32, n_bits: u32) {
        let low = (value + (value >> 31)) as u32 & ((1 << n_bits) - 1);
        self.put(Code { bits: code.bits << n_bits | low, n_bits: code.n_bits + n_bits });
    }

    /// A byte of ones is followed by one of zeros, so that it is not taken for a marker.
    fn write(&mut self, four: [u8; 4]) {
        if !four.contains(&0xff) {
            self.bytes.extend_from_slice(&four);
            return;
        }
        for byte in four {
            self.bytes.push(byte);
            if byte == 0xff {
                self.bytes.push(0);
            }
        }
    }

    fn end(mut self) -> Vec<u8> {
        while self.n_held > 0 {
            let n_bits = self.n_held.min(8);
            self.n_held -= n_bits;
            let byte = ((self.held >> self.n_held) as u8) << (8 - n_bits) | ((1_u16 << (8 - n_bits)) - 1) as u8;
            self.bytes.push(byte);
            if byte == 0xff {
                self.bytes.push(0);
            }
        }
        self.bytes.extend_from_slice(&[0xff, 0xd9]);
        self.bytes
    }
}

/// Numbers side by side. Loops over them count: what iterators become may be compiled for the plainest processor.
type Lanes = [f32; SIDE];

/// Quantised coefficients of all blocks of eight rows, in the order they are written.
#[multiversion(targets("x86_64+avx2"))]
fn transform(rows: &[u8], stride: usize, inverse: &[Lanes; SIDE], blocks: &mut [[i16; BLOCK]]) {
    /// Added to a number below 2²² it leaves the nearest whole number in the low bits.
    const ROUNDS: f32 = 12_582_912.0;
    for (idx, block) in blocks.iter_mut().enumerate() {
        let mut lanes = [[0.0; SIDE]; SIDE];
        for (row, lanes) in lanes.iter_mut().enumerate() {
            let start = row * stride + idx * SIDE;
            for (lane, pixel) in lanes.iter_mut().zip(&rows[start..start + SIDE]) {
                *lane = f32::from(*pixel) - 128.0;
            }
        }
        cosines(&mut lanes);
        let mut turned = [[0.0; SIDE]; SIDE];
        for (row, lanes) in lanes.iter().enumerate() {
            for (turned, lane) in turned.iter_mut().zip(lanes) {
                turned[row] = *lane;
            }
        }
        cosines(&mut turned);
        let mut whole = [0i16; BLOCK];
        for column in 0..SIDE {
            for row in 0..SIDE {
                let rounded = turned[column][row] * inverse[column][row] + ROUNDS;
                whole[column * SIDE + row] =
                    (rounded.to_bits() as i32).wrapping_sub(ROUNDS.to_bits() as i32) as i16;
            }
        }
        for (coefficient, at) in block.iter_mut().zip(ZIGZAG) {
            // They stand column by column.
            *coefficient = whole[usize::from(at % 8 * 8 + at / 8)];
        }
    }
}

#[inline(always)]
fn plus(a: Lanes, b: Lanes) -> Lanes {
    let mut sum = a;
    for lane in 0..SIDE {
        sum[lane] += b[lane];
    }
    sum
}

#[inline(always)]
fn minus(a: Lanes, b: Lanes) -> Lanes {
    let mut difference = a;
    for lane in 0..SIDE {
        difference[lane] -= b[lane];
    }
    difference
}

#[inline(always)]
fn times(a: Lanes, factor: f32) -> Lanes {
    let mut product = a;
    for lane in 0..SIDE {
        product[lane] = a[lane] * factor;
    }
    product
}

/// The cosine transform of eight numbers, in eight lanes side by side; frequency `k` is `√8 ·` [`scale`]`(k)` too large.
#[inline(always)]
fn cosines(x: &mut [Lanes; SIDE]) {
    let [s0, s1, s2, s3] = [plus(x[0], x[7]), plus(x[1], x[6]), plus(x[2], x[5]), plus(x[3], x[4])];
    let [d0, d1, d2, d3] = [minus(x[0], x[7]), minus(x[1], x[6]), minus(x[2], x[5]), minus(x[3], x[4])];
    // Even frequencies.
    let (a, b, c, d) = (plus(s0, s3), plus(s1, s2), minus(s1, s2), minus(s0, s3));
    let e = times(plus(c, d), 0.707_106_77);
    (x[0], x[4], x[2], x[6]) = (plus(a, b), minus(a, b), plus(d, e), minus(d, e));
    // Odd frequencies.
    let (a, b, c) = (plus(d3, d2), plus(d2, d1), plus(d1, d0));
    let turn = times(minus(a, c), 0.382_683_43);
    let low = plus(times(a, 0.541_196_1), turn);
    let high = plus(times(c, 1.306_563), turn);
    let middle = times(b, 0.707_106_77);
    let (up, down) = (plus(d0, middle), minus(d0, middle));
    (x[5], x[3], x[1], x[7]) = (plus(down, low), minus(down, low), plus(up, high), minus(up, high));
}

#[cfg(test)]
mod tests {
    use image::ImageFormat;
    use jpeg_encoder::{ColorType, Encoder};

    use super::*;

    /// A picture with slopes, a bright line, noise and black.
    fn picture(width: usize, height: usize) -> Vec<u8> {
        let mut noise = 1u32;
        let pixel = |at: usize| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let (u, v) = (at % width, at / width);
            let line = 240.0 * (-0.5 * ((v as f64 - 20.0 - 0.05 * u as f64) / 2.2).powi(2)).exp();
            let slope = if v > height / 2 { (u % 97) as f64 } else { 0.0 };
            (line + slope + f64::from(noise >> 24) / 24.0).min(255.0) as u8
        };
        (0..width * height).map(pixel).collect()
    }

    fn decoded(jpeg: &[u8]) -> (u32, u32, Vec<u8>) {
        let image = image::load_from_memory_with_format(jpeg, ImageFormat::Jpeg).unwrap().into_luma8();
        (image.width(), image.height(), image.into_raw())
    }

    fn rms(a: &[u8], b: &[u8]) -> f64 {
        let squares = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
        (squares.sum::<f64>() / a.len() as f64).sqrt()
    }

    #[test]
    fn a_picture_comes_back_as_well_as_from_another_encoder_and_is_not_longer() {
        for (width, height) in [(256, 128), (250, 131), (1, 1), (7, 40), (1280, 64)] {
            for quality in [20, 80, 95] {
                let pixels = picture(width, height);
                let (w, h) = (width as u16, height as u16);
                let jpeg = GreyJpeg::new(quality).encode(&pixels, w, h).unwrap();
                let mut other = Vec::new();
                Encoder::new(&mut other, quality).encode(&pixels, w, h, ColorType::Luma).unwrap();
                let (got_width, got_height, got) = decoded(&jpeg);
                assert_eq!((got_width as usize, got_height as usize), (width, height));
                let (ours, theirs) = (rms(&pixels, &got), rms(&pixels, &decoded(&other).2));
                // The same tables: only the last bit of rounding differs, and some words of the header.
                assert!(ours <= 1.02 * theirs + 0.02, "{width}×{height} at {quality}: {ours} and {theirs} levels");
                let longest = other.len() + other.len() / 50 + 20;
                assert!(
                    jpeg.len() <= longest,
                    "{width}×{height} at {quality}: {} and {}",
                    jpeg.len(),
                    other.len()
                );
            }
        }
    }

    #[test]
    fn the_extremes_of_grey_survive() {
        let mut jpeg = GreyJpeg::new(100);
        let checks: Vec<u8> = (0..64 * 64).map(|at| if (at + at / 64) % 2 == 0 { 0 } else { 255 }).collect();
        for pixels in [vec![0; 64 * 64], vec![255; 64 * 64], checks] {
            let (_, _, got) = decoded(&jpeg.encode(&pixels, 64, 64).unwrap());
            assert!(rms(&pixels, &got) < 1.0, "{}", rms(&pixels, &got));
        }
    }

    #[test]
    fn pixels_that_are_missing_are_noticed() {
        assert!(GreyJpeg::new(80).encode(&[1, 2, 3], 2, 2).is_none());
        assert!(GreyJpeg::new(80).encode(&[], 0, 4).is_none());
    }
}
