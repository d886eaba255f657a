//! Joint bundle adjustment of camera, light sheets, stage and board poses, with all pixels
//! (`docs/maths/calibration.md`, eq. 1–3).

use nalgebra::{Vector2, Vector3, Vector6};
use optics::{CAMERA_PARAMETERS, Camera, LightSurfaces, SurfaceHit};
use rayon::prelude::*;

use crate::params::{
    CORNER_HUBER_SIGMAS, LASER_HUBER_SIGMAS, STEP_ANGLE_RAD, STEP_DISTORTION, STEP_LENGTH_RELATIVE,
};
use crate::solving::bundle_state::{BoardPose, BundleState};
use crate::solving::normal::{ArrowNormal, BlockNormal, Ranges};
use crate::solving::observation::{CornerView, LaserObservation, huber};
use crate::solving::prior::Priors;
use crate::solving::row_sums::{CORNER_COLUMNS, LASER_COLUMNS, MAX_ROW_LIGHT_PARAMETERS, Rows};
use crate::solving::solver::Problem;

/// The observations and the free parameters.
pub struct Bundle {
    /// Images of the board.
    pub views: Vec<CornerView>,
    /// Laser points, in any order.
    pub laser: Vec<LaserObservation>,
    /// Which globals are estimated.
    pub free: Vec<bool>,
    /// Whether the board poses are estimated.
    pub free_poses: bool,
    /// Weak priors.
    pub priors: Priors,
    /// Corner residuals beyond this many σ count linearly.
    corner_limit_sigmas: f64,
    /// Laser points of each block, indices into `laser`.
    laser_of_block: Vec<Vec<usize>>,
    /// Views of each block, indices into `views`.
    views_of_block: Vec<Vec<usize>>,
}

/// A laser residual with the data needed for its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct SheetResidual {
    /// Distance of the observed point from the predicted curve in the image, px.
    pub residual_px: f64,
    /// The same along the camera ray: board depth − sheet depth, mm.
    pub depth_error_mm: f64,
    /// Unit gradient of the residual by (u, v).
    pub direction: Vector2<f64>,
    /// d(residual) / d(translation, rotation of the board).
    pub by_pose: [f64; 6],
    /// Factor from the sheet's motion along its normal (mm) to the residual (px).
    pub by_sheet_motion: f64,
    /// Ideal normalised coordinates of the pixel.
    pub ideal: Vector2<f64>,
    /// The sheet where the camera ray meets it.
    pub hit: SurfaceHit,
}

impl Bundle {
    /// A bundle over `n_blocks` poses.
    pub fn new(
        views: Vec<CornerView>,
        laser: Vec<LaserObservation>,
        free: Vec<bool>,
        free_poses: bool,
        priors: Priors,
        n_blocks: usize,
    ) -> Self {
        let mut laser_of_block = vec![Vec::new(); n_blocks];
        for (idx, point) in laser.iter().enumerate() {
            laser_of_block[point.block].push(idx);
        }
        let mut views_of_block = vec![Vec::new(); n_blocks];
        for (idx, view) in views.iter().enumerate() {
            views_of_block[view.block].push(idx);
        }
        Self {
            views,
            laser,
            free,
            free_poses,
            priors,
            corner_limit_sigmas: CORNER_HUBER_SIGMAS,
            laser_of_block,
            views_of_block,
        }
    }

    /// Without the robust limit of the corners: plain least squares.
    pub fn without_corner_limit(mut self) -> Self {
        self.corner_limit_sigmas = f64::INFINITY;
        self
    }

