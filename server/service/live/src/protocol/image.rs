//! Opcode 1: a frame as JPEG with its centrelines.

use bytes::{BufMut, Bytes, BytesMut};
use vision::{GreyImage, Pixels, Segment};

use crate::protocol::header::{FrameStamp, NO_ORDER, PixelGrid, saturated};

/// First byte of the message.
pub const OPCODE: u8 = 1;
/// Bytes before the table of lines.
pub const HEADER_BYTES: usize = 320;
/// Bins of the histogram.
pub const HISTOGRAM_BINS: usize = 64;
/// Flag of a line: a point of it is saturated.
pub const LINE_SATURATED: u8 = 1;
/// Bytes of a row of the table of lines.
const LINE_BYTES: usize = 8;
/// Bytes of a point.
const POINT_BYTES: usize = 4;

/// Content of an image message.
pub struct ImageMessage<'a> {
    /// Identification and time of the frame.
    pub stamp: FrameStamp,
    /// Size of the frame, and grid of the points.
    pub grid: PixelGrid,
    /// Bits per pixel of the frame: 8 or 16.
    pub bit_depth: u8,
    /// Downscaling factor in both directions.
    pub scale: u8,
    /// Exposure time.
    pub exposure_us: f32,
    /// Brightness statistics of the frame.
    pub brightness: Brightness,
    /// Lines of the frame.
    pub segments: &'a [Segment],
    /// Per line: its order.
    pub labels: &'a [Option<i8>],
    /// Image width and height.
    pub jpeg_px: (u16, u16),
    /// The picture.
    pub jpeg: &'a [u8],
}

impl ImageMessage<'_> {
    /// The message, number `number` of its stream.
    pub fn encode(&self, number: u32) -> Bytes {
        let n_points: usize = self.segments.iter().map(|segment| segment.points.len()).sum();
        let tables = self.segments.len() * LINE_BYTES + n_points * POINT_BYTES;
        let mut bytes = BytesMut::with_capacity(HEADER_BYTES + tables + self.jpeg.len());
        self.stamp.put(&mut bytes, OPCODE, HEADER_BYTES, number);
        bytes.put_u16_le(self.grid.width_px);
        bytes.put_u16_le(self.grid.height_px);
        bytes.put_u16_le(self.jpeg_px.0);
        bytes.put_u16_le(self.jpeg_px.1);
        bytes.put_u32_le(self.jpeg.len() as u32);
        bytes.put_u32_le(self.segments.len() as u32);
        bytes.put_u32_le(n_points as u32);
        bytes.put_u16_le(self.grid.units_per_px);
        bytes.put_u8(self.scale);
        bytes.put_u8(self.bit_depth);
        bytes.put_f32_le(self.exposure_us);
        bytes.put_u32_le(self.brightness.n_saturated);
        self.brightness.histogram.iter().for_each(|count| bytes.put_u32_le(*count));
        for (idx, segment) in self.segments.iter().enumerate() {
            let order = self.labels.get(idx).copied().flatten().unwrap_or(NO_ORDER);
            let lit = segment.points.iter().any(|point| point.saturated);
            bytes.put_i8(order);
            bytes.put_u8(u8::from(lit) * LINE_SATURATED);
            bytes.put_u16_le(0);
            bytes.put_u32_le(segment.points.len() as u32);
        }
        for point in self.segments.iter().flat_map(|segment| &segment.points) {
            self.grid.put(&mut bytes, point.u_px, point.v_px);
        }
        bytes.put_slice(self.jpeg);
        bytes.freeze()
    }
}

/// Brightness statistics of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Brightness {
    /// Pixels per 1/64 of full scale.
    pub histogram: [u32; HISTOGRAM_BINS],
    /// Pixels at full scale.
    pub n_saturated: u32,
}

impl Brightness {
    /// Counts the pixels of `image`.
    pub fn of(image: &GreyImage) -> Self {
        let mut levels = [0u32; 256];
        let n_saturated = match image.pixels() {
            Pixels::Eight(pixels) => {
                levels = counts(pixels);
                levels[255]
            }
            Pixels::Sixteen(pixels) => {
                pixels.iter().for_each(|level| levels[usize::from(*level >> 8)] += 1);
                pixels.iter().filter(|level| **level == u16::MAX).count() as u32
            }
        };
        let per_bin = levels.len() / HISTOGRAM_BINS;
        let histogram = std::array::from_fn(|bin| levels[bin * per_bin..(bin + 1) * per_bin].iter().sum());
        Self { histogram, n_saturated }
    }
}

