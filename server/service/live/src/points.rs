//! The points of a scan, packed for display in blocks without gaps.

use parking_lot::{Mutex, MutexGuard};
use std::sync::Arc;

use bytes::{Bytes, BytesMut};
use optics::{Calibration, Motion, StagePosition};
use scanning::{CloudPoint, Profile};

use crate::protocol::points::{DisplayPoint, block_bytes, put_block};

/// A profile's points in the part frame. Their σ is that of the image noise alone.
fn display_points(
    profile: &Profile,
    position: StagePosition,
    calibration: &Calibration,
) -> impl Iterator<Item = DisplayPoint> {
    // With a calibration of the other kind of stage, points stay in the camera frame.
    let motion = calibration.stage.and_then(|stage| stage.motion(position)).unwrap_or_else(Motion::identity);
    let display = move |point: &scanning::ProfilePoint| {
        let in_part = motion.part_from_camera(&point.hit_in_camera).xyz;
        let (along, _) = point.centreline.along_across(point.centreline.direction());
        DisplayPoint {
            xyz_mm: [in_part.x, in_part.y, in_part.z],
            order: point.order,
            intensity: point.centreline.intensity,
            sigma_mm: point.noise_sigma_mm as f32,
            along_px: along as f32,
        }
    };
    profile.points.iter().map(display)
}

/// A point of a finished cloud; `along_u`: whether lines run along the rows of the image.
pub fn display_point_of_cloud(point: &CloudPoint, along_u: bool) -> DisplayPoint {
    DisplayPoint {
        xyz_mm: [point.x_mm, point.y_mm, point.z_mm],
        order: point.order,
        intensity: point.intensity,
        sigma_mm: point.sigma_mm,
        along_px: if along_u { point.u_px } else { point.v_px },
    }
}

/// Allocation size, bytes: two seconds of a fast camera need fewer than twenty allocations, and unused memory costs
/// nothing.
const PIECE_BYTES: usize = 4 << 20;

/// The display points of one scan: an append-only list of blocks cut from large allocations.
#[derive(Debug)]
pub struct PointLog {
    scan_id: String,
    packed: Mutex<Packed>,
}

#[derive(Debug, Default)]
struct Packed {
    blocks: Vec<Bytes>,
    /// The rest of the newest allocation.
    piece: BytesMut,
    /// The points of the newest frame; the buffer is reused.
    points: Vec<DisplayPoint>,
}

impl PointLog {
    /// Without points.
    pub fn new(scan_id: &str) -> Self {
        Self { scan_id: scan_id.to_owned(), packed: Mutex::default() }
    }

    /// Which scan.
    pub fn scan_id(&self) -> &str {
        &self.scan_id
    }

    fn packed(&self) -> MutexGuard<'_, Packed> {
        self.packed.lock()
    }

    /// Packs the points of a frame as the next block; no block without points. Returns the number of blocks.
    pub fn add(
        &self,
        frame_idx: u32,
        position: StagePosition,
        profile: &Profile,
        calibration: &Calibration,
    ) -> u32 {
        let mut packed = self.packed();
        let Packed { blocks, piece, points } = &mut *packed;
        points.clear();
        points.extend(display_points(profile, position, calibration));
        if !points.is_empty() {
            let (number, size) = (blocks.len() as u32, block_bytes(points.len()));
            if piece.capacity() < size {
                *piece = BytesMut::with_capacity(size.max(PIECE_BYTES));
            }
            put_block(piece, &self.scan_id, number, frame_idx, position.value(), points);
            blocks.push(piece.split().freeze());
        }
        blocks.len() as u32
    }

    /// Number of blocks.
    pub fn n_blocks(&self) -> u32 {
        self.packed().blocks.len() as u32
    }

    /// Block number `number`, shared, not copied.
    pub fn block(&self, number: u32) -> Option<Bytes> {
        self.packed().blocks.get(number as usize).cloned()
    }

    /// All blocks, shared, not copied.
    pub fn blocks(&self) -> Vec<Bytes> {
        self.packed().blocks.clone()
    }
}

/// State of the scan that was started last.
#[derive(Debug, Clone, Default)]
pub struct PointsSeen {
    /// Its points; `None` before the first scan.
    pub log: Option<Arc<PointLog>>,
    /// Blocks so far.
    pub n_blocks: u32,
    /// Whether more will come.
    pub running: bool,
}

impl PointsSeen {
    /// The points of that scan, if it is this one.
    pub fn log_of(&self, scan_id: &str) -> Option<&Arc<PointLog>> {
        self.log.as_ref().filter(|log| log.scan_id() == scan_id)
    }
}
