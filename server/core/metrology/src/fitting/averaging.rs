//! Bias of the average along a line on a sphere or a cylinder, and of the lens's blur, from the course that the line takes
//! on it.
//!
//! Near a point the image of the light sheet is affine: the surface is met in the column k and the row v where
//! |x + k·a + v·b − c|² = R² (on a cylinder perpendicular to its axis), x the point, a and b its displacements on the sheet
//! per column and row. The rows that solve this are displaced by the blur and averaged like those of the image
//! (`docs/maths/metrology.md`, Curved lines).

use nalgebra::{Matrix2, Vector2, Vector3};
use optics::{Calibration, TriangulatedPoint};
use scanning::CloudPoint;
use vision::AveragingBias;

use crate::fitting::sample::Samples;
use crate::interface::shape::Shape;
use crate::params::{BLUR_SQUARED_PX2, COURSE_MAX_GAP, COURSE_MAX_SLOPE, COURSE_MIN_BRIGHTNESS};

/// The course of a line at a point.
#[derive(Debug, Clone)]
pub(crate) struct Course {
    /// Displacement on the light sheet per column along the line, mm; columns and rows are exchanged if the line runs along
    /// the image's columns.
    column_mm: Vector3<f64>,
    /// The same per row.
    row_mm: Vector3<f64>,
    /// Columns in which the line continues before and after the point.
    n_before: usize,
    n_after: usize,
    /// Noise of the point, rows.
    sigma_px: f64,
    /// Unit vector towards the light; if unknown, the blur is neglected.
    to_light: Option<Vector3<f64>>,
}

impl Course {
    /// The course at a sample that was triangulated as `hit`, with noise of `noise_sigma_mm` along its ray. `turn` maps
    /// directions from the camera to the part frame. `None` if the line cannot be followed.
    pub(crate) fn at(
        (samples, sample_idx): (&Samples, u32),
        (calibration, hit): (&Calibration, &TriangulatedPoint),
        noise_sigma_mm: f64,
        reach: usize,
        turn: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    ) -> Option<Self> {
        let point = samples.point(sample_idx);
        let pixel = Vector2::new(f64::from(point.u_px), f64::from(point.v_px));
        let step = |by: Vector2<f64>| {
            let beside = calibration.triangulate(point.order, &(pixel + by), Some(hit.hit.phi_rad))?;
            Some(beside.hit_in_camera.xyz - hit.hit_in_camera.xyz)
        };
        let (by_u, by_v) = (step(Vector2::x())?, step(Vector2::y())?);
        // A surface facing the camera meets the sheet along this direction.
        let level = hit.hit.normal.cross(&hit.ray);
        let products = Matrix2::new(by_u.dot(&by_u), by_u.dot(&by_v), by_u.dot(&by_v), by_v.dot(&by_v));
        let of_level = products.try_inverse()? * Vector2::new(by_u.dot(&level), by_v.dot(&level));
        let runs_along_u = of_level.x.abs() > of_level.y.abs();
        let (column_mm, row_mm, across) =
            if runs_along_u { (by_u, by_v, [0.0, 1.0]) } else { (by_v, by_u, [1.0, 0.0]) };
        let (n_before, n_after) = continues(samples, sample_idx, runs_along_u, reach);
        let sigma_px = noise_sigma_mm / hit.noise_sigma_mm(&across, 1.0);
        Some(Self {
            column_mm: turn(&column_mm),
            row_mm: turn(&row_mm),
            n_before,
            n_after,
            sigma_px,
            to_light: samples.to_light(sample_idx),
        })
    }

    /// Displacement of the point at `position` on a shape along its outward normal by blur and averaging, mm.
    pub(crate) fn displacement_mm(
        &self,
        shape: &Shape,
        position: &Vector3<f64>,
        averaging: &AveragingBias,
    ) -> f64 {
        let Some((rows_px, at)) = self.rows_px(shape, position) else { return 0.0 };
        let displaced_px = f64::from(rows_px[at]) + averaging.at(&rows_px, at, self.sigma_px);
        displaced_px * self.row_mm.dot(&shape.normal_at(position))
    }

