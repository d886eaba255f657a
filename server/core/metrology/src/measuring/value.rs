//! The value of each tool as a pure function of the fitted shapes and their points.

use nalgebra::Vector3;

use crate::interface::request::Tool;
use crate::interface::shape::Shape;
use crate::measuring::measure::Measurand;
use crate::params::FLATNESS_FRACTION;

/// Data of the first shape's points, part frame.
pub(crate) struct FirstPoints {
    /// Their positions; needed by `flatness` only.
    pub(crate) positions: Vec<Vector3<f64>>,
    /// Mean camera position over the points; needed by `plane` only.
    pub(crate) camera: Vector3<f64>,
}

/// The value of a tool (mm, or degrees for `angle`, on the measurand's side); independent of the origin of the part
/// frame. `None` if the shapes do not fit the tool.
pub(crate) fn value(measurand: &Measurand, shapes: &[Shape], first: &FirstPoints) -> Option<f64> {
    match (measurand.tool, shapes) {
        (Tool::Plane, [plane @ Shape::Plane { .. }]) => Some(plane.distance_mm(&first.camera).abs()),
        (Tool::Sphere, [Shape::Sphere { radius_mm, .. }]) => Some(*radius_mm),
        (Tool::Cylinder, [Shape::Cylinder { radius_mm, .. }]) => Some(*radius_mm),
        (Tool::Step, [base, Shape::Plane { point_mm, .. }]) => Some(base.distance_mm(point_mm)),
        (Tool::Distance, [Shape::Sphere { centre_mm: a, .. }, Shape::Sphere { centre_mm: b, .. }]) => {
            Some((b - a).norm())
        }
        (
            Tool::Distance,
            [first @ Shape::Plane { point_mm: a, .. }, second @ Shape::Plane { point_mm: b, .. }],
        ) => Some((first.distance_mm(b).abs() + second.distance_mm(a).abs()) / 2.0),
        (Tool::Angle, [Shape::Plane { normal: a, .. }, Shape::Plane { normal: b, .. }]) => {
            let turn = turn_rad(a, b);
            let angle = measurand.turn.map_or(turn.norm(), |about| turn.dot(&about)).to_degrees();
            Some(if measurand.supplement { 180.0 - angle } else { angle })
        }
        (Tool::Flatness, [plane @ Shape::Plane { .. }]) => {
            let mut residuals: Vec<f64> = first.positions.iter().map(|p| plane.distance_mm(p)).collect();
            Some(band_width(&mut residuals))
        }
        _ => None,
    }
}

/// The shortest rotation from one unit vector to another, as a rotation vector, rad.
pub(crate) fn turn_rad(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let cross = from.cross(to);
    let sine = cross.norm();
    if sine > 0.0 { cross * (sine.atan2(from.dot(to)) / sine) } else { cross }
}

/// Width of the interval that contains the central [`FLATNESS_FRACTION`] of the values, interpolated between ranks.
pub(crate) fn band_width(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_unstable_by(f64::total_cmp);
    let tail = (1.0 - FLATNESS_FRACTION) / 2.0;
    let quantile = |share: f64| {
        let rank = share * (values.len() - 1) as f64;
        let below = values[rank.floor() as usize];
        below + (values[rank.ceil() as usize] - below) * rank.fract()
    };
    quantile(1.0 - tail) - quantile(tail)
}
