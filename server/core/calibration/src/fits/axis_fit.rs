//! The axis of a turntable from a board on it (`docs/maths/turntable.md`, eq. 2–8).

use nalgebra::{Matrix4, Matrix6, Rotation3, SMatrix, SVector, Vector3, Vector6};
use optics::stage::AngleError;
use optics::{BoardFrame, CameraFrame, PartFrame, Rigid, RotaryAxis};

use crate::error::CalibrationError;
use crate::findings::report::AxisReport;
use crate::fits::axis_checks::{check_angles, check_rotations, first_axis};
use crate::fits::excess::excess_sigma;
use crate::params::{MAX_AXIS_TILT_SIGMA_RAD, MAX_RELATIVE_AXIS_SHIFT_SIGMA, MIN_VIEWS_FOR_ANGLE_SIGMA};
use crate::solving::bundle_state::BoardPose;
use crate::solving::normal::Derived;

/// Parameters of the fit: pose of the board at angle 0, then tilt and shift of the axis.
const PARAMETERS: usize = 10;

/// Of these, the board's.
const BOARD_PARAMETERS: usize = 6;

/// Step of the numerical derivatives (mm, rad): the error of central differences is then 1e-10.
const DERIVATIVE_STEP: f64 = 1e-5;

/// Gauss–Newton steps: the initial axis is accurate to a thousandth, and each step squares the error.
const STEPS: usize = 8;

type Jacobian = SMatrix<f64, 6, PARAMETERS>;
type Parameters = SVector<f64, PARAMETERS>;
/// Dependence of the axis on the pose of one board.
type Gain = SMatrix<f64, 4, 6>;

/// One board on the table, as determined by the camera's fit.
#[derive(Debug, Clone)]
pub struct RotaryView {
    /// Name for reports.
    pub name: String,
    /// Stated angle of the table.
    pub angle_deg: f64,
    /// Pose of the board.
    pub pose: BoardPose,
    /// Covariance of the pose (translation, rotation) for a fixed camera.
    pub noise: Matrix6<f64>,
}

/// The axis, and its dependence on the boards.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisFit {
    /// The axis, referred to its point nearest to the boards.
    pub axis: RotaryAxis,
    gains: Vec<Gain>,
    /// Contribution of angle and model error to the covariance, in addition to the boards' noise.
    own: Matrix4<f64>,
    /// Deviations per view: angle, along the rotation, radial and along the axis, µm.
    deviations_um: Vec<[f64; 4]>,
    /// RMS of the boards' residuals over their noise.
    noise_ratio: f64,
    angle_sigma_stated: bool,
}

/// The model at given parameters.
#[derive(Clone)]
struct Turn {
    board: Rigid<PartFrame, BoardFrame>,
    axis: RotaryAxis,
}

impl Turn {
    fn pose(&self, angle_rad: f64) -> BoardPose {
        let motion = self.axis.motion(angle_rad);
        let origin = motion.camera_from_part(&optics::PointMm::new(self.board.translation_mm)).xyz;
        let turn = Rotation3::from_axis_angle(&nalgebra::Unit::new_unchecked(self.axis.direction), angle_rad);
        Rigid::new(turn * self.board.rotation, origin)
    }

    fn stepped(&self, step: &Parameters) -> Self {
        let of_board: [f64; BOARD_PARAMETERS] = std::array::from_fn(|i| step[i]);
        let of_axis: [f64; 4] = std::array::from_fn(|i| step[BOARD_PARAMETERS + i]);
        Self { board: self.board.stepped(&of_board), axis: self.axis.moved(&of_axis) }
    }

    fn jacobian(&self, angle_rad: f64) -> Jacobian {
        let mut jacobian = Jacobian::zeros();
        for column in 0..PARAMETERS {
            let mut step = Parameters::zeros();
            step[column] = DERIVATIVE_STEP;
            let (plus, minus) = (self.stepped(&step), self.stepped(&-step));
            let slope = pose_difference(&plus.pose(angle_rad), &minus.pose(angle_rad)) / (2.0 * DERIVATIVE_STEP);
            jacobian.set_column(column, &slope);
        }
        jacobian
    }

