//! Plane-to-image homographies by the normalised direct linear transform.

use nalgebra::{Matrix3, SMatrix, SVector, Vector2};

/// The homography from board points (x, y, mm) to pixels; `None` for a degenerate set.
pub fn homography_from_points(board: &[Vector2<f64>], pixels: &[Vector2<f64>]) -> Option<Matrix3<f64>> {
    let (board_scaling, pixel_scaling) = (normalising(board)?, normalising(pixels)?);
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (from, to) in board.iter().zip(pixels) {
        let from = board_scaling * from.push(1.0);
        let to = pixel_scaling * to.push(1.0);
        for axis in 0..2 {
            let mut row = SVector::<f64, 9>::zeros();
            row.fixed_rows_mut::<3>(3 * axis).copy_from(&from);
            row.fixed_rows_mut::<3>(6).copy_from(&(-to[axis] * from));
            normal.ger(1.0, &row, &row, 1.0);
        }
    }
    let eigen = normal.symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let h = eigen.eigenvectors.column(smallest);
    let scaled = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    let homography = pixel_scaling.try_inverse()? * scaled * board_scaling;
    let scale = homography[(2, 2)];
    (scale.abs() > f64::EPSILON).then(|| homography / scale)
}

/// Similarity that moves the centroid to 0 and the mean distance to √2.
fn normalising(points: &[Vector2<f64>]) -> Option<Matrix3<f64>> {
    let n = points.len() as f64;
    let centre = points.iter().sum::<Vector2<f64>>() / n;
    let spread = points.iter().map(|p| (p - centre).norm()).sum::<f64>() / n;
    if spread <= 0.0 {
        return None;
    }
    let scale = std::f64::consts::SQRT_2 / spread;
    Some(Matrix3::new(scale, 0.0, -scale * centre.x, 0.0, scale, -scale * centre.y, 0.0, 0.0, 1.0))
}
