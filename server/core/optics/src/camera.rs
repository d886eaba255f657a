//! Pinhole camera with Brown–Conrady distortion, in OpenCV's convention (`docs/maths/camera.md`).

use nalgebra::{Matrix2, Matrix2x3, SMatrix, Vector2, Vector3};

/// Parameters of the camera: fx, fy, cx, cy, k1, k2, p1, p2, k3.
pub const CAMERA_PARAMETERS: usize = 9;

/// Names of the camera's parameters in the order of every vector and covariance matrix.
pub const CAMERA_PARAMETER_NAMES: [&str; CAMERA_PARAMETERS] =
    ["fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"];

/// Newton steps to invert the distortion; quadratic convergence needs 3–5 even at 20 % distortion.
const UNDISTORT_MAX_STEPS: usize = 20;

/// Stop when a Newton step is below this in normalised image coordinates (1e-9 px at f = 10⁴ px).
const UNDISTORT_TOLERANCE: f64 = 1e-13;

/// A calibrated camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Image width.
    pub width_px: usize,
    /// Image height.
    pub height_px: usize,
    /// Focal length along u.
    pub fx_px: f64,
    /// Focal length along v.
    pub fy_px: f64,
    /// Principal point, column.
    pub cx_px: f64,
    /// Principal point, row.
    pub cy_px: f64,
    /// Radial distortion, r² term.
    pub k1: f64,
    /// Radial distortion, r⁴ term.
    pub k2: f64,
    /// Tangential distortion, first coefficient.
    pub p1: f64,
    /// Tangential distortion, second coefficient.
    pub p2: f64,
    /// Radial distortion, r⁶ term.
    pub k3: f64,
}

/// A projected pixel with its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct ProjectedPixel {
    /// The pixel (u, v) of the point.
    pub pixel: Vector2<f64>,
    /// d(u, v) / d(x, y, z) of the point in the camera frame, px/mm.
    pub by_point: Matrix2x3<f64>,
    /// d(u, v) / d(camera parameters), in the order of [`CAMERA_PARAMETER_NAMES`].
    pub by_camera: SMatrix<f64, 2, CAMERA_PARAMETERS>,
}

impl Camera {
    /// A camera from OpenCV's `cameraMatrix` (row-major 3 × 3) and `distCoeffs` (k1 k2 p1 p2 \[k3\]).
    pub fn from_opencv(width_px: usize, height_px: usize, matrix: [[f64; 3]; 3], distortion: &[f64]) -> Self {
        let coefficient = |idx: usize| distortion.get(idx).copied().unwrap_or(0.0);
        Self {
            width_px,
            height_px,
            fx_px: matrix[0][0],
            fy_px: matrix[1][1],
            cx_px: matrix[0][2],
            cy_px: matrix[1][2],
            k1: coefficient(0),
            k2: coefficient(1),
            p1: coefficient(2),
            p2: coefficient(3),
            k3: coefficient(4),
        }
    }

    /// OpenCV's `cameraMatrix`, row-major.
    pub fn opencv_matrix(&self) -> [[f64; 3]; 3] {
        [[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]]
    }

    /// OpenCV's `distCoeffs`: k1 k2 p1 p2 k3.
    pub fn opencv_distortion(&self) -> [f64; 5] {
        [self.k1, self.k2, self.p1, self.p2, self.k3]
    }

    /// The parameters in the order of [`CAMERA_PARAMETER_NAMES`].
    pub fn parameters(&self) -> [f64; CAMERA_PARAMETERS] {
        [self.fx_px, self.fy_px, self.cx_px, self.cy_px, self.k1, self.k2, self.p1, self.p2, self.k3]
    }

    /// The same sensor with other parameters.
    pub fn with_parameters(&self, p: &[f64; CAMERA_PARAMETERS]) -> Self {
        Self {
            width_px: self.width_px,
            height_px: self.height_px,
            fx_px: p[0],
            fy_px: p[1],
            cx_px: p[2],
            cy_px: p[3],
            k1: p[4],
            k2: p[5],
            p1: p[6],
            p2: p[7],
            k3: p[8],
        }
    }

