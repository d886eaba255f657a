//! Everything needed to convert a labelled pixel to a point with its uncertainty.

use nalgebra::{DMatrix, DVector, Vector2, Vector3};

use crate::camera::{CAMERA_PARAMETER_NAMES, CAMERA_PARAMETERS, Camera};
use crate::frames::{CameraFrame, PointMm};
use crate::modes::independent_steps;
use crate::stage::{Stage, StageUncertainty};
use crate::surface::{LightSurfaces, SurfaceHit};

/// Parameters of a linear stage's travel.
pub const STAGE_PARAMETERS: usize = 3;

/// Range of z (camera frame) covered by the target during calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthRangeMm {
    /// Nearest depth.
    pub near_mm: f64,
    /// Farthest depth.
    pub far_mm: f64,
}

impl DepthRangeMm {
    /// Whether `depth_mm` lies inside.
    #[inline]
    pub fn contains(&self, depth_mm: f64) -> bool {
        (self.near_mm..=self.far_mm).contains(&depth_mm)
    }

    /// The depth half-way between the two.
    pub fn middle_mm(&self) -> f64 {
        0.5 * (self.near_mm + self.far_mm)
    }
}

/// A calibrated station: camera, light sheets, stage, and the joint covariance of all their parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Id of the calibration document.
    pub id: String,
    /// The camera.
    pub camera: Camera,
    /// Diffraction orders, from the top (left) of the image downwards (rightwards).
    pub orders: Vec<i8>,
    /// The light sheets.
    pub light: LightSurfaces,
    /// The stage, if it was calibrated.
    pub stage: Option<Stage>,
    /// Depth range of the calibration.
    pub depth_range_mm: DepthRangeMm,
    /// Covariance of [`Calibration::parameter_names`], square; rows and columns of fixed parameters are zero.
    pub covariance: DMatrix<f64>,
}

/// A triangulated pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangulatedPoint {
    /// Where the light hit.
    pub hit_in_camera: PointMm<CameraFrame>,
    /// The camera ray (x_h, y_h, 1).
    pub ray: Vector3<f64>,
    /// The sheet at the hit.
    pub hit: SurfaceHit,
    /// Distance along the ray per pixel, d|X| / d(u, v), mm/px.
    pub range_by_pixel: Vector2<f64>,
}

impl TriangulatedPoint {
    /// Standard deviation of the surface's distance along this ray, mm, where a line with the unit `normal` in the image has
    /// noise of `sigma_px` along it.
    pub fn noise_sigma_mm(&self, normal: &[f64; 2], sigma_px: f64) -> f64 {
        range_sigma_mm(&self.range_by_pixel, normal, sigma_px)
    }
}

/// Smallest cosine between a line's normal and the direction in which the distance changes: lines are extracted up to 75°
/// from their direction, 0.26.
const MIN_ACROSS: f64 = 0.1;

/// Standard deviation of the surface's distance along a pixel's ray, mm, where a line with the unit `normal` has noise
/// of `sigma_px` along it.
///
/// A line that runs obliquely meets the pixel's column (row) σ / |cos| further on: with g the change of the distance per
/// pixel and n the normal, σ_r = |g|² / |g·n| · σ. A shift along the line itself changes nothing.
///
/// [`MIN_ACROSS`] bounds it for a line that no extraction would follow.
#[inline]
pub(crate) fn range_sigma_mm(range_by_pixel: &Vector2<f64>, normal: &[f64; 2], sigma_px: f64) -> f64 {
    let steepest = range_by_pixel.norm();
    let across = range_by_pixel.x * normal[0] + range_by_pixel.y * normal[1];
    steepest * steepest / across.abs().max(MIN_ACROSS * steepest) * sigma_px
}

impl Calibration {
    /// Names of all parameters: camera, light, stage (if any).
    pub fn parameter_names(&self) -> Vec<String> {
        let mut names: Vec<String> = CAMERA_PARAMETER_NAMES.map(String::from).to_vec();
        names.extend(self.light.parameter_names());
        let of_stage = self.stage.iter().flat_map(|stage| stage.parameter_names());
        names.extend(of_stage.map(|name| (*name).to_owned()));
        names
    }

    /// Triangulates a raw pixel on the line of `order`; `None` if its ray misses the sheet.
    ///
    /// `phi_guess_rad`: fan angle of a neighbour on the same line, to save Newton steps.
    pub fn triangulate(
        &self,
        order: i8,
        pixel: &Vector2<f64>,
        phi_guess_rad: Option<f64>,
    ) -> Option<TriangulatedPoint> {
        let ray = self.camera.ray_from_pixel(pixel)?;
        let hit = self.light.hit(order, &ray, phi_guess_rad)?;
        let ray_by_pixel = self.camera.pixel_by_ideal(&ray.xy()).try_inverse()?;
        let normal = hit.normal;
        let steepness = normal.dot(&ray);
        let length = ray.norm();
        // The hit stays on the sheet: N·(dλ·D + λ·dD) = 0. |X| = λ|D| changes by dλ|D|: the component along the ray.
        let range_by_ray = Vector2::new(normal.x, normal.y) * (-hit.depth_mm / steepness * length);
        Some(TriangulatedPoint {
            hit_in_camera: PointMm::new(ray * hit.depth_mm),
            ray,
            hit,
            range_by_pixel: ray_by_pixel.transpose() * range_by_ray,
        })
    }

