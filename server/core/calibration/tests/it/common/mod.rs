//! A station with known truth and the features that a perfect extraction would find in its images, with white noise.
//!
//! It shares the grating's mathematics with the calibration, so it tests the estimation, not the model; the rendered
//! rig and the photographs test the model.

pub mod refinement;

use calibration::{
    BoardGeometry, BoardPattern, CalibrationInput, NominalGrating, NominalProjector, PoseInput, StageViewInput,
};
use nalgebra::{Rotation3, Vector2, Vector3};
use optics::{BoardFrame, Camera, CameraFrame, Grating, Rigid, StagePosition};
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use vision::{BoardCorners, CentrelinePoint, Centrelines, Corner, LineDirection, Segment};

pub const COLUMNS: usize = 11;
pub const ROWS: usize = 8;
pub const SQUARE_MM: f64 = 12.0;

/// Columns between the simulated points of a line; fewer points keep the tests quick.
const COLUMN_STEP: i64 = 6;

/// Parameters of a test station.
#[derive(Clone)]
pub struct Rig {
    pub camera: Camera,
    pub grating: Grating,
    pub orders: Vec<i8>,
    pub stage: Vector3<f64>,
    /// σ per axis of the stage's deviations from straight and uniform travel, mm.
    pub wobble_sigma_mm: f64,
    /// One σ of the carriage's rotation about every axis in a stage view.
    pub yaw_sigma_rad: f64,
    pub corner_sigma_px: f64,
    pub line_sigma_px: f64,
    /// Largest tilt of the boards about either axis.
    pub tilt_rad: f64,
    /// Largest distance of the boards from a depth of 400 mm.
    pub half_depth_mm: f64,
    pub seed: u64,
}

/// Deviation of the stage in a view: a shift of the board's centre (mm), and a rotation about it.
pub type Wobble = (Vector3<f64>, Rotation3<f64>);

fn board_centre() -> Vector3<f64> {
    Vector3::new((COLUMNS - 1) as f64, (ROWS - 1) as f64, 0.0) * (SQUARE_MM / 2.0)
}

impl Rig {
    pub fn new(seed: u64) -> Self {
        let matrix = [[2518.0, 0.0, 635.0], [0.0, 2516.0, 502.0], [0.0, 0.0, 1.0]];
        let camera = Camera::from_opencv(1280, 1024, matrix, &[-0.097, 0.115, -1.5e-5, 1.2e-4]);
        let axis = Vector3::new(-0.001, 0.409, 0.9125).normalize();
        let fan = Vector3::new(1.0, 0.004, 0.0);
        let fan = (fan - axis * fan.dot(&axis)).normalize();
        let normal = (axis + fan * 0.01 + axis.cross(&fan) * 0.02).normalize();
        let groove = Vector3::new(1.0, 0.009, 0.01);
        let groove = (groove - normal * groove.dot(&normal)).normalize();
        let grating = Grating {
            source_mm: Vector3::new(1.0, -174.0, 11.0),
            axis,
            fan,
            normal,
            groove,
            gap_mm: 18.0,
            wavelength_over_period: 0.033,
        };
        Self {
            camera,
            grating,
            orders: vec![-2, -1, 0, 1, 2],
            stage: Vector3::new(-0.005, 0.9998, -0.02),
            wobble_sigma_mm: 0.0,
            yaw_sigma_rad: 0.0,
            corner_sigma_px: 0.01,
            line_sigma_px: 0.05,
            tilt_rad: 0.4,
            half_depth_mm: 25.0,
            seed,
        }
    }

    /// Features of `n_poses` board poses and `n_stage` stage views.
    pub fn input(&self, n_poses: usize, n_stage: usize) -> CalibrationInput {
        self.wobbling_input(n_poses, n_stage).0
    }

