//! A synthetic scan of any size, without images, for tests of large scans: a ribbed plate that is constant along
//! the travel, so that the same lines are reused for all frames, each with its own noise.

use nalgebra::{DMatrix, Vector2, Vector3};
use optics::{Calibration, Camera, DepthRangeMm, Grating, LightSurfaces, StageAxis, StagePosition};
use vision::{CentrelinePoint, Centrelines, LineDirection, Segment};

use crate::input::frames::ScanFrame;

/// Image columns and rows of a typical camera.
pub const SIZE_PX: [usize; 2] = [1280, 1024];
/// Distance between frames, mm.
const STEP_MM: f64 = 0.05;
/// Noise of a point, px, as on matt grey paint.
const SIGMA_PX: f64 = 0.05;
/// Columns over which neighbours of one line share their noise, as stated for real lines.
const CORRELATION_PX: f64 = 2.0;
/// Mean depth of the plate, height of its ribs and their length over 2π, mm.
const PLATE_MM: [f64; 3] = [400.0, 2.0, 9.0];
/// Bisections of the image's height: the row is then known to a millionth of a pixel.
const N_BISECTIONS: usize = 31;

/// The frames of the scan, generated one by one.
#[derive(Debug)]
pub struct SyntheticScan {
    /// The calibration of the frames.
    pub calibration: Calibration,
    /// Number of frames.
    pub n_frames: usize,
    noiseless: Vec<Segment>,
}

impl SyntheticScan {
    /// A scan of `n_frames` with about `points_per_frame` points on five lines.
    pub fn new(n_frames: usize, points_per_frame: usize) -> Self {
        let calibration = calibration();
        let n_columns = (points_per_frame / calibration.orders.len()).clamp(1, SIZE_PX[0]);
        let first = (SIZE_PX[0] - n_columns) / 2;
        let line = |order: &i8| line(&calibration, *order, first..first + n_columns);
        let noiseless = calibration.orders.iter().map(line).collect();
        Self { calibration, n_frames, noiseless }
    }

    /// Number of points of a frame.
    pub fn points_per_frame(&self) -> usize {
        self.noiseless.iter().map(|segment| segment.points.len()).sum()
    }

    /// One frame, identical on every call.
    pub fn frame(&self, idx: usize) -> ScanFrame {
        let mut noise = Noise(idx as u64);
        let mut segments = self.noiseless.clone();
        for point in segments.iter_mut().flat_map(|segment| &mut segment.points) {
            point.v_px += SIGMA_PX * noise.next();
        }
        let position = StagePosition::LinearMm((idx as f64 - 0.5 * self.n_frames as f64) * STEP_MM);
        let direction = LineDirection::Rows;
        ScanFrame {
            centrelines: Centrelines { segments, direction, correlation_px: CORRELATION_PX, lit_line: None },
            position,
        }
    }
}

/// A fixed sequence of approximately normal numbers: sums of twelve uniform ones.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// One order's line on the plate: one point per column that it crosses.
fn line(calibration: &Calibration, order: i8, columns: std::ops::Range<usize>) -> Segment {
    let point = |column: usize| {
        let v_px = row(calibration, order, column as f64)?;
        Some(CentrelinePoint {
            u_px: column as f64,
            v_px,
            normal: [0.0, 1.0],
            sigma_px: SIGMA_PX,
            intensity: 120.0 + (column % 16) as f32,
            width_px: 5.0,
            saturated: false,
        })
    };
    Segment { points: columns.filter_map(point).collect() }
}

/// Row at which the line crosses a column; `None` outside the image.
fn row(calibration: &Calibration, order: i8, u_px: f64) -> Option<f64> {
    let above = |v_px: f64| {
        let hit = calibration.triangulate(order, &Vector2::new(u_px, v_px), None)?;
        Some(height_mm(calibration, &hit.hit_in_camera.xyz))
    };
    let (mut low, mut high) = (0.0, SIZE_PX[1] as f64 - 1.0);
    let sign = above(low)?.signum();
    if above(high)?.signum() == sign {
        return None;
    }
    for _ in 0..N_BISECTIONS {
        let middle = 0.5 * (low + high);
        if above(middle)?.signum() == sign { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

/// Depth beyond the plate, which is constant along the travel.
fn height_mm(calibration: &Calibration, at_mm: &Vector3<f64>) -> f64 {
    let travel = calibration.stage.and_then(|stage| stage.linear()).map_or(Vector3::y(), |stage| stage.direction);
    let across = at_mm - travel * (at_mm.y / travel.y);
    let [depth_mm, rib_mm, length_mm] = PLATE_MM;
    across.z - depth_mm - rib_mm * (across.x / length_mm).sin()
}

/// A typical station: 1280 × 1024 pixels at 400 mm, five orders.
fn calibration() -> Calibration {
    let normal = Vector3::new(-0.013, 0.387, 0.922).normalize();
    let axis = Vector3::new(-0.001, 0.409, 0.913).normalize();
    let fan = Vector3::new(1.0, 0.0034, 0.0);
    let groove = Vector3::new(1.0, 0.0087, 0.0105);
    let grating = Grating {
        source_mm: Vector3::new(1.0, -174.0, 11.0),
        axis,
        fan: (fan - axis * fan.dot(&axis)).normalize(),
        normal,
        groove: (groove - normal * groove.dot(&normal)).normalize(),
        gap_mm: 18.5,
        wavelength_over_period: 0.033,
    };
    let [width_px, height_px] = SIZE_PX;
    let middle = SIZE_PX.map(|size| size as f64 / 2.0);
    let matrix = [[2520.0, 0.0, middle[0]], [0.0, 2518.0, middle[1]], [0.0, 0.0, 1.0]];
    Calibration {
        id: "synthetic".into(),
        camera: Camera::from_opencv(width_px, height_px, matrix, &[-0.09, 0.11, 0.0, 0.0, 0.0]),
        orders: vec![-2, -1, 0, 1, 2],
        light: LightSurfaces::Grating(grating),
        stage: Some(StageAxis::new(Vector3::new(-0.005, 0.9998, -0.02).normalize()).into()),
        depth_range_mm: DepthRangeMm { near_mm: 385.0, far_mm: 415.0 },
        covariance: DMatrix::from_diagonal_element(22, 22, 1e-10),
    }
}
