//! The axis of a turntable from a part that it turns through more than a circle, without a board
//! (`docs/maths/turntable.md`, eq. 12–16): the axis about which surfaces observed twice coincide.

mod pairs;
mod surfels;

use std::borrow::Cow;

use nalgebra::{DMatrix, Matrix4, Vector3, Vector4};
use optics::{Calibration, RotaryAxis, StagePosition, Triangulator};
use remedy::Remedy;
use statistics::median;

use crate::error::ScanError;
use crate::input::frames::{Frames, of_every_frame};
use crate::points::profile::Profile;
use pairs::{Pair, pairs};
use surfels::{Line, lines, surfels};

/// Most iterations with new surfels and pairs; from 2 mm and 1° off the axis six suffice.
const MAX_ITERATIONS: usize = 25;
/// Fewest points of the surface observed twice.
const MIN_PAIRS: usize = 100;
/// Residuals beyond so many σ count linearly.
const HUBER_SIGMAS: f64 = 2.5;
/// Frames that share their noise, since each surfel is made from a frame and its two neighbours.
const FRAMES_PER_SURFEL: f64 = 3.0;
/// Smallest ratio of the information about a direction to that simulated by noise of the normals alone.
const INFORMATION_OVER_NOISE: f64 = 10.0;
/// Largest σ of the axis' direction, rad, and of its position relative to its distance: as for boards.
const MAX_TILT_SIGMA_RAD: f64 = 0.005;
const MAX_SHIFT_SIGMA_RELATIVE: f64 = 0.002;
/// The iterations end when a step is below this fraction of σ.
const STEP_SIGMAS: f64 = 0.2;

/// An axis estimated from a part.
#[derive(Debug, Clone, PartialEq)]
pub struct PartAxis {
    /// The axis, referred to the point nearest to the middle of the observed surface. The accuracy of the angles is
    /// unknown.
    pub axis: RotaryAxis,
    /// Covariance of the four parameters of [`RotaryAxis::moved`], rad and mm: from noise and from the uncertainty of
    /// camera and light.
    pub covariance: Matrix4<f64>,
    /// The calibration with this axis as its stage, and the joint covariance.
    pub calibration: Calibration,
    /// Number of points of the surface observed twice.
    pub n_pairs: usize,
    /// RMS distance of the two observations along the surface's normal, mm.
    pub rms_mm: f64,
    /// That RMS relative to the expected noise; above 1 the covariance is multiplied by its square.
    pub noise_ratio: f64,
}

/// Why a part does not determine the axis.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PartAxisError {
    /// The frames cannot be read.
    #[error(transparent)]
    Frames(#[from] ScanError),
    /// The stage is linear.
    #[error("frame {frame} states a position in millimetres, not an angle")]
    NotTurned {
        /// Index of the frame.
        frame: usize,
    },
    /// Too few points of the surface were observed twice by different lines.
    #[error("only {n_pairs} points of the part were observed twice by different lines, {needed} are needed")]
    TooFewPairs {
        /// Pairs found.
        n_pairs: usize,
        /// Pairs needed.
        needed: usize,
    },
    /// The part does not constrain all parameters of the axis: a body of revolution, or a part observed from too
    /// few sides.
    #[error(
        "the part does not constrain the axis in one direction: its surfaces give {information:.1} times the information \
         that noise of their normals alone would simulate, {needed} times are needed"
    )]
    Unconstrained {
        /// Information about that direction, relative to that simulated by noise alone.
        information: f64,
        /// Ratio needed.
        needed: f64,
    },
    /// The uncertainty of the axis is too large.
    #[error("the axis is too uncertain: {tilt_sigma_deg:.2}° and {shift_sigma_mm:.2} mm")]
    TooUncertain {
        /// Worst σ of the direction.
        tilt_sigma_deg: f64,
        /// Worst σ of the position.
        shift_sigma_mm: f64,
    },
    /// The iterations did not converge.
    #[error("the search for the axis did not converge (surfaces {rms_mm:.2} mm apart)")]
    NotConverged {
        /// RMS distance of the surfaces at the end.
        rms_mm: f64,
    },
}

impl Remedy for PartAxisError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::Frames(error) => return error.remedy(),
            Self::NotTurned { .. } => "use a scan taken on a turntable".into(),
            Self::TooFewPairs { .. } => {
                "start within a few millimetres of the axis and turn the part through at least a full turn with two lines, or \
                 take board views at several angles"
                    .into()
            }
            Self::Unconstrained { .. } => {
                "use a part that is not a body of revolution, off the axis and as large as the field, or take board views at several angles"
                    .into()
            }
            Self::TooUncertain { .. } => "turn a larger part with more relief, in finer steps".into(),
            Self::NotConverged { .. } => "start closer to the axis, and check that the part does not slip".into(),
        })
    }
}