    /// The same, and the stage's deviation from straight and uniform travel in every stage view.
    pub fn wobbling_input(&self, n_poses: usize, n_stage: usize) -> (CalibrationInput, Vec<Wobble>) {
        // Separate generators, so that the wobble does not change the noise of the other features.
        let mut of_stage = Pcg64Mcg::seed_from_u64(self.seed + 1_000_000);
        let shifts: Vec<Vector3<f64>> =
            (0..n_stage).map(|_| Vector3::from_fn(|_, _| self.wobble_sigma_mm * normal(&mut of_stage))).collect();
        let turns = shifts
            .iter()
            .map(|_| Rotation3::new(Vector3::from_fn(|_, _| self.yaw_sigma_rad * normal(&mut of_stage))));
        let wobble: Vec<Wobble> = shifts.iter().copied().zip(turns).collect();
        let mut random = Pcg64Mcg::seed_from_u64(self.seed);
        let poses = (0..n_poses)
            .map(|idx| {
                let pose = self.pose(&mut random);
                PoseInput {
                    name: format!("board/{idx:03}.png"),
                    corners: self.corners(&pose, &mut random),
                    centrelines: Some(self.centrelines(&pose, &mut random)),
                    single_line_images: Vec::new(),
                }
            })
            .collect();
        let carried = self.pose(&mut random);
        let stage_views = (0..n_stage)
            .map(|idx| {
                let position_mm = -20.0 + 10.0 * idx as f64;
                let (shift_mm, turn) = wobble[idx];
                let travel = self.stage * position_mm + shift_mm;
                let centre = carried.rotation * board_centre();
                let moved =
                    Rigid::new(turn * carried.rotation, carried.translation_mm + travel + centre - turn * centre);
                StageViewInput {
                    name: format!("stage/{idx:03}.png"),
                    corners: self.corners(&moved, &mut random),
                    position: StagePosition::LinearMm(position_mm),
                }
            })
            .collect();
        let input = CalibrationInput {
            width_px: self.camera.width_px,
            height_px: self.camera.height_px,
            board: BoardGeometry {
                inner_columns: COLUMNS,
                inner_rows: ROWS,
                square_mm: Vector2::repeat(SQUARE_MM),
                pattern: BoardPattern::Squares,
            },
            projector: NominalProjector {
                grating: Some(NominalGrating { wavelength_nm: 660.0, lines_per_mm: 50.0 }),
                orders: self.orders.clone(),
            },
            poses,
            stage_views,
            angle_sigma_deg: None,
        };
        (input, wobble)
    }

    pub fn pose(&self, random: &mut Pcg64Mcg) -> Rigid<CameraFrame, BoardFrame> {
        let mut tilt = || self.tilt_rad * random.random_range(-1.0..1.0);
        let rotation = Rotation3::from_euler_angles(tilt(), tilt(), 0.3 * tilt());
        let depth = 400.0 + self.half_depth_mm * random.random_range(-1.0..1.0);
        let side = |random: &mut Pcg64Mcg| 8.0 * random.random_range(-1.0..1.0);
        let centre = Vector3::new(side(random), side(random), depth);
        Rigid::new(rotation, centre - rotation * board_centre())
    }

    pub fn corners(&self, pose: &Rigid<CameraFrame, BoardFrame>, random: &mut Pcg64Mcg) -> BoardCorners {
        let mut corners = Vec::new();
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let on_board = Vector3::new(column as f64, row as f64, 0.0) * SQUARE_MM;
                let pixel = self.camera.project(&(pose.rotation * on_board + pose.translation_mm)).unwrap();
                corners.push(Corner {
                    row,
                    column,
                    u_px: pixel.x + self.corner_sigma_px * normal(random),
                    v_px: pixel.y + self.corner_sigma_px * normal(random),
                    sigma_px: self.corner_sigma_px.max(1e-4),
                });
            }
        }
        BoardCorners { inner_columns: COLUMNS, inner_rows: ROWS, corners }
    }

    /// One segment per order across the board's plane, one point per [`COLUMN_STEP`] columns of the image.
    pub fn centrelines(&self, pose: &Rigid<CameraFrame, BoardFrame>, random: &mut Pcg64Mcg) -> Centrelines {
        let mut segments = Vec::new();
        for &order in &self.orders {
            let trace: Vec<Vector2<f64>> = (-400..=400)
                .filter_map(|step| {
                    let ray = self.grating.ray(f64::from(step) * 1e-3, order)?;
                    let n = pose.axes().column(2);
                    let reach = n.dot(&(pose.translation_mm - ray.origin_mm)) / n.dot(&ray.direction);
                    self.camera.project(&(ray.origin_mm + ray.direction * reach))
                })
                .collect();
            let mut points = Vec::new();
            for pair in trace.windows(2) {
                let (from, to) = (pair[0], pair[1]);
                let along = (to - from).normalize();
                for u in ((from.x.ceil() as i64)..(to.x.ceil() as i64)).filter(|u| u % COLUMN_STEP == 0) {
                    let v = from.y + (to.y - from.y) * (u as f64 - from.x) / (to.x - from.x);
                    if !(0..1280).contains(&u) || !(0.0..1023.0).contains(&v) {
                        continue;
                    }
                    let across = [-along.y, along.x];
                    let error = self.line_sigma_px * normal(random);
                    points.push(CentrelinePoint {
                        u_px: u as f64 + across[0] * error,
                        v_px: v + across[1] * error,
                        normal: across,
                        sigma_px: self.line_sigma_px.max(1e-4),
                        intensity: 150.0,
                        width_px: 6.0,
                        saturated: false,
                    });
                }
            }
            if !points.is_empty() {
                segments.push(Segment { points });
            }
        }
        Centrelines { segments, direction: LineDirection::Rows, correlation_px: 1.0, lit_line: None }
    }
}

fn normal(random: &mut Pcg64Mcg) -> f64 {
    StandardNormal.sample(random)
}

/// Runs a calibration without progress.
pub fn calibrated(
    input: &CalibrationInput,
) -> Result<calibration::CalibrationResult, calibration::CalibrationError> {
    calibration::calibrate(input, &calibration::CalibrationOptions::default(), &mut |_, _| {
        calibration::ProgressControl::Continue
    })
}