/// Histogram with four interleaved counters: equal neighbours would otherwise stall on the same counter.
fn counts(pixels: &[u8]) -> [u32; 256] {
    let mut counts = [[0u32; 256]; 4];
    let fours = pixels.chunks_exact(4);
    fours.remainder().iter().for_each(|level| counts[0][usize::from(*level)] += 1);
    for four in fours {
        four.iter().zip(&mut counts).for_each(|(level, counts)| counts[usize::from(*level)] += 1);
    }
    std::array::from_fn(|level| counts.iter().map(|counts| counts[level]).sum())
}

/// Downscales an image by averaging squares of `scale` × `scale` pixels, to 8 bits; incomplete squares at the right and
/// lower edge are dropped.
///
/// `into` is reused. Returns width and height.
pub fn shrink(image: &GreyImage, scale: usize, into: &mut Vec<u8>) -> (u16, u16) {
    let (width, height) = ((image.width() / scale).max(1), (image.height() / scale).max(1));
    let (columns, rows) = (scale.min(image.width()), scale.min(image.height()));
    into.clear();
    into.reserve(width * height);
    match image.pixels() {
        Pixels::Eight(pixels) if scale == 1 => into.extend_from_slice(pixels),
        Pixels::Eight(pixels) => {
            averages(pixels, image.width(), (width, height), (columns, rows), |sum| sum as u8, into);
        }
        Pixels::Sixteen(pixels) => {
            averages(pixels, image.width(), (width, height), (columns, rows), |sum| (sum >> 8) as u8, into);
        }
    }
    (saturated(width), saturated(height))
}

fn averages<T: Copy + Into<u32>>(
    pixels: &[T],
    stride: usize,
    (width, height): (usize, usize),
    (columns, rows): (usize, usize),
    level: impl Fn(u32) -> u8,
    into: &mut Vec<u8>,
) {
    let n = (columns * rows) as u32;
    let mut sums = vec![0u32; width];
    for row in 0..height {
        sums.fill(0);
        for line in pixels[row * rows * stride..].chunks(stride).take(rows) {
            for (sum, square) in sums.iter_mut().zip(line.chunks_exact(columns)) {
                *sum += square.iter().map(|pixel| (*pixel).into()).sum::<u32>();
            }
        }
        into.extend(sums.iter().map(|sum| level(sum / n)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_counts_every_pixel_once() {
        let eight = GreyImage::new(4, 1, Pixels::Eight(vec![0, 3, 4, 255])).unwrap();
        let bright = Brightness::of(&eight);
        assert_eq!((bright.histogram[0], bright.histogram[1], bright.histogram[63]), (2, 1, 1));
        assert_eq!(bright.n_saturated, 1);
        let sixteen = GreyImage::new(3, 1, Pixels::Sixteen(vec![1023, 1024, 65_534])).unwrap();
        let bright = Brightness::of(&sixteen);
        assert_eq!((bright.histogram[0], bright.histogram[1], bright.histogram[63]), (1, 1, 1));
        assert_eq!(bright.n_saturated, 0);
    }

    #[test]
    fn a_downscaled_image_has_averages() {
        let image = GreyImage::new(5, 2, Pixels::Eight(vec![10, 20, 1, 1, 9, 30, 40, 1, 1, 9])).unwrap();
        let mut small = Vec::new();
        assert_eq!(shrink(&image, 2, &mut small), (2, 1));
        assert_eq!(small, [25, 1]);
        let image = GreyImage::new(2, 2, Pixels::Sixteen(vec![0x1000, 0x2000, 0x1000, 0x2000])).unwrap();
        assert_eq!(shrink(&image, 1, &mut small), (2, 2));
        assert_eq!(small, [0x10, 0x20, 0x10, 0x20]);
        assert_eq!(shrink(&image, 4, &mut small), (1, 1));
        assert_eq!(small, [0x18]);
    }
}
