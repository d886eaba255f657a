//! Pitch, yaw and roll of a linear stage from the boards on it (`docs/maths/calibration.md`, eq. 15).

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::fits::excess::excess_sigma;
use crate::solving::bundle_state::BoardPose;

/// Steps towards the mean of rotations: they differ by milliradians, and each step squares the error.
const MEAN_STEPS: usize = 3;

/// Rotations of the carriage at the stage views.
pub(super) struct TiltFit {
    /// Per view: rotation from the mean of all views, as a rotation vector, camera frame, rad.
    pub(super) rotations_rad: Vec<Vector3<f64>>,
    /// Three independent rotation vectors of one σ, rad.
    pub(super) sigmas_rad: [Vector3<f64>; 3],
}

/// Determines the rotations of n boards, and their σ along the three principal axes of their scatter; `noises`: covariance
/// of each rotation, rad².
///
/// Only differences of rotations displace points against each other, so the mean is a degree of freedom less; a trend along
/// the travel is not, since the part's frame cannot absorb it. Guides tilt mostly about one axis, so every axis has a σ of
/// its own: that for which Σ d²/(σ² + v) is two less than its n − 1 degrees of freedom, as for the straightness.
pub(super) fn tilt_fit(poses: &[BoardPose], noises: &[Matrix3<f64>]) -> TiltFit {
    let rotations_rad = from_mean(poses);
    let scatter: Matrix3<f64> = rotations_rad.iter().map(|d| d * d.transpose()).sum();
    let axes = scatter.symmetric_eigen().eigenvectors;
    let sigma_rad = |axis: Vector3<f64>| {
        let along: Vec<f64> = rotations_rad.iter().map(|d| d.dot(&axis)).collect();
        let noise: Vec<f64> = noises.iter().map(|noise| (noise * axis).dot(&axis)).collect();
        axis * sigma(&along, &noise)
    };
    let sigmas_rad = [0, 1, 2].map(|axis| sigma_rad(axes.column(axis).into_owned()));
    TiltFit { rotations_rad, sigmas_rad }
}

/// The rotation of every board from the mean of all, rad.
fn from_mean(poses: &[BoardPose]) -> Vec<Vector3<f64>> {
    let mut mean = poses.first().map_or(Rotation3::identity(), |pose| pose.rotation);
    // The arc cosine of a matrix's trace is NaN for some rotations near zero; quaternions have no such place.
    let away = |pose: &BoardPose, mean: &Rotation3<f64>| {
        UnitQuaternion::from_rotation_matrix(&(pose.rotation * mean.inverse())).scaled_axis()
    };
    let rotations = |mean: &Rotation3<f64>| poses.iter().map(|pose| away(pose, mean)).collect();
    for _ in 0..MEAN_STEPS {
        let away: Vec<Vector3<f64>> = rotations(&mean);
        mean = Rotation3::new(away.iter().sum::<Vector3<f64>>() / away.len().max(1) as f64) * mean;
    }
    rotations(&mean)
}

/// σ in excess of the noise of the given variances.
fn sigma(deviations: &[f64], noises: &[f64]) -> f64 {
    let n = deviations.len() as f64;
    // With three views Student's t has no variance; one degree of freedom is the least that keeps σ finite.
    let expected = (n - 3.0).max(1.0);
    let misfit = |variance: f64| deviations.iter().zip(noises).map(|(d, noise)| d * d / (noise + variance)).sum();
    // The Fisher information of σ² where there is only noise.
    let information = noises.iter().map(|noise| noise.powi(-2)).sum::<f64>() / 2.0;
    let hidden = ((n - 1.0) / n * information).powf(-0.5);
    excess_sigma(hidden, deviations.iter().map(|d| d * d).sum::<f64>() / expected, expected, misfit)
}

#[cfg(test)]
mod tests {
    use optics::Rigid;

    use super::*;

    #[test]
    fn a_stage_that_yaws_evenly_has_its_sigma_about_one_axis() {
        let axis = Vector3::new(0.6, 0.0, 0.8);
        let base = Rotation3::new(Vector3::new(0.3, -0.2, 0.9));
        let poses: Vec<BoardPose> = (-2..=2)
            .map(|idx| Rigid::new(Rotation3::new(axis * (1e-3 * f64::from(idx))) * base, Vector3::zeros()))
            .collect();
        let found = tilt_fit(&poses, &[Matrix3::from_diagonal_element(1e-12); 5]);
        for (idx, rotation) in (-2..=2).zip(&found.rotations_rad) {
            assert!((rotation - axis * (1e-3 * f64::from(idx))).norm() < 1e-12, "{rotation}");
        }
        // Σd² = 10 mrad² over two degrees of freedom.
        let mut sizes = found.sigmas_rad.map(|sigma| sigma.norm());
        sizes.sort_by(f64::total_cmp);
        assert!((sizes[2] / 5e-6_f64.sqrt() - 1.0).abs() < 1e-3, "{sizes:?}");
        // The others: what the noise could hide, √(2/(5·0.8)) of its variance.
        for size in &sizes[..2] {
            assert!((size.powi(2) / (1e-12 * 0.5_f64.sqrt()) - 1.0).abs() < 1e-6, "{sizes:?}");
        }
    }
}
