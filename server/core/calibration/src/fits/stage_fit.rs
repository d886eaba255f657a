//! The stage from a board on it: direction per millimetre of travel, scale, straightness, tilt
//! (`docs/maths/calibration.md`, eq. 8–11 and 15).

use nalgebra::{DMatrix, Matrix3, Matrix3x6, Matrix6, Vector3};
use optics::StageAxis;
use optics::rotation::completing_frame;
use optics::stage::{Straightness, Tilt};

use crate::error::CalibrationError;
use crate::findings::report::StageReport;
use crate::first::camera_fit::CameraFit;
use crate::fits::excess::excess_sigma;
use crate::fits::tilt_fit::tilt_fit;
use crate::input::StageViewInput;
use crate::params::{MIN_STAGE_POSITIONS, MIN_STAGE_SPACING_SQUARES};
use crate::solving::bundle_state::BoardPose;
use crate::solving::normal::Derived;

/// A straight line through freely fitted board positions: x_i = x_0 + s_i·t.
#[derive(Debug, Clone, PartialEq)]
pub struct StageLine {
    /// Board position at stage position 0.
    pub origin_mm: Vector3<f64>,
    /// Travel per mm.
    pub direction: Vector3<f64>,
    /// Per view: weight of its board's position in `direction`, per mm.
    pub shares_per_mm: Vec<f64>,
    /// Deviations from that line.
    pub straightness: Straightness,
    /// Position, deviation along, and two across, µm.
    pub straightness_um: Vec<[f64; 4]>,
    /// Rotations of the carriage.
    pub tilt: Tilt,
    /// Position, rotation about the travel, and two across, µrad.
    pub tilt_urad: Vec<[f64; 4]>,
}

/// Checks that stage views, if there are any, determine the straightness: two always lie on a straight line.
/// `square_mm`: side of a square of the board.
///
/// # Errors
/// [`CalibrationError::TooFewStageViews`].
pub fn check_positions(positions_mm: &[f64], square_mm: f64) -> Result<(), CalibrationError> {
    let mut apart = positions_mm.to_vec();
    apart.sort_by(f64::total_cmp);
    apart.dedup_by(|next, kept| *next - *kept < MIN_STAGE_SPACING_SQUARES * square_mm);
    if apart.is_empty() || apart.len() >= MIN_STAGE_POSITIONS {
        return Ok(());
    }
    Err(CalibrationError::TooFewStageViews { needed: MIN_STAGE_POSITIONS, got: apart.len() })
}

/// Positions of a linear stage in its views; empty for a turntable.
pub fn positions_mm(views: &[StageViewInput]) -> Vec<f64> {
    views.iter().filter_map(|view| view.position.mm()).collect()
}

/// Checks that all stage views are of one kind of stage.
///
/// # Errors
/// [`CalibrationError::MixedStages`].
pub fn check_kinds(views: &[StageViewInput]) -> Result<(), CalibrationError> {
    let Some(expected) = views.first().map(|view| view.position.kind()) else { return Ok(()) };
    match views.iter().find(|view| view.position.kind() != expected) {
        None => Ok(()),
        Some(view) => Err(CalibrationError::MixedStages {
            view: view.name.clone(),
            found: view.position.kind().name(),
            expected: expected.name(),
        }),
    }
}

/// Fits the line to the middles of the boards at the given stage positions, which are the last views of the fit; `None`
/// without such views.
pub fn stage_line(fit: &CameraFit, positions_mm: &[f64], board_centre_mm: &Vector3<f64>) -> Option<StageLine> {
    let first_view = fit.station.poses.len() - positions_mm.len();
    let poses = &fit.station.poses[first_view..];
    let centre = |pose: &BoardPose| pose.rotation * board_centre_mm + pose.translation_mm;
    let places: Vec<Vector3<f64>> = poses.iter().map(centre).collect();
    let (origin_mm, direction, shares_per_mm) = straight_line(&places, positions_mm)?;
    let deviations: Vec<Vector3<f64>> =
        places.iter().zip(positions_mm).map(|(x, s)| x - origin_mm - direction * *s).collect();
    let noises: Vec<Matrix6<f64>> = (first_view..first_view + poses.len())
        .map(|block| fit.normal.block_covariance(block))
        .collect::<Option<_>>()?;
    let of_places: Vec<Matrix3<f64>> = poses
        .iter()
        .zip(&noises)
        .map(|(pose, noise)| {
            let by_pose = centre_by_pose(pose, board_centre_mm);
            by_pose * noise * by_pose.transpose()
        })
        .collect();
    let sigma_mm = straightness_sigma_mm(&deviations, &of_places);
    let of_rotations: Vec<Matrix3<f64>> =
        noises.iter().map(|noise| noise.fixed_view::<3, 3>(3, 3).into()).collect();
    let turned = tilt_fit(poses, &of_rotations);
    let first_mm = positions_mm.iter().copied().fold(f64::INFINITY, f64::min);
    let last_mm = positions_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let along = direction.normalize();
    let (across_1, across_2) = completing_frame(&along);
    let components = |vectors: &[Vector3<f64>], scale: f64| {
        let of = |(d, s): (&Vector3<f64>, &f64)| {
            [*s, scale * d.dot(&along), scale * d.dot(&across_1), scale * d.dot(&across_2)]
        };
        vectors.iter().zip(positions_mm).map(of).collect()
    };
    let middle_mm = origin_mm + direction * (0.5 * (first_mm + last_mm));
    Some(StageLine {
        origin_mm,
        direction,
        shares_per_mm,
        straightness: Straightness::new(sigma_mm, first_mm, last_mm, positions_mm.len())?,
        straightness_um: components(&deviations, 1e3),
        tilt: Tilt::new(turned.sigmas_rad, middle_mm, (first_mm, last_mm), positions_mm.len())?,
        tilt_urad: components(&turned.rotations_rad, 1e6),
    })
}

