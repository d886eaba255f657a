//! The simulated station of a study case: camera, grating and board poses.

use calibration::bundle_state::BoardPose;
use nalgebra::{Rotation3, Unit, Vector3};
use optics::{Camera, DepthRangeMm, Grating, Rigid};
use rand::Rng;
use rand_pcg::Pcg64Mcg;

/// Distance of the centre of the working volume from the camera, mm, as in the paper.
pub const DISTANCE_MM: f64 = 400.0;

/// Half the depth of the working volume, mm.
pub const HALF_DEPTH_MM: f64 = 10.0;

/// Focal length of the simulated camera, px: a field 204 mm wide at 400 mm, as in the reference station.
const FOCAL_PX: f64 = 2518.0;

/// Angle between projector and camera axes.
const TRIANGULATION_RAD: f64 = 0.43;

/// Distance from the source to the scene, mm: the projector is beside the camera.
const THROW_MM: f64 = 425.0;

/// Maximum tilt of the boards about both axes, rad: ±20°, as for a hand-held board.
const BOARD_TILT_RAD: f64 = 0.35;

/// Square size of the smallest board, mm: when tilted, its nine rows still contain the outermost orders, 26 mm from the
/// centre.
const SMALLEST_SQUARE_MM: f64 = 9.0;

/// Corners of the simulated board.
pub const BOARD_COLUMNS: usize = 11;
/// Corners of the simulated board.
pub const BOARD_ROWS: usize = 8;

/// Correlation length of centreline noise from speckle, px, as measured on speckled lines.
const SPECKLE_CORRELATION_PX: f64 = 12.0;

/// Parameters of a study case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regime {
    /// Half the length of the lines at the working distance.
    pub field_half_width_mm: f64,
    /// Angle between grating normal and projector axis.
    pub grating_tilt_rad: f64,
    /// Board poses with laser light.
    pub n_poses: usize,
    /// Noise of a centreline point across the line.
    pub line_sigma_px: f64,
    /// Columns between independent centreline points.
    pub line_spacing_px: f64,
    /// Noise of a corner per axis.
    pub corner_sigma_px: f64,
}

impl Regime {
    /// The regime of the paper: narrow field, normal incidence, three poses, a coarse centreline.
    pub fn of_the_paper() -> Self {
        Self {
            field_half_width_mm: 15.0,
            grating_tilt_rad: 0.0,
            n_poses: 3,
            line_sigma_px: 0.5,
            line_spacing_px: SPECKLE_CORRELATION_PX,
            corner_sigma_px: 0.05,
        }
    }

    /// Diffraction orders.
    pub fn orders(&self) -> Vec<i8> {
        (-2..=2).collect()
    }

    /// λ/d_g: 660 nm, 50 lines/mm.
    pub fn wavelength_over_period(&self) -> f64 {
        660e-6 * 50.0
    }

    /// The camera: a lens with slight distortion.
    pub fn camera(&self) -> Camera {
        let matrix = [[FOCAL_PX, 0.0, 639.5], [0.0, FOCAL_PX, 511.5], [0.0, 0.0, 1.0]];
        Camera::from_opencv(1280, 1024, matrix, &[-0.1, 0.1, 0.0, 0.0, 0.0])
    }

    /// The projector above the camera, its grating tilted about the grooves.
    pub fn grating(&self) -> Grating {
        let axis = Vector3::new(0.0, TRIANGULATION_RAD.sin(), TRIANGULATION_RAD.cos());
        let fan = Vector3::x();
        let tilt = Rotation3::from_axis_angle(&Unit::new_unchecked(fan), self.grating_tilt_rad);
        Grating {
            source_mm: Vector3::new(0.0, 0.0, DISTANCE_MM) - axis * THROW_MM,
            axis,
            fan,
            normal: tilt * axis,
            groove: fan,
            gap_mm: 18.0,
            wavelength_over_period: self.wavelength_over_period(),
        }
    }

    /// Square size of the board, mm: the board contains all orders and spans the field.
    pub fn square_mm(&self) -> f64 {
        SMALLEST_SQUARE_MM.max(2.0 * self.field_half_width_mm / (BOARD_COLUMNS + 1) as f64)
    }

    /// Board poses drawn from `random`: tilts about both axes, depths within the working volume. The first three
    /// are at its centre, front and back.
    pub fn poses(&self, random: &mut Pcg64Mcg) -> Vec<BoardPose> {
        (0..self.n_poses)
            .map(|idx| {
                let depth = match idx {
                    0 => 0.0,
                    1 => -HALF_DEPTH_MM,
                    2 => HALF_DEPTH_MM,
                    _ => random.random_range(-HALF_DEPTH_MM..HALF_DEPTH_MM),
                };
                let mut tilt = || random.random_range(-BOARD_TILT_RAD..BOARD_TILT_RAD);
                let rotation = Rotation3::from_euler_angles(tilt(), tilt(), 0.3 * tilt());
                let middle = Vector3::new((BOARD_COLUMNS - 1) as f64, (BOARD_ROWS - 1) as f64, 0.0) * 0.5;
                let centre = Vector3::new(0.0, 0.0, DISTANCE_MM + depth);
                Rigid::new(rotation, centre - rotation * middle * self.square_mm())
            })
            .collect()
    }

    /// Depths of the working volume.
    pub fn depth_range_mm(&self) -> DepthRangeMm {
        DepthRangeMm { near_mm: DISTANCE_MM - HALF_DEPTH_MM, far_mm: DISTANCE_MM + HALF_DEPTH_MM }
    }
}
