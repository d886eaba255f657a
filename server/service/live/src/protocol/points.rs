//! Opcode 3: the points of one frame of a scan, quantised for display.

use bytes::{BufMut, Bytes, BytesMut};
use uuid::Uuid;

/// First byte of the message.
pub const OPCODE: u8 = 3;
/// Bytes before the first point.
pub const HEADER_BYTES: usize = 64;
/// Bytes of one point.
pub const POINT_BYTES: usize = 12;
/// Largest quantised coordinate.
const FULL_SCALE: f64 = 65535.0;
/// σ of class 0, mm: a tenth of a micrometre, below what any station resolves.
const SIGMA_CLASS_0_MM: f32 = 1e-4;
/// Classes per doubling of σ: steps of 4.4 %, so that 255 classes reach 6 mm.
const SIGMA_CLASSES_PER_DOUBLING: usize = 16;
/// The class of a σ that is not known.
const SIGMA_UNKNOWN: u8 = 255;

/// A display point, in the part frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DisplayPoint {
    /// Position in the part frame.
    pub xyz_mm: [f64; 3],
    /// Diffraction order of its line.
    pub order: i8,
    /// Grey levels of the line above its background.
    pub intensity: f32,
    /// Standard deviation along its camera ray.
    pub sigma_mm: f32,
    /// Image column (row): position along the line.
    pub along_px: f32,
}

/// Packs the points of a frame; a scan id that is not a UUID is sent as zeros.
pub fn encode_block(
    scan_id: &str,
    block: u32,
    frame_idx: u32,
    position_mm: f64,
    points: &[DisplayPoint],
) -> Bytes {
    let mut bytes = BytesMut::with_capacity(block_bytes(points.len()));
    put_block(&mut bytes, scan_id, block, frame_idx, position_mm, points);
    bytes.freeze()
}

/// Length of a block of so many points.
pub fn block_bytes(n_points: usize) -> usize {
    HEADER_BYTES + n_points * POINT_BYTES
}

/// Appends a block to `bytes`.
pub fn put_block(
    bytes: &mut BytesMut,
    scan_id: &str,
    block: u32,
    frame_idx: u32,
    position_mm: f64,
    points: &[DisplayPoint],
) {
    let axes = [0, 1, 2].map(|axis| Axis::of(points.iter().map(|point| point.xyz_mm[axis])));
    bytes.put_u8(OPCODE);
    bytes.put_u8(0);
    bytes.put_u16_le(HEADER_BYTES as u16);
    bytes.put_u32_le(block);
    bytes.put_slice(Uuid::parse_str(scan_id).unwrap_or_default().as_bytes());
    bytes.put_f64_le(position_mm);
    bytes.put_u32_le(frame_idx);
    bytes.put_u32_le(points.len() as u32);
    axes.iter().for_each(|axis| bytes.put_f32_le(axis.origin_mm));
    axes.iter().for_each(|axis| bytes.put_f32_le(axis.step_mm));
    let classes = SigmaClasses::new();
    let header_end = bytes.len();
    bytes.resize(header_end + points.len() * POINT_BYTES, 0);
    for (packed, point) in bytes[header_end..].chunks_exact_mut(POINT_BYTES).zip(points) {
        let [x, y, z] = [0, 1, 2].map(|axis| axes[axis].quantised(point.xyz_mm[axis]).to_le_bytes());
        let [intensity, along] =
            [point.intensity, point.along_px].map(|value| rounded(value.into()).to_le_bytes());
        let [order] = point.order.to_le_bytes();
        let class = classes.of(point.sigma_mm);
        packed.copy_from_slice(&[
            x[0],
            x[1],
            y[0],
            y[1],
            z[0],
            z[1],
            intensity[0],
            intensity[1],
            order,
            class,
            along[0],
            along[1],
        ]);
    }
}

/// Length of the block with this header; `None` for an invalid header.
pub fn block_length(header: &[u8]) -> Option<usize> {
    let count = header.get(36..40)?;
    let begins = header[0] == OPCODE && header[2..4] == (HEADER_BYTES as u16).to_le_bytes();
    let n_points = u32::from_le_bytes(count.try_into().ok()?) as usize;
    begins.then(|| block_bytes(n_points))
}

/// How one coordinate of a block is quantised.
struct Axis {
    origin_mm: f32,
    step_mm: f32,
}

impl Axis {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if !(high - low).is_finite() {
            return Self { origin_mm: 0.0, step_mm: 0.0 };
        }
        Self { origin_mm: low as f32, step_mm: ((high - low) / FULL_SCALE) as f32 }
    }

    fn quantised(&self, value_mm: f64) -> u16 {
        if self.step_mm == 0.0 {
            return 0;
        }
        rounded((value_mm - f64::from(self.origin_mm)) / f64::from(self.step_mm))
    }
}