/// Least squares x_i = x_0 + s_i·t: x_0, t, and the weight of every x_i in t; `None` if all s_i are equal.
pub fn straight_line(
    places_mm: &[Vector3<f64>],
    positions_mm: &[f64],
) -> Option<(Vector3<f64>, Vector3<f64>, Vec<f64>)> {
    let n = places_mm.len() as f64;
    let mean_s = positions_mm.iter().sum::<f64>() / n;
    let spread: f64 = positions_mm.iter().map(|s| (s - mean_s).powi(2)).sum();
    if places_mm.is_empty() || spread <= 0.0 {
        return None;
    }
    let shares: Vec<f64> = positions_mm.iter().map(|s| (s - mean_s) / spread).collect();
    let direction: Vector3<f64> = places_mm.iter().zip(&shares).map(|(x, share)| x * *share).sum();
    let mean_x = places_mm.iter().sum::<Vector3<f64>>() / n;
    Some((mean_x - direction * mean_s, direction, shares))
}

impl StageLine {
    /// A stage along `direction` with the straightness and tilt of this line.
    pub fn axis(&self, direction: Vector3<f64>) -> StageAxis {
        StageAxis { direction, straightness: Some(self.straightness), tilt: Some(self.tilt) }
    }

    /// Covariance of the direction from the stage's deviations from straight travel at the views, mm² per mm².
    pub fn straightness_covariance(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal_element(self.straightness.slope_variance())
    }

    /// The direction as a derived quantity of a fit in which the stage views, its last blocks, have free poses.
    pub fn derived(&self, n_globals: usize, poses: &[BoardPose], board_centre_mm: &Vector3<f64>) -> Derived {
        let first_view = poses.len() - self.shares_per_mm.len();
        let views = poses[first_view..].iter().zip(&self.shares_per_mm).enumerate();
        let by_block = views.map(|(idx, (pose, share))| {
            let by_pose = centre_by_pose(pose, board_centre_mm) * *share;
            (first_view + idx, DMatrix::from_column_slice(3, 6, by_pose.as_slice()))
        });
        Derived {
            by_globals: DMatrix::zeros(3, n_globals),
            by_block: by_block.collect(),
            own: DMatrix::from_column_slice(3, 3, self.straightness_covariance().as_slice()),
        }
    }
}

/// d(middle of the board) / d(translation, rotation) of its pose.
fn centre_by_pose(pose: &BoardPose, board_centre_mm: &Vector3<f64>) -> Matrix3x6<f64> {
    let mut by_pose = Matrix3x6::zeros();
    by_pose.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
    by_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&-(pose.rotation * board_centre_mm).cross_matrix());
    by_pose
}

/// σ per axis of a stage's deviations from straight travel, from those of n boards from their line, with noise of the
/// given covariances.
///
/// The σ for which Σ dᵀ(σ²·1 + C)⁻¹d is two less than its 3(n − 2) degrees of freedom: with so few views the usual
/// estimate is too small too often, and a quantity divided by it follows not the normal distribution but Student's t,
/// which has this variance (GUM, Supplement 1). If noise explains the deviations, the σ that the noise could hide.
fn straightness_sigma_mm(deviations: &[Vector3<f64>], noises: &[Matrix3<f64>]) -> f64 {
    let views_left = deviations.len() as f64 - 2.0;
    let expected = 3.0 * views_left - 2.0;
    let inverse = |variance: f64, noise: &Matrix3<f64>| {
        (noise + Matrix3::from_diagonal_element(variance)).try_inverse().unwrap_or_default()
    };
    let misfit = |variance: f64| -> f64 {
        deviations
            .iter()
            .zip(noises)
            .map(|(d, noise)| (d.transpose() * inverse(variance, noise) * d)[(0, 0)])
            .sum()
    };
    // The Fisher information of σ² where there is only noise.
    let information: f64 = noises.iter().map(|noise| inverse(0.0, noise).norm_squared()).sum::<f64>() / 2.0;
    let hidden = (views_left / deviations.len() as f64 * information).powf(-0.5);
    excess_sigma(hidden, deviations.iter().map(Vector3::norm_squared).sum::<f64>() / expected, expected, misfit)
}

/// The report of a stage with direction and covariance from the joint fit.
pub fn stage_report(line: &StageLine, direction: &Vector3<f64>, covariance: &Matrix3<f64>) -> StageReport {
    let length = direction.norm();
    let unit = direction / length;
    let across: f64 = line.straightness_um.iter().map(|d| d[2] * d[2] + d[3] * d[3]).sum();
    StageReport {
        direction: (*direction).into(),
        sigma: std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt()),
        scale_error: length - 1.0,
        scale_sigma: (unit.transpose() * covariance * unit)[(0, 0)].max(0.0).sqrt(),
        straightness_um: line.straightness_um.clone(),
        straightness_rms_um: (across / line.straightness_um.len().max(1) as f64).sqrt(),
        straightness_sigma_um: 1e3 * line.straightness.sigma_mm(),
        tilt_urad: line.tilt_urad.clone(),
        tilt_sigma_urad: sorted_sizes(line.tilt.sigmas_rad()),
    }
}

/// Lengths of rotation vectors, µrad, largest first.
fn sorted_sizes(sigmas_rad: &[Vector3<f64>; 3]) -> [f64; 3] {
    let mut sizes = sigmas_rad.map(|sigma| 1e6 * sigma.norm());
    sizes.sort_by(|a, b| b.total_cmp(a));
    sizes
}
