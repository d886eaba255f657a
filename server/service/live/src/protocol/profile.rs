//! Opcode 2: the triangulated points of a frame, all orders, as columns.

use bytes::{BufMut, Bytes, BytesMut};
use scanning::{Profile, ProfilePoint};
use sha2::{Digest, Sha256};
use vision::LineDirection;

use crate::protocol::header::{FrameStamp, PixelGrid, saturated};

/// First byte of the message.
pub const OPCODE: u8 = 2;
/// Bytes before the table of orders.
pub const HEADER_BYTES: usize = 64;
/// Bytes of a row of the table of orders.
const ORDER_BYTES: usize = 12;
/// Bytes of a point over all columns.
const POINT_BYTES: usize = 20;

/// Content of a profile message.
pub struct ProfileMessage<'a> {
    /// Identification and time of the frame.
    pub stamp: FrameStamp,
    /// Size of the frame, and grid of the pixels.
    pub grid: PixelGrid,
    /// Which calibration, see [`calibration_mark`].
    pub calibration: [u8; 8],
    /// Direction of the lines.
    pub line_direction: LineDirection,
    /// The points.
    pub profile: &'a Profile,
}

impl ProfileMessage<'_> {
    /// The message, number `number` of its stream.
    pub fn encode(&self, number: u32) -> Bytes {
        let points = &self.profile.points;
        let orders: Vec<&[ProfilePoint]> = points.chunk_by(|a, b| a.order == b.order).collect();
        let size = HEADER_BYTES + orders.len() * ORDER_BYTES + points.len() * POINT_BYTES;
        let mut bytes = BytesMut::with_capacity(size);
        self.stamp.put(&mut bytes, OPCODE, HEADER_BYTES, number);
        bytes.put_slice(&self.calibration);
        bytes.put_u32_le(points.len() as u32);
        bytes.put_u16_le(saturated(orders.len()));
        bytes.put_u8(u8::from(self.line_direction == LineDirection::Columns));
        bytes.put_u8(0);
        bytes.put_u32_le(self.profile.dropped.total_points() as u32);
        bytes.put_u32_le(self.profile.labels.len() as u32);
        bytes.put_u16_le(self.grid.width_px);
        bytes.put_u16_le(self.grid.height_px);
        bytes.put_u16_le(self.grid.units_per_px);
        bytes.put_u16_le(0);
        let mut first = 0;
        for order in orders {
            bytes.put_i8(order[0].order);
            bytes.put_bytes(0, 3);
            bytes.put_u32_le(first);
            bytes.put_u32_le(order.len() as u32);
            first += order.len() as u32;
        }
        for axis in 0..3 {
            points.iter().for_each(|point| bytes.put_f32_le(point.hit_in_camera.xyz[axis] as f32));
        }
        points.iter().for_each(|point| bytes.put_f32_le(point.noise_sigma_mm as f32));
        points.iter().for_each(|point| self.grid.put(&mut bytes, point.centreline.u_px, point.centreline.v_px));
        bytes.freeze()
    }
}

/// The first eight bytes of the SHA-256 of the calibration's id, to distinguish calibrations.
pub fn calibration_mark(calibration_id: &str) -> [u8; 8] {
    let digest = Sha256::digest(calibration_id.as_bytes());
    std::array::from_fn(|idx| digest[idx])
}