/// The nearest whole number, without a call of the mathematical library. `as` saturates: the rounding of an origin may
/// push the ends out by a step.
fn rounded(value: f64) -> u16 {
    (value + 0.5) as u16
}

/// Classes of σ: 16·log₂(σ / 0.1 µm), rounded, at most 254; 255 is unknown. A lookup table avoids one logarithm per
/// point.
struct SigmaClasses {
    /// Where, from one power of two to the next, the classes begin.
    rises: [f32; SIGMA_CLASSES_PER_DOUBLING],
}

impl SigmaClasses {
    fn new() -> Self {
        let rise = |class: usize| ((class as f32 + 0.5) / SIGMA_CLASSES_PER_DOUBLING as f32).exp2();
        Self { rises: std::array::from_fn(rise) }
    }

    fn of(&self, sigma_mm: f32) -> u8 {
        if !sigma_mm.is_finite() || sigma_mm < 0.0 {
            return SIGMA_UNKNOWN;
        }
        const EXPONENT_BIAS: i32 = 127;
        const MANTISSA: u32 = (1 << 23) - 1;
        let bits = (sigma_mm / SIGMA_CLASS_0_MM).to_bits();
        let doublings = (bits >> 23) as i32 - EXPONENT_BIAS;
        // The same number between 1 and 2.
        let rest = f32::from_bits(bits & MANTISSA | 1f32.to_bits());
        let risen: i32 = self.rises.iter().map(|rise| i32::from(rest >= *rise)).sum();
        let class = doublings * SIGMA_CLASSES_PER_DOUBLING as i32 + risen;
        class.clamp(0, i32::from(SIGMA_UNKNOWN) - 1) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64, z: f64) -> DisplayPoint {
        DisplayPoint { xyz_mm: [x, y, z], order: -1, intensity: 120.4, sigma_mm: 0.0032, along_px: 17.6 }
    }

    fn coordinates(block: &[u8], idx: usize) -> [f64; 3] {
        let f32_at = |at: usize| f32::from_le_bytes(block[at..at + 4].try_into().unwrap());
        [0, 1, 2].map(|axis| {
            let at = HEADER_BYTES + idx * POINT_BYTES + 2 * axis;
            let steps = u16::from_le_bytes(block[at..at + 2].try_into().unwrap());
            f64::from(f32_at(40 + 4 * axis) + f32::from(steps) * f32_at(52 + 4 * axis))
        })
    }

    #[test]
    fn decoded_positions_are_within_half_a_step_and_the_rounding_of_32_bits() {
        let points: Vec<_> = (0..500)
            .map(|idx| {
                point(f64::from(idx) * 0.21 - 40.0, 398.0 + f64::from(idx % 7), 400.0 - f64::from(idx) * 0.05)
            })
            .collect();
        let block = encode_block("01890000-0000-7000-8000-000000000001", 3, 4, 1.5, &points);
        assert_eq!(block_length(&block), Some(block.len()));
        // Half a step of 105 mm / 65535, and three roundings of a number up to 512 in 24 bits.
        let tolerance_mm = 0.5 * 105.0 / FULL_SCALE + 3.0 * 512.0 * f64::from(f32::EPSILON) / 2.0;
        for (idx, point) in points.iter().enumerate() {
            for (got, wanted) in coordinates(&block, idx).iter().zip(point.xyz_mm) {
                assert!((got - wanted).abs() <= tolerance_mm, "{got} mm instead of {wanted} mm");
            }
        }
    }

    #[test]
    fn a_flat_block_and_a_single_point_have_steps_of_zero() {
        let block = encode_block("x", 0, 0, 0.0, &[point(1.25, -3.5, 400.0)]);
        assert_eq!(coordinates(&block, 0), [1.25, -3.5, 400.0]);
        assert_eq!(block[8..24], [0; 16]);
    }

    #[test]
    fn classes_of_sigma() {
        let classes = SigmaClasses::new();
        let cases = [(0.0, 0), (1e-4, 0), (2e-4, 16), (1e-3, 53), (1e3, 254), (f32::NAN, 255), (-1.0, 255)];
        for (sigma_mm, class) in cases {
            assert_eq!(classes.of(sigma_mm), class, "{sigma_mm} mm");
        }
        for step in 0..20_000 {
            let sigma_mm = 1e-5 * 1.001f64.powi(step);
            // Counted in steps, so that no rounding decides a case that is not a tie.
            let class = 16.0 * (sigma_mm / f64::from(SIGMA_CLASS_0_MM)).log2();
            let got = f64::from(classes.of(sigma_mm as f32));
            let wanted = class.clamp(0.0, 254.0);
            assert!((got - wanted).abs() < 0.5 + 1e-4, "{sigma_mm} mm: class {got} for {class}");
        }
    }
}
