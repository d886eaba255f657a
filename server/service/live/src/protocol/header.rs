//! The common header of frame messages.

use bytes::{BufMut, BytesMut};

use station::StampedFrame;

/// Flag: the laser was on during the exposure.
pub const LASER_ON: u8 = 1;
/// Flag: lines carry orders, a calibration was active.
pub const LABELLED: u8 = 2;
/// The order of a line that has none.
pub const NO_ORDER: i8 = i8::MIN;

/// Identification and time of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameStamp {
    /// The station's count of frames.
    pub sequence: u64,
    /// Middle of the exposure, nanoseconds of the station's clock.
    pub captured_at_ns: u64,
    /// Stage position; NaN if unknown.
    pub position_mm: f64,
    /// Whether the laser was on.
    pub laser_on: bool,
    /// Whether lines carry orders.
    pub labelled: bool,
}

impl FrameStamp {
    /// The header of `frame`.
    pub fn of(frame: &StampedFrame, labelled: bool) -> Self {
        Self {
            sequence: frame.sequence,
            captured_at_ns: frame.captured_at_ns,
            position_mm: frame.position_mm.unwrap_or(f64::NAN),
            laser_on: frame.laser_on,
            labelled,
        }
    }

    /// Writes the shared part of the header; `number` counts the messages of the stream.
    pub fn put(&self, bytes: &mut BytesMut, opcode: u8, header_bytes: usize, number: u32) {
        let flags = (u8::from(self.laser_on) * LASER_ON) | (u8::from(self.labelled) * LABELLED);
        bytes.put_u8(opcode);
        bytes.put_u8(flags);
        bytes.put_u16_le(header_bytes as u16);
        bytes.put_u32_le(number);
        bytes.put_u64_le(self.sequence);
        bytes.put_u64_le(self.captured_at_ns);
        bytes.put_f64_le(self.position_mm);
    }
}

/// Quantisation of pixel positions to 16 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelGrid {
    /// Columns of the frame.
    pub width_px: u16,
    /// Rows of the frame.
    pub height_px: u16,
    /// Units per pixel.
    pub units_per_px: u16,
}

impl PixelGrid {
    /// The finest grid (a power of two, at most 1/64 px) in which a frame of that size fits.
    pub fn of(width_px: usize, height_px: usize) -> Self {
        let longest = width_px.max(height_px).max(1);
        let units = (0..=6).rev().map(|power| 1usize << power).find(|units| longest * units <= 1 << 16);
        Self {
            width_px: saturated(width_px),
            height_px: saturated(height_px),
            units_per_px: units.unwrap_or(1) as u16,
        }
    }

    /// Writes a position.
    pub fn put(&self, bytes: &mut BytesMut, u_px: f64, v_px: f64) {
        for position in [u_px, v_px] {
            // `as` saturates; a fit may place an end slightly outside the image.
            bytes.put_u16_le((position * f64::from(self.units_per_px)).round() as u16);
        }
    }
}

/// A count of pixels in 16 bits.
pub fn saturated(count: usize) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_is_as_fine_as_the_sensor_allows() {
        for (side, units) in [(640, 64), (1024, 64), (1280, 32), (2448, 16), (5472, 8), (70_000, 1)] {
            assert_eq!(PixelGrid::of(side, 8).units_per_px, units, "{side} px");
        }
    }
}