    /// Displacement of the hit along its ray per parameter (mm per unit), for the camera and light parameters.
    pub fn range_by_parameters(&self, order: i8, point: &TriangulatedPoint) -> Option<DVector<f64>> {
        let ideal = point.ray.xy();
        let distorted = self.camera.distort(&ideal);
        let ideal_by_camera =
            -(self.camera.pixel_by_ideal(&ideal).try_inverse()? * self.camera.pixel_by_camera(&ideal, &distorted));
        let light = self.light.normal_motion_by_parameters(order, &point.ray, &point.hit)?;
        let normal = point.hit.normal;
        let per_normal = point.ray.norm() / normal.dot(&point.ray);
        let mut range = DVector::zeros(CAMERA_PARAMETERS + light.len());
        for column in 0..CAMERA_PARAMETERS {
            let ray_step = ideal_by_camera.column(column);
            let slide = normal.x * ray_step[0] + normal.y * ray_step[1];
            range[column] = -point.hit.depth_mm * slide * per_normal;
        }
        for (slot, motion) in range.iter_mut().skip(CAMERA_PARAMETERS).zip(light) {
            *slot = motion * per_normal;
        }
        Some(range)
    }

    /// Standard deviation along the ray, mm, at a point, from the calibration's covariance.
    pub fn systematic_sigma_mm(&self, order: i8, point: &TriangulatedPoint) -> Option<f64> {
        let range = self.range_by_parameters(order, point)?;
        let n = range.len();
        let covariance = self.covariance.view((0, 0), (n, n));
        Some((range.transpose() * covariance * &range)[(0, 0)].max(0.0).sqrt())
    }

    /// The stage's own uncertainty, for the σ of single points.
    pub fn stage_uncertainty(&self) -> StageUncertainty {
        let n = self.stage.map_or(0, |stage| stage.parameters()).min(self.covariance.nrows());
        let first = self.covariance.nrows() - n;
        StageUncertainty::new(self.stage.as_ref(), &self.covariance.view((first, first), (n, n)).into_owned())
    }

    /// The calibration moved by a parameter step in the order of [`Calibration::parameter_names`], optionally followed
    /// by deviations at the nodes of the stage's [`crate::stage::Straightness`] and [`crate::stage::Tilt`], or of its
    /// [`crate::stage::AngleError`].
    pub fn stepped(&self, step: &[f64]) -> Self {
        let mut parameters = self.camera.parameters();
        for (value, change) in parameters.iter_mut().zip(step) {
            *value += change;
        }
        let light_end = CAMERA_PARAMETERS + self.light.parameters();
        let stage = self.stage.map(|stage| stage.stepped(&step[light_end..]));
        Self {
            camera: self.camera.with_parameters(&parameters),
            light: self.light.stepped(&step[CAMERA_PARAMETERS..light_end]),
            stage,
            ..self.clone()
        }
    }

    /// Independent one-σ steps for [`Calibration::stepped`]: those whose outer products sum to the covariance, largest
    /// first, then one per node and axis of the stage's straightness and tilt, or per node of a turntable's angle, if
    /// known.
    ///
    /// Re-evaluating any result at `stepped(mode)` and summing the squared changes propagates the covariance and the
    /// deviations of the stage. A deviation at a node has also rotated the straight line fitted to all nodes, so a node's
    /// step of the straightness subtracts that rotation; the covariance contains the same rotation, and is used without it.
    pub fn sigma_modes(&self) -> Vec<Vec<f64>> {
        let n = self.covariance.nrows();
        let of_stage = self.stage.map_or(Vec::new(), |stage| stage.node_modes());
        let mut covariance = self.covariance.clone();
        if let Some(straightness) = self.stage.and_then(|stage| stage.linear()?.straightness) {
            for i in n - STAGE_PARAMETERS..n {
                covariance[(i, i)] = (covariance[(i, i)] - straightness.slope_variance()).max(0.0);
            }
        }
        let n_node_values = of_stage.first().map_or(0, |mode| mode.at_nodes.len());
        let of_covariance = independent_steps(&covariance).into_iter().map(|mut mode| {
            mode.resize(n + n_node_values, 0.0);
            mode
        });
        let of_nodes = of_stage.iter().map(|mode| {
            let mut step = vec![0.0; n - mode.of_parameters.len()];
            step.extend(mode.of_parameters.iter().chain(&mode.at_nodes));
            step
        });
        of_covariance.chain(of_nodes).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_of_an_oblique_line_moves_its_crossing_with_the_column_further() {
        let by_pixel = Vector2::new(0.0, 0.25);
        let sigma_mm = |slope: f64| {
            let across = 1.0 / (1.0 + slope * slope).sqrt();
            range_sigma_mm(&by_pixel, &[-slope * across, across], 0.1)
        };
        // A line of slope m moved by σ along its normal crosses the column σ·√(1 + m²) further on.
        for slope in [0.0, 0.5, -1.0, 3.0] {
            assert!((sigma_mm(slope) - 0.025 * (1.0 + slope * slope).sqrt()).abs() < 1e-12, "{slope}");
        }
        assert!(sigma_mm(1e9).is_finite());
    }
}