/// Estimates the axis about which the surfaces of a turned part coincide. `start`: an axis within a few
/// millimetres and degrees of the true one; the stage of `calibration` is not used.
///
/// # Errors
/// [`PartAxisError`].
pub fn axis_from_part(
    frames: &dyn Frames,
    calibration: &Calibration,
    start: &RotaryAxis,
) -> Result<PartAxis, PartAxisError> {
    let calibration = &without_stage(calibration);
    let lines = labelled_lines(frames, calibration)?;
    let mut axis = RotaryAxis { angle_error: None, ..*start };
    let mut found = gauss_newton_step(&lines, calibration, &mut axis)?;
    for _ in 1..MAX_ITERATIONS {
        if found.step_sigmas < STEP_SIGMAS {
            let joint = joint_covariance(frames, calibration, &axis, &found.covariance)?;
            return checked(found, axis, calibration, joint);
        }
        found = gauss_newton_step(&lines, calibration, &mut axis)?;
    }
    Err(PartAxisError::NotConverged { rms_mm: found.rms_mm })
}

/// The points of every line, frame by frame in the sequence of the angles; every frame is labelled independently.
fn labelled_lines(frames: &dyn Frames, calibration: &Calibration) -> Result<Vec<Line>, PartAxisError> {
    let mut angles_rad = Vec::with_capacity(frames.n_frames());
    for frame in 0..frames.n_frames() {
        let StagePosition::RotaryDeg(angle_deg) = frames.position(frame) else {
            return Err(PartAxisError::NotTurned { frame });
        };
        angles_rad.push(angle_deg.to_radians());
    }
    let triangulator = Triangulator::new(calibration.clone());
    let profiles = of_every_frame(frames, |_, found| {
        let mut profile = Profile::default();
        profile.fill(found, &triangulator, calibration.depth_range_mm);
        (profile, found.correlation_px, found.direction)
    })?;
    Ok(lines(&profiles, &angles_rad, &calibration.orders))
}

/// The result of one iteration.
struct Iteration {
    covariance: Matrix4<f64>,
    n_pairs: usize,
    rms_mm: f64,
    noise_ratio: f64,
    step: Vector4<f64>,
    step_sigmas: f64,
    distance_mm: f64,
}

/// One Gauss–Newton step over the pairs formed with `axis` (eq. 14).
fn gauss_newton_step(
    lines: &[Line],
    calibration: &Calibration,
    axis: &mut RotaryAxis,
) -> Result<Iteration, PartAxisError> {
    let surfels = surfels(lines, calibration, axis);
    let n = surfels.len().max(1) as f64;
    let middle_mm = surfels.iter().map(|surfel| surfel.at_mm).sum::<Vector3<f64>>() / n;
    *axis = axis.with_point_near(&middle_mm);
    let pairs = pairs(&surfels, axis);
    if pairs.len() < MIN_PAIRS {
        return Err(PartAxisError::TooFewPairs { n_pairs: pairs.len(), needed: MIN_PAIRS });
    }
    let mut z: Vec<f64> = pairs.iter().map(|pair| pair.apart_mm.abs() / pair.sigma_mm).collect();
    // The median of |z| of a Gaussian is 0.6745 of its σ.
    let noise_ratio = (median(&mut z).unwrap_or(0.0) / 0.6745).max(1.0);
    let (mut normal, mut noise_information, mut right) = (Matrix4::zeros(), Matrix4::zeros(), Vector4::zeros());
    for pair in &pairs {
        let Pair { apart_mm, sigma_mm, jacobian, normal_noise } = pair;
        let z = apart_mm.abs() / (sigma_mm * noise_ratio);
        let weight = (HUBER_SIGMAS / z).min(1.0) / (sigma_mm * noise_ratio).powi(2) / FRAMES_PER_SURFEL;
        normal += jacobian * jacobian.transpose() * weight;
        noise_information += normal_noise * weight;
        right += jacobian * (apart_mm * weight);
    }
    let squares = pairs.iter().map(|pair| pair.apart_mm * pair.apart_mm).sum::<f64>();
    let rms_mm = (squares / pairs.len() as f64).sqrt();
    let heights =
        surfels.iter().map(|surfel| axis.direction.dot(&(surfel.at_mm - middle_mm)).powi(2)).sum::<f64>() / n;
    let information = least_information(&normal, &noise_information, heights.sqrt().max(1.0));
    let covariance = normal.try_inverse().filter(|_| information >= INFORMATION_OVER_NOISE);
    let Some(covariance) = covariance else {
        return Err(PartAxisError::Unconstrained { information, needed: INFORMATION_OVER_NOISE });
    };
    let step: Vector4<f64> = -(covariance * right);
    let step_sigmas = (step.dot(&(normal * step)) / 4.0).sqrt();
    *axis = axis.moved(&[step[0], step[1], step[2], step[3]]);
    let distance_mm = middle_mm.norm();
    Ok(Iteration { covariance, n_pairs: pairs.len(), rms_mm, noise_ratio, step, step_sigmas, distance_mm })
}