    /// Derivative of the pose with respect to the angle: translation and rotation per radian.
    fn by_angle(&self, angle_rad: f64) -> Vector6<f64> {
        let lever = self.pose(angle_rad).translation_mm - self.axis.point_mm;
        let turned = self.axis.direction.cross(&lever);
        let d = self.axis.direction;
        Vector6::new(turned.x, turned.y, turned.z, d.x, d.y, d.z)
    }
}

/// Difference `seen` − `expected`: translation, mm, and rotation vector, rad.
fn pose_difference(seen: &BoardPose, expected: &BoardPose) -> Vector6<f64> {
    let shift = seen.translation_mm - expected.translation_mm;
    let turn = small_rotation_vector(&(seen.rotation * expected.rotation.inverse()));
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Rotation vector of a rotation of less than 180°, rad. From sine and cosine: with the cosine alone, as in nalgebra,
/// rounding can lose the angle of a rotation near zero.
fn small_rotation_vector(turn: &Rotation3<f64>) -> Vector3<f64> {
    let matrix = turn.matrix();
    let skew = (matrix - matrix.transpose()) / 2.0;
    let along = Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]);
    let sine = along.norm();
    if sine > 0.0 { along * (sine.atan2((matrix.trace() - 1.0) / 2.0) / sine) } else { along }
}

/// Fits the axis to the boards. `angle_sigma_deg`: σ of the stated angles, if known; otherwise it is estimated from the
/// boards.
///
/// # Errors
/// Too few angles, boards that did not rotate as stated, an axis that they do not determine.
pub fn axis_fit(
    views: &[RotaryView],
    board_centre_mm: &Vector3<f64>,
    angle_sigma_deg: Option<f64>,
) -> Result<AxisFit, CalibrationError> {
    check_angles(views.iter().map(|view| view.angle_deg))?;
    check_rotations(views)?;
    let axis = first_axis(views).ok_or_else(|| unobservable(f64::INFINITY, f64::INFINITY))?;
    let centres: Vec<Vector3<f64>> =
        views.iter().map(|view| view.pose.rotation * board_centre_mm + view.pose.translation_mm).collect();
    let middle_mm = centres.iter().sum::<Vector3<f64>>() / centres.len() as f64;
    let start = Turn::through(&views[0], axis.with_point_near(&middle_mm));
    let stated_rad = angle_sigma_deg.map(f64::to_radians);
    let (mut turn, mut solved) = minimise(start, views, stated_rad.unwrap_or(0.0))?;
    let mut sigma_rad = stated_rad;
    if stated_rad.is_none() && views.len() >= MIN_VIEWS_FOR_ANGLE_SIGMA {
        let seen_rad = angle_sigma_rad(&turn, views);
        (turn, solved) = minimise(turn, views, seen_rad)?;
        sigma_rad = Some(seen_rad);
    }
    turn.axis = RotaryAxis { angle_error: sigma_rad.and_then(AngleError::new), ..turn.axis };
    let fit = finished(&turn, &solved, views, (&centres, sigma_rad.unwrap_or(0.0)), stated_rad.is_some());
    let covariance = solved.axis_covariance() * fit.widening();
    let [tilt_rad, shift_mm] = [0, 2].map(|i| covariance[(i, i)].max(covariance[(i + 1, i + 1)]).max(0.0).sqrt());
    let limit_mm = MAX_RELATIVE_AXIS_SHIFT_SIGMA * middle_mm.norm();
    if !(tilt_rad <= MAX_AXIS_TILT_SIGMA_RAD && shift_mm <= limit_mm) {
        return Err(unobservable(shift_mm, tilt_rad.to_degrees()));
    }
    Ok(fit)
}

fn unobservable(shift_mm: f64, tilt_deg: f64) -> CalibrationError {
    CalibrationError::AxisUnobservable { shift_mm, tilt_deg }
}