    /// Rows of the line on a curved shape as the camera sees them, relative to where it meets the shape at `position`, and
    /// the index of that point.
    fn rows_px(&self, shape: &Shape, position: &Vector3<f64>) -> Option<(Vec<f32>, usize)> {
        let (centre, radius_mm, axis) = match shape {
            Shape::Plane { .. } => return None,
            Shape::Sphere { centre_mm, radius_mm } => (centre_mm, radius_mm, Vector3::zeros()),
            Shape::Cylinder { point_mm, axis, radius_mm } => (point_mm, radius_mm, *axis),
        };
        let across = |v: Vector3<f64>| v - axis * axis.dot(&v);
        let from_centre = across(position - centre);
        let (column, row) = (across(self.column_mm), across(self.row_mm));
        let square = row.norm_squared();
        let side = row.dot(&from_centre).signum();
        let meets = |k: f64| {
            let there = from_centre + column * k;
            let half = row.dot(&there);
            let root = half * half - square * (there.norm_squared() - radius_mm * radius_mm);
            (root > 0.0).then(|| (side * root.sqrt() - half) / square)
        };
        let seen = |k: f64| {
            let there = meets(k)?;
            let blur_px = |to_light| {
                let [before, after] = [k - 1.0, k + 1.0].map(|k| Some((k, meets(k)?)));
                let (before, after) = (before?, after?);
                let [first, last] = [before, after].map(|(k, row_px)| {
                    let normal = (from_centre + column * k + row * row_px).normalize();
                    normal.dot(&to_light).max(COURSE_MIN_BRIGHTNESS)
                });
                let slope = (after.1 - before.1) / 2.0;
                let curvature = before.1 + after.1 - 2.0 * there;
                Some(BLUR_SQUARED_PX2 * (curvature / 2.0 + slope * (last / first).ln() / 2.0))
            };
            Some(there + self.to_light.and_then(blur_px).unwrap_or(0.0))
        };
        let own = meets(0.0)?;
        let follow = |n: usize, direction: f64| -> Vec<f32> {
            (1..=n).map_while(|k| Some((seen(direction * k as f64)? - own) as f32)).collect()
        };
        let (before, after) = (follow(self.n_before, -1.0), follow(self.n_after, 1.0));
        let (at, here) = (before.len(), (seen(0.0)? - own) as f32);
        Some((before.into_iter().rev().chain([here]).chain(after).collect(), at))
    }
}