    /// The pixel of a camera-frame point; `None` behind the camera.
    pub fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        if point.z <= 0.0 {
            return None;
        }
        let distorted = self.distort(&Vector2::new(point.x / point.z, point.y / point.z));
        Some(self.pixel_from_normalised(&distorted))
    }

    /// [`Camera::project`] with derivatives with respect to point and camera parameters.
    pub fn project_with_jacobian(&self, point: &Vector3<f64>) -> Option<ProjectedPixel> {
        if point.z <= 0.0 {
            return None;
        }
        let ideal = Vector2::new(point.x / point.z, point.y / point.z);
        let distorted = self.distort(&ideal);
        let inverse_z = 1.0 / point.z;
        let ideal_by_point =
            Matrix2x3::new(inverse_z, 0.0, -ideal.x * inverse_z, 0.0, inverse_z, -ideal.y * inverse_z);
        Some(ProjectedPixel {
            pixel: self.pixel_from_normalised(&distorted),
            by_point: self.pixel_by_ideal(&ideal) * ideal_by_point,
            by_camera: self.pixel_by_camera(&ideal, &distorted),
        })
    }

    /// The ray (x_h, y_h, 1) through a raw pixel: the paper's homogeneous camera coordinates, eq. (1).
    ///
    /// `None` where the distortion polynomial cannot be inverted (far outside its range).
    pub fn ray_from_pixel(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let distorted = Vector2::new((pixel.x - self.cx_px) / self.fx_px, (pixel.y - self.cy_px) / self.fy_px);
        let mut ideal = distorted;
        for _ in 0..UNDISTORT_MAX_STEPS {
            let jacobian = self.distortion_jacobian(&ideal);
            if jacobian.determinant() <= 0.0 {
                return None;
            }
            let step = jacobian.try_inverse()? * (self.distort(&ideal) - distorted);
            ideal -= step;
            if step.norm() < UNDISTORT_TOLERANCE {
                return Some(Vector3::new(ideal.x, ideal.y, 1.0));
            }
        }
        None
    }

    /// d(u, v) / d(x_h, y_h) at ideal (undistorted) normalised coordinates, px.
    pub fn pixel_by_ideal(&self, ideal: &Vector2<f64>) -> Matrix2<f64> {
        Matrix2::new(self.fx_px, 0.0, 0.0, self.fy_px) * self.distortion_jacobian(ideal)
    }

    /// d(u, v) / d(camera parameters) at ideal normalised coordinates and their distorted image.
    pub fn pixel_by_camera(
        &self,
        ideal: &Vector2<f64>,
        distorted: &Vector2<f64>,
    ) -> SMatrix<f64, 2, CAMERA_PARAMETERS> {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let (r4, r6) = (r2 * r2, r2 * r2 * r2);
        let (fx, fy) = (self.fx_px, self.fy_px);
        SMatrix::<f64, 2, CAMERA_PARAMETERS>::from_row_slice(&[
            distorted.x,
            0.0,
            1.0,
            0.0,
            fx * x * r2,
            fx * x * r4,
            fx * 2.0 * x * y,
            fx * (r2 + 2.0 * x * x),
            fx * x * r6,
            0.0,
            distorted.y,
            0.0,
            1.0,
            fy * y * r2,
            fy * y * r4,
            fy * (r2 + 2.0 * y * y),
            fy * 2.0 * x * y,
            fy * y * r6,
        ])
    }

    /// Brown–Conrady: ideal to distorted normalised coordinates.
    pub fn distort(&self, ideal: &Vector2<f64>) -> Vector2<f64> {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        Vector2::new(
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )
    }

    fn distortion_jacobian(&self, ideal: &Vector2<f64>) -> Matrix2<f64> {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        let slope = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + 3.0 * r2 * self.k3));
        let cross = x * y * slope + 2.0 * self.p1 * x + 2.0 * self.p2 * y;
        Matrix2::new(
            radial + x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            cross,
            cross,
            radial + y * y * slope + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )
    }

    fn pixel_from_normalised(&self, distorted: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.fx_px * distorted.x + self.cx_px, self.fy_px * distorted.y + self.cy_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let matrix = [[2518.4, 0.0, 635.2], [0.0, 2517.0, 501.6], [0.0, 0.0, 1.0]];
        Camera::from_opencv(1280, 1024, matrix, &[-0.097, 0.115, -1.5e-5, 1.2e-4, 0.02])
    }

    #[test]
    fn projection_agrees_with_opencv() {
        // cv2.projectPoints of (40, −35, 390) with the same matrix and coefficients, OpenCV 5.0.
        let pixel = camera().project(&Vector3::new(40.0, -35.0, 390.0)).unwrap();
        assert!((pixel - Vector2::new(893.055_031_052_301, 276.106_481_071_578)).norm() < 1e-6, "{pixel}");
    }

    #[test]
    fn a_pixel_and_its_ray_agree_over_the_whole_sensor() {
        let camera = camera();
        for (u, v) in [(0.0, 0.0), (1279.0, 0.0), (640.0, 512.0), (3.0, 1023.0), (-8.0, 311.0)] {
            let ray = camera.ray_from_pixel(&Vector2::new(u, v)).unwrap();
            let pixel = camera.project(&(ray * 400.0)).unwrap();
            assert!((pixel - Vector2::new(u, v)).norm() < 1e-9);
        }
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let camera = camera();
        let point = Vector3::new(55.0, -42.0, 380.0);
        let exact = camera.project_with_jacobian(&point).unwrap();
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = 1e-4;
            let difference =
                (camera.project(&(point + step)).unwrap() - camera.project(&(point - step)).unwrap()) / 2e-4;
            assert!((difference - exact.by_point.column(axis)).norm() < 1e-7);
        }
        for parameter in 0..CAMERA_PARAMETERS {
            let moved = |sign: f64| {
                let mut p = camera.parameters();
                p[parameter] += sign * 1e-5;
                camera.with_parameters(&p).project(&point).unwrap()
            };
            let difference = (moved(1.0) - moved(-1.0)) / 2e-5;
            assert!((difference - exact.by_camera.column(parameter)).norm() < 1e-6, "{parameter}");
        }
    }
}