    fn add_corners(&self, station: &BundleState, view: &CornerView, sums: &mut BlockNormal) {
        let pose = station.pose_of(view);
        let carried = station.stage.is_some() && view.travel_mm != 0.0;
        let stage_start = CAMERA_PARAMETERS + station.light_parameters();
        let rotation = pose.rotation.into_inner();
        let mut rows = Rows::<CORNER_COLUMNS>::new();
        for corner in &view.corners {
            let arm = rotation * corner.board_mm;
            let Some(seen) = station.camera.project_with_jacobian(&(arm + pose.translation_mm)) else {
                sums.cost = f64::INFINITY;
                return;
            };
            let error = seen.pixel - corner.pixel;
            let (rho, robust) = huber(error.norm() / corner.sigma_px, self.corner_limit_sigmas);
            sums.cost += rho;
            let weight = robust / (corner.sigma_px * corner.sigma_px);
            for axis in 0..2 {
                let by_point = seen.by_point.row(axis).transpose();
                let by_turn = arm.cross(&by_point);
                let by_pose = if self.free_poses { pose_row(&by_point, &by_turn) } else { [0.0; 6] };
                let by_camera: [f64; CAMERA_PARAMETERS] = std::array::from_fn(|i| seen.by_camera[(axis, i)]);
                if carried {
                    let by_stage = by_point * view.travel_mm;
                    let runs: [(usize, &[f64]); 2] = [(0, &by_camera), (stage_start, by_stage.as_slice())];
                    sums.add(&runs, &by_pose, error[axis], weight);
                } else {
                    rows.push(&by_camera, &by_pose, error[axis], weight);
                }
            }
        }
        rows.add_to(sums);
    }

    fn add_laser(&self, station: &BundleState, light: &LightSurfaces, block: usize, sums: &mut BlockNormal) {
        let fits_row = light.parameters() <= MAX_ROW_LIGHT_PARAMETERS;
        let mut rows = Rows::<LASER_COLUMNS>::new();
        let mut phi_guess = None;
        for &idx in &self.laser_of_block[block] {
            let point = &self.laser[idx];
            let Some(sheet) = sheet_residual(&station.camera, light, &station.poses[block], point, phi_guess)
            else {
                sums.cost += LOST_POINT_COST;
                phi_guess = None;
                continue;
            };
            phi_guess = Some(sheet.hit.phi_rad);
            let (rho, robust) = huber(sheet.residual_px.abs() / point.sigma_px, LASER_HUBER_SIGMAS);
            sums.cost += rho * point.effective_weight;
            let weight = robust * point.effective_weight / (point.sigma_px * point.sigma_px);
            let by_camera = by_camera(&station.camera, &sheet);
            let ray = sheet.ideal.push(1.0);
            let Some(mut by_light) = light.normal_motion_by_parameters(point.order, &ray, &sheet.hit) else {
                continue;
            };
            by_light.iter_mut().for_each(|motion| *motion *= sheet.by_sheet_motion);
            let by_pose = if self.free_poses { sheet.by_pose } else { [0.0; 6] };
            if fits_row {
                rows.push(by_camera.iter().chain(&by_light), &by_pose, sheet.residual_px, weight);
            } else {
                let runs: [(usize, &[f64]); 2] = [(0, &by_camera), (CAMERA_PARAMETERS, &by_light)];
                sums.add(&runs, &by_pose, sheet.residual_px, weight);
            }
        }
        rows.add_to(sums);
    }

    fn block_sums(&self, station: &BundleState, block: usize) -> BlockNormal {
        let mut sums = BlockNormal::zeros(station.globals());
        for &view in &self.views_of_block[block] {
            self.add_corners(station, &self.views[view], &mut sums);
        }
        if let Some(light) = &station.light {
            self.add_laser(station, light, block, &mut sums);
        }
        if !self.free_poses {
            sums.bb.fill_diagonal(1.0);
        }
        sums
    }
}

/// Cost of a laser point whose ray misses its sheet: that of an outlier of thirty σ, so that no step benefits from
/// losing points.
const LOST_POINT_COST: f64 = 30.0 * LASER_HUBER_SIGMAS;

impl Problem for Bundle {
    type State = BundleState;

    fn linearise(&self, station: &BundleState) -> ArrowNormal {
        let blocks: Vec<BlockNormal> =
            (0..station.poses.len()).into_par_iter().map(|block| self.block_sums(station, block)).collect();
        let mut priors = BlockNormal::zeros(station.globals());
        self.priors.add_to(station, &mut priors);
        ArrowNormal::new(priors, blocks, &self.free)
    }