impl Turn {
    /// With the board where `view` observed it.
    fn through(view: &RotaryView, axis: RotaryAxis) -> Self {
        let angle_rad = view.angle_deg.to_radians();
        let motion = axis.motion(angle_rad);
        let back = Rotation3::from_axis_angle(&nalgebra::Unit::new_unchecked(axis.direction), -angle_rad);
        let origin = motion.part_from_camera(&optics::PointMm::<CameraFrame>::new(view.pose.translation_mm)).xyz;
        Self { board: Rigid::new(back * view.pose.rotation, origin), axis }
    }
}

/// The normal equations at the minimum.
struct Solved {
    covariance: SMatrix<f64, PARAMETERS, PARAMETERS>,
    gains: Vec<Gain>,
    chi_squared: f64,
}

impl Solved {
    fn axis_covariance(&self) -> Matrix4<f64> {
        self.covariance.fixed_view::<4, 4>(BOARD_PARAMETERS, BOARD_PARAMETERS).into_owned()
    }
}

fn minimise(mut turn: Turn, views: &[RotaryView], sigma_rad: f64) -> Result<(Turn, Solved), CalibrationError> {
    let lost = || unobservable(f64::INFINITY, f64::INFINITY);
    for _ in 0..STEPS {
        let (normal, right, _) = equations(&turn, views, sigma_rad).ok_or_else(lost)?;
        let step = normal.cholesky().ok_or_else(lost)?.solve(&right);
        turn = turn.stepped(&step);
    }
    let (normal, _, chi_squared) = equations(&turn, views, sigma_rad).ok_or_else(lost)?;
    let covariance = normal.cholesky().ok_or_else(lost)?.inverse();
    let gain = |view: &RotaryView| -> Option<Gain> {
        let angle_rad = view.angle_deg.to_radians();
        let weight = weight(&turn, view, sigma_rad)?;
        let whole = covariance * turn.jacobian(angle_rad).transpose() * weight;
        Some(whole.fixed_view::<4, 6>(BOARD_PARAMETERS, 0).into_owned())
    };
    let gains = views.iter().map(gain).collect::<Option<Vec<Gain>>>().ok_or_else(lost)?;
    Ok((turn, Solved { covariance, gains, chi_squared }))
}

type Equations = (SMatrix<f64, PARAMETERS, PARAMETERS>, Parameters, f64);

fn equations(turn: &Turn, views: &[RotaryView], sigma_rad: f64) -> Option<Equations> {
    let (mut normal, mut right, mut chi_squared) = (SMatrix::zeros(), Parameters::zeros(), 0.0);
    for view in views {
        let angle_rad = view.angle_deg.to_radians();
        let error = pose_difference(&view.pose, &turn.pose(angle_rad));
        let (jacobian, weight) = (turn.jacobian(angle_rad), weight(turn, view, sigma_rad)?);
        normal += jacobian.transpose() * weight * jacobian;
        right += jacobian.transpose() * weight * error;
        chi_squared += (error.transpose() * weight * error)[(0, 0)];
    }
    Some((normal, right, chi_squared))
}

/// Inverse covariance of a pose, including the angle's error.
fn weight(turn: &Turn, view: &RotaryView, sigma_rad: f64) -> Option<Matrix6<f64>> {
    let by_angle = turn.by_angle(view.angle_deg.to_radians());
    Some((view.noise + by_angle * by_angle.transpose() * (sigma_rad * sigma_rad)).cholesky()?.inverse())
}

/// The σ of the angle that explains the boards' deviations along the rotation; if their noise does, the σ that the
/// noise could hide; as in [`super::stage_fit`] for straightness.
fn angle_sigma_rad(turn: &Turn, views: &[RotaryView]) -> f64 {
    let along = |view: &RotaryView| {
        let angle_rad = view.angle_deg.to_radians();
        let (by_angle, error) = (turn.by_angle(angle_rad), pose_difference(&view.pose, &turn.pose(angle_rad)));
        let weight = view.noise.cholesky()?.inverse();
        let variance = 1.0 / (by_angle.transpose() * weight * by_angle)[(0, 0)];
        Some(((by_angle.transpose() * weight * error)[(0, 0)] * variance, variance))
    };
    let errors: Vec<(f64, f64)> = views.iter().filter_map(along).collect();
    // One degree of freedom is used by the board's own angle; two less than the rest, because Student's t is wider.
    let n = errors.len() as f64;
    let expected = n - 3.0;
    let misfit = |variance: f64| errors.iter().map(|(e, noise)| e * e / (variance + noise)).sum::<f64>();
    let information = errors.iter().map(|(_, noise)| noise.powi(-2)).sum::<f64>() / 2.0;
    let hidden = ((n - 1.0) / n * information).powf(-0.5);
    excess_sigma(hidden, errors.iter().map(|(e, _)| e * e).sum::<f64>() / expected, expected, misfit)
}

