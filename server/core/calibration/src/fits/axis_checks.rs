//! Whether boards on a turntable determine its axis: enough angles, and rotations as stated.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};
use optics::RotaryAxis;

use crate::error::CalibrationError;
use crate::fits::axis_fit::RotaryView;
use crate::params::{MAX_ROTATION_MISMATCH_RAD, MIN_STAGE_ANGLE_DEG, MIN_STAGE_POSITIONS};

/// Checks that there are enough different angles, modulo full turns.
///
/// # Errors
/// [`CalibrationError::TooFewStageAngles`].
pub fn check_angles(angles_deg: impl IntoIterator<Item = f64>) -> Result<(), CalibrationError> {
    let mut apart: Vec<f64> = angles_deg.into_iter().map(|angle_deg| angle_deg.rem_euclid(360.0)).collect();
    apart.sort_by(f64::total_cmp);
    apart.dedup_by(|next, kept| *next - *kept < MIN_STAGE_ANGLE_DEG);
    if apart.len() > 1 && apart[0] + 360.0 - apart[apart.len() - 1] < MIN_STAGE_ANGLE_DEG {
        apart.pop();
    }
    if apart.len() >= MIN_STAGE_POSITIONS {
        return Ok(());
    }
    Err(CalibrationError::TooFewStageAngles { needed: MIN_STAGE_POSITIONS, got: apart.len() })
}

/// Checks that between any two views the board has rotated by the stated angle, about any axis.
pub fn check_rotations(views: &[RotaryView]) -> Result<(), CalibrationError> {
    let misses: Vec<usize> = (0..views.len())
        .map(|idx| {
            views.iter().filter(|other| rotation_error_rad(&views[idx], other) > MAX_ROTATION_MISMATCH_RAD).count()
        })
        .collect();
    let Some(worst) = (0..views.len()).max_by_key(|&idx| misses[idx]).filter(|&idx| misses[idx] > 0) else {
        return Ok(());
    };
    // Relative to the view that agrees with most others.
    let best = (0..views.len()).min_by_key(|&idx| misses[idx]).unwrap_or(0);
    let (view, reference) = (&views[worst], &views[best]);
    let stated_deg = view.angle_deg - reference.angle_deg;
    let observed_deg = observed_rotation_rad(view, reference).to_degrees();
    Err(CalibrationError::RotationMismatch {
        view: view.name.clone(),
        reference: reference.name.clone(),
        stated_deg,
        observed_deg,
    })
}

fn observed_rotation_rad(one: &RotaryView, other: &RotaryView) -> f64 {
    (one.pose.rotation * other.pose.rotation.inverse()).angle()
}

fn rotation_error_rad(one: &RotaryView, other: &RotaryView) -> f64 {
    let stated = (one.angle_deg - other.angle_deg).to_radians().rem_euclid(TAU);
    (stated.min(TAU - stated).min(PI) - observed_rotation_rad(one, other)).abs()
}

/// The axis in closed form: its direction from the antisymmetric parts of the rotations between all views, its point
/// from (1 − R)c = t_j − R·t_i.
pub fn first_axis(views: &[RotaryView]) -> Option<RotaryAxis> {
    let mut direction = Vector3::zeros();
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (idx, later) in views.iter().enumerate() {
        for earlier in &views[..idx] {
            let turn = (later.pose.rotation * earlier.pose.rotation.inverse()).into_inner();
            let angle_rad = (later.angle_deg - earlier.angle_deg).to_radians();
            let skew = (turn - turn.transpose()) / 2.0;
            direction += Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]) * angle_rad.sin();
            let left = Matrix3::identity() - turn;
            normal += left.transpose() * left;
            right += left.transpose() * (later.pose.translation_mm - turn * earlier.pose.translation_mm);
        }
    }
    let direction = direction.try_normalize(f64::MIN_POSITIVE)?;
    let middle = views.iter().map(|view| view.pose.translation_mm).sum::<Vector3<f64>>() / views.len() as f64;
    // Nothing is determined along the axis: the middle of the boards is used.
    let hold = direction * direction.transpose() * normal.trace();
    let point_mm = (normal + hold).try_inverse()? * (right + hold * middle);
    Some(RotaryAxis::new(point_mm, direction))
}