/// Columns over which the line of a sample continues before and after it, at most `reach`.
fn continues(samples: &Samples, sample_idx: u32, runs_along_u: bool, reach: usize) -> (usize, usize) {
    let points = &samples.cloud.points;
    let own_idx = samples.cloud_idx(sample_idx) as usize;
    let along_across = |point: &CloudPoint| {
        let (u, v) = (f64::from(point.u_px), f64::from(point.v_px));
        if runs_along_u { (u, v) } else { (v, u) }
    };
    let max_gap = 1.0 + COURSE_MAX_GAP * reach as f64;
    let follows = |pair: &&[CloudPoint]| {
        let [first, second] = [along_across(&pair[0]), along_across(&pair[1])];
        let gap = (second.0 - first.0).abs();
        let is_same_line = pair[0].frame == pair[1].frame && pair[0].order == pair[1].order;
        is_same_line && gap <= max_gap && (second.1 - first.1).abs() <= COURSE_MAX_SLOPE * gap
    };
    let own = along_across(&points[own_idx]).0;
    let distance = |last: Option<&CloudPoint>| {
        let n = last.map_or(0.0, |point| (along_across(point).0 - own).abs());
        (n.round() as usize).min(reach)
    };
    let before = points[..=own_idx].windows(2).rev().take(reach).take_while(follows).last().map(|pair| &pair[0]);
    let after = points[own_idx..].windows(2).take(reach).take_while(follows).last().map(|pair| &pair[1]);
    (distance(before), distance(after))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROD: Shape = Shape::Cylinder {
        point_mm: Vector3::new(3.0, 0.0, 0.0),
        axis: Vector3::new(1.0, 0.0, 0.0),
        radius_mm: 5.0,
    };

    /// A line across the rod, seen from above at 0.1 mm per column and 0.2 mm per row.
    fn across(to_light: Option<Vector3<f64>>) -> Course {
        let (column_mm, row_mm) = (Vector3::new(0.0, 0.1, 0.0), Vector3::new(0.0, 0.0, 0.2));
        Course { column_mm, row_mm, n_before: 17, n_after: 17, sigma_px: 0.1, to_light }
    }

    fn on_rod(angle_deg: f64) -> Vector3<f64> {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        Vector3::new(0.0, 5.0 * sin, 5.0 * cos)
    }

    #[test]
    fn rows_are_those_of_the_circle_displaced_by_the_blur() {
        let course = across(Some(Vector3::z()));
        let (rows_px, at) = course.rows_px(&ROD, &on_rod(30.0)).unwrap();
        assert_eq!((rows_px.len(), at), (35, 17));
        // Circle of 50 px, whose rows are half as long: v(u) = √(50² − u²)/2, and the light falls like the circle.
        let seen = |u: f64| {
            let height = (2500.0 - u * u).sqrt();
            let (slope, curvature) = (-u / height / 2.0, -2500.0 / height.powi(3) / 2.0);
            height / 2.0 + BLUR_SQUARED_PX2 * (curvature / 2.0 - slope * u / (2500.0 - u * u))
        };
        let top = 50.0 * 30f64.to_radians().cos() / 2.0;
        for (k, row_px) in rows_px.iter().enumerate() {
            let expected = seen(25.0 + k as f64 - 17.0) - top;
            assert!((f64::from(*row_px) - expected).abs() < 1e-3, "{k}: {row_px} {expected}");
        }
    }

    #[test]
    fn flanks_are_displaced_outwards_where_windows_are_whole_and_inwards_where_the_line_ends() {
        let averaging = AveragingBias::new(9.5);
        assert_eq!(averaging.reach(), 16);
        let displaced_um = |course: &Course, at: f64| 1e3 * course.displacement_mm(&ROD, &on_rod(at), &averaging);
        let whole = across(None);
        assert!(displaced_um(&whole, 0.0).abs() < 0.2, "{}", displaced_um(&whole, 0.0));
        let [flank, cut] =
            [whole.clone(), Course { n_after: 3, ..whole }].map(|course| displaced_um(&course, 45.0));
        assert!(flank > 0.5 && cut < -0.5, "{flank} {cut} µm");
    }

    #[test]
    fn points_that_were_not_averaged_are_displaced_by_the_blur_alone() {
        let averaging = AveragingBias::new(1.0);
        assert_eq!(averaging.reach(), 0);
        let displaced_um = |to_light| 1e3 * across(to_light).displacement_mm(&ROD, &on_rod(0.0), &averaging);
        // On top of a circle of 50 columns seen at half its height: b²·v″/2, and no slope.
        let by_blur_um = -200.0 * BLUR_SQUARED_PX2 / 2.0 * 0.5 / 50.0;
        assert!((displaced_um(Some(Vector3::z())) - by_blur_um).abs() < 1e-2);
        assert_eq!(displaced_um(None), 0.0);
    }

    #[test]
    fn a_line_along_a_rod_is_straight() {
        let (column_mm, row_mm) = (Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.0, 0.1, 0.2));
        let course = Course { column_mm, row_mm, ..across(None) };
        let displaced_mm = course.displacement_mm(&ROD, &on_rod(40.0), &AveragingBias::new(9.5));
        assert!(displaced_mm.abs() < 1e-9, "{displaced_mm}");
    }
}