/// Information about the least determined direction: that of the pairs over that simulated by noisy normals (eq.
/// 15). `height_mm` makes tilts and shifts comparable.
fn least_information(normal: &Matrix4<f64>, noise_information: &Matrix4<f64>, height_mm: f64) -> f64 {
    let scale = Matrix4::from_diagonal(&Vector4::new(1.0 / height_mm, 1.0 / height_mm, 1.0, 1.0));
    let eigen = (scale * normal * scale).symmetric_eigen();
    let (least, value) = eigen.eigenvalues.argmin();
    let direction = scale * eigen.eigenvectors.column(least);
    value / direction.dot(&(noise_information * direction)).max(f64::MIN_POSITIVE)
}

/// Camera and light alone.
fn without_stage(calibration: &Calibration) -> Calibration {
    let n = calibration.covariance.nrows() - calibration.stage.map_or(0, |stage| stage.parameters());
    let covariance = calibration.covariance.view((0, 0), (n, n)).into_owned();
    Calibration { stage: None, covariance, ..calibration.clone() }
}

/// Joint covariance of camera, light and axis: a shift of camera or light by one σ along a mode moves the surfaces, and
/// the axis follows by one step (eq. 16).
fn joint_covariance(
    frames: &dyn Frames,
    calibration: &Calibration,
    axis: &RotaryAxis,
    axis_covariance: &Matrix4<f64>,
) -> Result<DMatrix<f64>, PartAxisError> {
    let n = calibration.covariance.nrows();
    let mut joint = DMatrix::zeros(n + 4, n + 4);
    joint.view_mut((0, 0), (n, n)).copy_from(&calibration.covariance);
    joint.view_mut((n, n), (4, 4)).copy_from(axis_covariance);
    for mode in calibration.sigma_modes() {
        let stepped = calibration.stepped(&mode);
        let axis_step = gauss_newton_step(&labelled_lines(frames, &stepped)?, &stepped, &mut axis.clone())?.step;
        for i in 0..4 {
            for (j, change) in mode.iter().enumerate() {
                joint[(n + i, j)] += axis_step[i] * change;
                joint[(j, n + i)] += axis_step[i] * change;
            }
            for j in 0..4 {
                joint[(n + i, n + j)] += axis_step[i] * axis_step[j];
            }
        }
    }
    Ok(joint)
}

/// The result, if the axis is certain enough.
fn checked(
    found: Iteration,
    axis: RotaryAxis,
    calibration: &Calibration,
    joint: DMatrix<f64>,
) -> Result<PartAxis, PartAxisError> {
    let n = calibration.covariance.nrows();
    let covariance: Matrix4<f64> = joint.fixed_view::<4, 4>(n, n).into_owned();
    let worst = |first: usize| {
        let block = covariance.fixed_view::<2, 2>(first, first).into_owned();
        block.symmetric_eigenvalues().max().max(0.0).sqrt()
    };
    let (tilt_sigma_rad, shift_sigma_mm) = (worst(0), worst(2));
    if tilt_sigma_rad > MAX_TILT_SIGMA_RAD || shift_sigma_mm > MAX_SHIFT_SIGMA_RELATIVE * found.distance_mm {
        return Err(PartAxisError::TooUncertain { tilt_sigma_deg: tilt_sigma_rad.to_degrees(), shift_sigma_mm });
    }
    let Iteration { n_pairs, rms_mm, noise_ratio, .. } = found;
    let calibration = Calibration { stage: Some(axis.into()), covariance: joint, ..calibration.clone() };
    Ok(PartAxis { axis, covariance, calibration, n_pairs, rms_mm, noise_ratio })
}