    fn cost(&self, station: &BundleState) -> f64 {
        let costs: Vec<f64> = (0..station.poses.len())
            .into_par_iter()
            .map(|block| {
                let corners: f64 = self.views_of_block[block]
                    .iter()
                    .map(|&view| self.corner_cost(station, &self.views[view]))
                    .sum();
                corners + self.laser_cost(station, block)
            })
            .collect();
        costs.iter().sum::<f64>() + self.priors.cost(station)
    }

    fn ranges(&self, station: &BundleState) -> Ranges {
        let n_poses = station.poses.len().max(1) as f64;
        let distance = station.poses.iter().map(|pose| pose.translation_mm.norm()).sum::<f64>() / n_poses;
        let length = STEP_LENGTH_RELATIVE * distance;
        let camera = &station.camera;
        let side = camera.width_px.max(camera.height_px) as f64;
        let (focal, centre) = (STEP_LENGTH_RELATIVE * camera.fx_px, STEP_LENGTH_RELATIVE * side);
        let mut globals = vec![focal, focal, centre, centre];
        globals.extend(STEP_DISTORTION);
        globals.extend(station.light.as_ref().map_or(Vec::new(), |light| light_ranges(light, length)));
        globals.resize(station.globals(), STEP_ANGLE_RAD);
        let angle = STEP_ANGLE_RAD;
        Ranges { globals, block: [length, length, length, angle, angle, angle] }
    }

    fn stepped(&self, station: &BundleState, globals: &[f64], blocks: &[Vector6<f64>]) -> BundleState {
        let mut parameters = station.camera.parameters();
        for (value, step) in parameters.iter_mut().zip(globals) {
            *value += step;
        }
        let light_end = CAMERA_PARAMETERS + station.light_parameters();
        let poses = station.poses.iter().zip(blocks).map(|(pose, step)| pose.stepped(&(*step).into())).collect();
        BundleState {
            camera: station.camera.with_parameters(&parameters),
            light: station.light.as_ref().map(|light| light.stepped(&globals[CAMERA_PARAMETERS..light_end])),
            stage: station
                .stage
                .map(|stage| stage + Vector3::from_column_slice(&globals[light_end..light_end + 3])),
            poses: if self.free_poses { poses } else { station.poses.clone() },
        }
    }
}

impl Bundle {
    fn corner_cost(&self, station: &BundleState, view: &CornerView) -> f64 {
        let pose = station.pose_of(view);
        view.corners
            .iter()
            .map(|corner| {
                let point = pose.rotation * corner.board_mm + pose.translation_mm;
                station.camera.project(&point).map_or(f64::INFINITY, |pixel| {
                    huber((pixel - corner.pixel).norm() / corner.sigma_px, self.corner_limit_sigmas).0
                })
            })
            .sum()
    }

    fn laser_cost(&self, station: &BundleState, block: usize) -> f64 {
        let Some(light) = &station.light else { return 0.0 };
        let mut phi_guess = None;
        let mut cost = 0.0;
        for &idx in &self.laser_of_block[block] {
            let point = &self.laser[idx];
            let sheet = sheet_residual(&station.camera, light, &station.poses[block], point, phi_guess);
            phi_guess = sheet.map(|s| s.hit.phi_rad);
            cost += sheet.map_or(LOST_POINT_COST, |s| {
                huber(s.residual_px.abs() / point.sigma_px, LASER_HUBER_SIGMAS).0 * point.effective_weight
            });
        }
        cost
    }
}

/// Ranges within which a light model is nearly linear: lengths, angles and λ/d_g by their positions in its local step.
fn light_ranges(light: &LightSurfaces, length: f64) -> Vec<f64> {
    let angle = STEP_ANGLE_RAD;
    match light {
        LightSurfaces::Planes(planes) => planes.iter().flat_map(|_| [angle, angle, length]).collect(),
        LightSurfaces::Pencil(pencil) => {
            vec![length, length, angle, angle, angle, STEP_LENGTH_RELATIVE * pencil.wavelength_over_period]
        }
        LightSurfaces::Grating(grating) => {
            let s = STEP_LENGTH_RELATIVE * grating.wavelength_over_period;
            vec![length, length, length, angle, angle, angle, angle, angle, length, s]
        }
    }
}