fn finished(
    turn: &Turn,
    solved: &Solved,
    views: &[RotaryView],
    (centres, sigma_rad): (&[Vector3<f64>], f64),
    angle_sigma_stated: bool,
) -> AxisFit {
    let degrees = (6 * views.len() - PARAMETERS) as f64;
    let noise_ratio = (solved.chi_squared / degrees).sqrt();
    let mut own = solved.axis_covariance() * (noise_ratio * noise_ratio - 1.0).max(0.0);
    for (view, gain) in views.iter().zip(&solved.gains) {
        let followed = gain * turn.by_angle(view.angle_deg.to_radians()) * sigma_rad;
        own += followed * followed.transpose();
    }
    let axis = turn.axis;
    let deviations_um = views.iter().zip(centres).map(|(view, centre)| {
        let expected = turn.pose(view.angle_deg.to_radians());
        let on_board = view.pose.rotation.inverse() * (centre - view.pose.translation_mm);
        let off = centre - (expected.rotation * on_board + expected.translation_mm);
        let arm = centre - axis.point_mm;
        let radial = (arm - axis.direction * axis.direction.dot(&arm)).try_normalize(0.0).unwrap_or_default();
        let along = axis.direction.cross(&radial);
        let [along, radial, axial] = [along, radial, axis.direction].map(|way| 1e3 * way.dot(&off));
        [view.angle_deg, along, radial, axial]
    });
    AxisFit {
        axis,
        gains: solved.gains.clone(),
        own,
        deviations_um: deviations_um.collect(),
        noise_ratio,
        angle_sigma_stated,
    }
}

impl AxisFit {
    /// Factor on the covariance from the residuals.
    fn widening(&self) -> f64 {
        (self.noise_ratio * self.noise_ratio).max(1.0)
    }

    /// Deviation of the boards from a pure rotation, relative to their noise.
    pub fn noise_ratio(&self) -> f64 {
        self.noise_ratio
    }

    /// The axis as a derived quantity of a fit in which the stage views, its last blocks, have free poses.
    pub fn derived(&self, n_globals: usize, n_poses: usize) -> Derived {
        let first_view = n_poses - self.gains.len();
        let by_block =
            self.gains.iter().enumerate().map(|(idx, gain)| {
                (first_view + idx, nalgebra::DMatrix::from_column_slice(4, 6, gain.as_slice()))
            });
        Derived {
            by_globals: nalgebra::DMatrix::zeros(4, n_globals),
            by_block: by_block.collect(),
            own: nalgebra::DMatrix::from_column_slice(4, 4, self.own.as_slice()),
        }
    }

    /// The report, with the covariance of the whole fit.
    pub fn report(&self, covariance: &Matrix4<f64>) -> AxisReport {
        let sigma = |i: usize| covariance[(i, i)].max(0.0).sqrt();
        AxisReport {
            point_mm: self.axis.point_mm.into(),
            direction: self.axis.direction.into(),
            tilt_sigma_deg: [sigma(0).to_degrees(), sigma(1).to_degrees()],
            shift_sigma_mm: [sigma(2), sigma(3)],
            angle_sigma_deg: self.axis.angle_error.map(|error| error.sigma_rad().to_degrees()),
            angle_sigma_stated: self.angle_sigma_stated,
            deviations_um: self.deviations_um.clone(),
            noise_ratio: self.noise_ratio,
        }
    }
}
