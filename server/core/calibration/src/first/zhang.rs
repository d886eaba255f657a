//! Zhang's closed form: intrinsics from homographies, then a pose from each (Zhang 2000, TPAMI 22(11)).

use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use optics::{BoardFrame, CameraFrame, Rigid};

/// Focal lengths and principal point, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PinholeGuess {
    /// Focal length (one for both axes).
    pub focal_px: f64,
    /// Principal point, column.
    pub cx_px: f64,
    /// Principal point, row.
    pub cy_px: f64,
}

/// The focal length from homographies, with the principal point at the image's centre.
///
/// With a known centre, each view gives two linear equations for 1/f²; their least-squares solution is far better
/// conditioned than the full closed form when there are few boards or little tilt. `None` if no positive focal length
/// fits.
pub fn pinhole_from_homographies(homographies: &[Matrix3<f64>], cx_px: f64, cy_px: f64) -> Option<PinholeGuess> {
    let to_centre = Matrix3::new(1.0, 0.0, -cx_px, 0.0, 1.0, -cy_px, 0.0, 0.0, 1.0);
    let mut left = DMatrix::zeros(2 * homographies.len(), 1);
    let mut right = DMatrix::zeros(2 * homographies.len(), 1);
    for (idx, homography) in homographies.iter().enumerate() {
        let h = to_centre * homography;
        let (h1, h2) = (h.column(0), h.column(1));
        let weight = 1.0 / (h1.norm() * h2.norm());
        // r1·r2 = 0 and |r1|² = |r2|² with r = K⁻¹h.
        left[(2 * idx, 0)] = weight * (h1[0] * h2[0] + h1[1] * h2[1]);
        right[(2 * idx, 0)] = -weight * h1[2] * h2[2];
        left[(2 * idx + 1, 0)] = weight * (h1[0] * h1[0] + h1[1] * h1[1] - h2[0] * h2[0] - h2[1] * h2[1]);
        right[(2 * idx + 1, 0)] = -weight * (h1[2] * h1[2] - h2[2] * h2[2]);
    }
    let inverse_square = left.tr_mul(&right)[(0, 0)] / left.tr_mul(&left)[(0, 0)];
    (inverse_square.is_finite() && inverse_square > 0.0).then(|| PinholeGuess {
        focal_px: 1.0 / inverse_square.sqrt(),
        cx_px,
        cy_px,
    })
}

/// The board's pose from its homography and a pinhole estimate; the board is in front of the camera.
pub fn pose_from_homography(
    homography: &Matrix3<f64>,
    guess: &PinholeGuess,
) -> Option<Rigid<CameraFrame, BoardFrame>> {
    let inverse = Matrix3::new(
        1.0 / guess.focal_px,
        0.0,
        -guess.cx_px / guess.focal_px,
        0.0,
        1.0 / guess.focal_px,
        -guess.cy_px / guess.focal_px,
        0.0,
        0.0,
        1.0,
    );
    let h = inverse * homography;
    let scale = 2.0 / (h.column(0).norm() + h.column(1).norm());
    let sign = if h[(2, 2)] < 0.0 { -scale } else { scale };
    let r1: Vector3<f64> = h.column(0) * sign;
    let r2: Vector3<f64> = h.column(1) * sign;
    let matrix = Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]);
    let svd = matrix.svd(true, true);
    let nearest = svd.u? * svd.v_t?;
    if nearest.determinant() <= 0.0 {
        return None;
    }
    Some(Rigid::new(Rotation3::from_matrix_unchecked(nearest), h.column(2) * sign))
}