fn pose_row(by_point: &Vector3<f64>, by_turn: &Vector3<f64>) -> [f64; 6] {
    [by_point.x, by_point.y, by_point.z, by_turn.x, by_turn.y, by_turn.z]
}

/// d(residual) / d(camera): the camera's parameters act only through the pixel, r(u, v).
fn by_camera(camera: &Camera, sheet: &SheetResidual) -> [f64; CAMERA_PARAMETERS] {
    let pixel_by_camera = camera.pixel_by_camera(&sheet.ideal, &camera.distort(&sheet.ideal));
    let row = -(sheet.direction.transpose() * pixel_by_camera);
    std::array::from_fn(|i| row[i])
}

/// Distance in the image between an observed laser point and the intersection of its order's sheet with the board, with
/// its derivatives at the curve's nearest point.
///
/// The curve is where board depth − sheet depth, as a function of the pixel, is zero. One Newton step from the
/// observation leads to its foot on the curve, a second from there gives distance and derivatives. At the observation
/// itself the derivatives would contain its noise, and the product of the two does not average out: with thousands of
/// points it biased the focal length by its own σ.
///
/// `None` where the ray misses the board or the sheet.
pub fn sheet_residual(
    camera: &Camera,
    light: &LightSurfaces,
    pose: &BoardPose,
    point: &LaserObservation,
    phi_guess_rad: Option<f64>,
) -> Option<SheetResidual> {
    let first = crossing(camera, light, pose, point.order, &point.pixel, phi_guess_rad)?;
    let foot = point.pixel - first.by_pixel * (first.depth_error_mm / first.by_pixel.norm_squared());
    let near = crossing(camera, light, pose, point.order, &foot, Some(first.hit.phi_rad))?;
    let to_px = 1.0 / near.by_pixel.norm();
    let direction = near.by_pixel * to_px;
    let board_steepness = near.board_normal.dot(&near.ray);
    let by_translation = near.board_normal * (to_px / board_steepness);
    let lever = pose.translation_mm - near.ray * near.board_depth;
    let by_turn = near.board_normal.cross(&lever) * (to_px / board_steepness);
    Some(SheetResidual {
        residual_px: direction.dot(&(point.pixel - foot)) + near.depth_error_mm * to_px,
        depth_error_mm: first.depth_error_mm,
        direction,
        by_pose: pose_row(&by_translation, &by_turn),
        by_sheet_motion: -to_px / near.hit.normal.dot(&near.ray),
        ideal: near.ray.xy(),
        hit: near.hit,
    })
}

/// Board and sheet along the camera ray of one pixel.
struct Crossing {
    ray: Vector3<f64>,
    board_normal: Vector3<f64>,
    board_depth: f64,
    hit: SurfaceHit,
    /// Board depth − sheet depth.
    depth_error_mm: f64,
    /// Its gradient by (u, v).
    by_pixel: Vector2<f64>,
}

fn crossing(
    camera: &Camera,
    light: &LightSurfaces,
    pose: &BoardPose,
    order: i8,
    pixel: &Vector2<f64>,
    phi_guess_rad: Option<f64>,
) -> Option<Crossing> {
    let ray = camera.ray_from_pixel(pixel)?;
    let board_normal = pose.axes().column(2).into_owned();
    let board_steepness = board_normal.dot(&ray);
    let board_depth = board_normal.dot(&pose.translation_mm) / board_steepness;
    if !(board_depth.is_finite() && board_depth > 0.0) {
        return None;
    }
    let hit = light.hit(order, &ray, phi_guess_rad).or_else(|| light.hit(order, &ray, None))?;
    let by_ray = hit.normal.xy() * (hit.depth_mm / hit.normal.dot(&ray))
        - board_normal.xy() * (board_depth / board_steepness);
    let by_pixel = camera.pixel_by_ideal(&ray.xy()).try_inverse()?.transpose() * by_ray;
    let steepness = by_pixel.norm_squared();
    (steepness.is_finite() && steepness > 0.0).then_some(Crossing {
        ray,
        board_normal,
        board_depth,
        hit,
        depth_error_mm: board_depth - hit.depth_mm,
        by_pixel,
    })
}
