//! The datum frame of a part from three datums.

use nalgebra::{Matrix3, Rotation3, Vector3};
use optics::{PartFrame, Rigid};

use crate::evaluation::geometry::Geometry;
use crate::interface::request::MeasureError;

/// Smallest sine between two directions, and smallest determinant of three, that determine a frame: 3°.
const MIN_SINE: f64 = 0.05;

/// The frame defined by the datums of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DatumFrame;

/// The geometry of a datum.
#[derive(Clone, Copy)]
enum Datum {
    Plane(Vector3<f64>, Vector3<f64>),
    Line(Vector3<f64>, Vector3<f64>),
    Point(Vector3<f64>),
}

impl Datum {
    fn of(geometry: &Geometry) -> Option<Self> {
        let plane = geometry.plane().map(|(at, normal)| Self::Plane(at, normal));
        let line = || geometry.line().map(|(at, direction)| Self::Line(at, direction));
        plane.or_else(line).or_else(|| geometry.point().map(Self::Point))
    }

    fn direction(self) -> Option<Vector3<f64>> {
        match self {
            Self::Plane(_, direction) | Self::Line(_, direction) => Some(direction),
            Self::Point(_) => None,
        }
    }

    fn at(self) -> Vector3<f64> {
        match self {
            Self::Plane(at, _) | Self::Line(at, _) | Self::Point(at) => at,
        }
    }
}

/// The frame of three datums in order of precedence ([`crate::Alignment`]).
///
/// # Errors
/// [`MeasureError::UnderconstrainedDatums`] names a degree of freedom that the datums do not constrain.
pub(crate) fn datum_from_part(datums: [&Geometry; 3]) -> Result<Rigid<DatumFrame, PartFrame>, MeasureError> {
    let free = |freedom| MeasureError::UnderconstrainedDatums { freedom };
    let datums: Vec<Datum> = datums.into_iter().filter_map(Datum::of).collect();
    if datums.len() < 3 {
        return Err(free("the frame: a datum has neither position nor direction"));
    }
    let axes = axes(&datums).map_err(free)?;
    let origin = origin(&datums, &axes).map_err(free)?;
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_rows(&axes.map(|axis| axis.transpose())));
    Ok(Rigid::new(rotation, -(rotation * origin)))
}

/// The axes x, y, z of the datum frame, in the part frame.
fn axes(datums: &[Datum]) -> Result<[Vector3<f64>; 3], &'static str> {
    let with_direction = datums.iter().position(|datum| datum.direction().is_some());
    let z = match with_direction {
        Some(idx) => datums[idx].direction().unwrap_or_default(),
        None => {
            let (first, second) = (datums[1].at() - datums[0].at(), datums[2].at() - datums[0].at());
            let cross = first.cross(&second);
            let sine = cross.norm() / (first.norm() * second.norm());
            let towards_camera = |z: Vector3<f64>| if z.dot(&datums[0].at()) > 0.0 { -z } else { z };
            (sine > MIN_SINE)
                .then(|| towards_camera(cross.normalize()))
                .ok_or("the rotation about the line through the points")?
        }
    };
    let across = |direction: Vector3<f64>| {
        let flat = direction - z * z.dot(&direction);
        (flat.norm() > MIN_SINE * direction.norm()).then(|| flat.normalize())
    };
    let mut points: Vec<Vector3<f64>> = Vec::new();
    if let (Some(idx), Some(Datum::Line(at, _))) = (with_direction, with_direction.map(|idx| datums[idx])) {
        // The line that gives z also serves as a point: another point then gives x.
        if idx == 0 {
            points.push(at);
        }
    }
    let mut x = None;
    for (idx, datum) in datums.iter().enumerate().filter(|(idx, _)| Some(*idx) != with_direction) {
        let candidate = match *datum {
            Datum::Line(_, direction) => across(direction),
            // The second plane is at y = 0, the third at x = 0; the axis points along its normal.
            Datum::Plane(_, normal) if idx < 2 => across(normal).map(|y| y.cross(&z)),
            Datum::Plane(_, normal) => across(normal),
            Datum::Point(at) => {
                points.push(at);
                points.first().filter(|_| points.len() > 1).and_then(|first| across(at - first))
            }
        };
        if candidate.is_some() {
            x = candidate;
            break;
        }
    }
    let x = x.ok_or("the rotation about z")?;
    Ok([x, z.cross(&x), z])
}

/// Origin of the datum frame, part frame, mm.
fn origin(datums: &[Datum], axes: &[Vector3<f64>; 3]) -> Result<Vector3<f64>, &'static str> {
    let mut rows: [Option<(Vector3<f64>, f64)>; 3] = [None; 3];
    let set = |rows: &mut [Option<(Vector3<f64>, f64)>; 3], axis: usize, row: Vector3<f64>, at: &Vector3<f64>| {
        rows[axis].get_or_insert((row, row.dot(at)));
    };
    for (idx, datum) in datums.iter().enumerate() {
        match *datum {
            Datum::Point(at) => (0..3).for_each(|axis| set(&mut rows, axis, axes[axis], &at)),
            Datum::Line(at, direction) => {
                let along = largest(&axes.map(|axis| axis.dot(&direction)));
                for axis in (0..3).filter(|axis| *axis != along) {
                    let slope = axes[axis].dot(&direction) / axes[along].dot(&direction);
                    set(&mut rows, axis, axes[axis] - axes[along] * slope, &at);
                }
            }
            Datum::Plane(at, normal) => {
                let free: Vec<usize> = (0..3).filter(|axis| idx == 0 || rows[*axis].is_none()).collect();
                let steep = free
                    .into_iter()
                    .max_by(|a, b| axes[*a].dot(&normal).abs().total_cmp(&axes[*b].dot(&normal).abs()));
                if let Some(axis) = steep.filter(|axis| axes[*axis].dot(&normal).abs() > MIN_SINE) {
                    set(&mut rows, axis, normal, &at);
                }
            }
        }
    }
    let names = ["the translation along x", "the translation along y", "the translation along z"];
    if let Some(axis) = rows.iter().position(Option::is_none) {
        return Err(names[axis]);
    }
    let rows = rows.map(Option::unwrap_or_default);
    let matrix = Matrix3::from_rows(&rows.map(|(row, _)| row.normalize().transpose()));
    let right = Vector3::from(rows.map(|(row, value)| value / row.norm()));
    let solved = matrix.try_inverse().filter(|_| matrix.determinant().abs() > MIN_SINE);
    solved.map(|inverse| inverse * right).ok_or("the translation along a direction")
}

fn largest(values: &[f64; 3]) -> usize {
    (0..3).max_by(|a, b| values[*a].abs().total_cmp(&values[*b].abs())).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interface::shape::Shape;

    /// Rounding at 400 mm.
    const ROUNDING: f64 = 1e-9;

    fn plane(point: [f64; 3], normal: [f64; 3]) -> Geometry {
        let normal = Vector3::from(normal).normalize();
        Geometry::Surface(Shape::Plane { point_mm: Vector3::from(point), normal })
    }

    fn line(point: [f64; 3], direction: [f64; 3]) -> Geometry {
        Geometry::Line { point_mm: Vector3::from(point), direction: Vector3::from(direction).normalize() }
    }

    fn point(at: [f64; 3]) -> Geometry {
        Geometry::Point { at_mm: Vector3::from(at) }
    }

    /// The same geometry moved by a pose.
    fn seen(pose: &Rigid<PartFrame, DatumFrame>, geometry: &Geometry) -> Geometry {
        let at = |p: &Vector3<f64>| pose.rotation * p + pose.translation_mm;
        match geometry {
            Geometry::Surface(Shape::Plane { point_mm, normal }) => {
                Geometry::Surface(Shape::Plane { point_mm: at(point_mm), normal: pose.rotation * normal })
            }
            Geometry::Line { point_mm, direction } => {
                Geometry::Line { point_mm: at(point_mm), direction: pose.rotation * direction }
            }
            Geometry::Point { at_mm } => Geometry::Point { at_mm: at(at_mm) },
            other => *other,
        }
    }

    #[test]
    fn a_random_pose_is_recovered_from_every_kind_of_datums() {
        let pose: Rigid<PartFrame, DatumFrame> =
            Rigid::new(Rotation3::new(Vector3::new(0.3, -2.9, 0.4)), Vector3::new(12.0, -7.0, 402.0));
        let top = plane([5.0, 3.0, 0.0], [0.0, 0.0, 1.0]);
        let cases: [[Geometry; 3]; 8] = [
            [top, line([4.0, 0.0, -2.0], [1.0, 0.0, 0.2]), point([0.0, 9.0, 1.0])],
            [top, plane([7.0, 0.0, -3.0], [0.0, 1.0, 0.0]), plane([0.0, 4.0, 1.0], [1.0, 0.0, 0.0])],
            [top, plane([7.0, 0.0, -3.0], [0.0, 1.0, 0.0]), point([0.0, 4.0, 1.0])],
            [top, point([0.0, 0.0, -3.0]), point([8.0, 0.0, 5.0])],
            [
                line([0.0, 0.0, 8.0], [0.0, 0.0, 1.0]),
                plane([4.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
                point([5.0, 0.0, 2.0]),
            ],
            [
                line([0.0, 0.0, 8.0], [0.0, 0.0, 1.0]),
                point([5.0, 0.0, 0.0]),
                plane([1.0, 1.0, 1.0], [0.0, 0.0, 1.0]),
            ],
            [point([0.0, 0.0, 0.0]), top, line([0.0, 3.0, 1.0], [1.0, 0.0, 0.0])],
            [point([0.0; 3]), point([10.0, 0.0, 0.0]), point([4.0, 8.0, 0.0])],
        ];
        for (idx, datums) in cases.iter().enumerate() {
            let found = datum_from_part([0, 1, 2].map(|k| seen(&pose, &datums[k])).each_ref()).unwrap();
            let round_trip = found * pose;
            // Three points do not determine the sign of their normal: it points towards the camera.
            let upside_down = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
            let turned = |expected: &Matrix3<f64>| (round_trip.axes() - expected).amax();
            let turn = turned(&Matrix3::identity());
            let is_half_turn = idx == 7 && turned(&upside_down) < ROUNDING;
            let shift = round_trip.translation_mm.norm();
            assert!((turn < ROUNDING || is_half_turn) && shift < 1e-8, "case {idx}: {turn}, {shift} mm");
        }
    }

    #[test]
    fn an_unconstrained_degree_of_freedom_is_named() {
        let top = plane([5.0, 3.0, 400.0], [0.0, 0.0, -1.0]);
        let cases = [
            ([top, plane([0.0, 0.0, 390.0], [0.01, 0.0, -1.0]), point([1.0, 1.0, 400.0])], "rotation about z"),
            (
                [top, line([0.0, 0.0, 400.0], [1.0, 0.0, 0.0]), line([9.0, 5.0, 400.0], [1.0, 0.02, 0.0])],
                "translation along x",
            ),
            (
                [point([0.0, 0.0, 400.0]), point([1.0, 1.0, 401.0]), point([2.0, 2.0, 402.0])],
                "rotation about the line through the points",
            ),
        ];
        for (datums, freedom) in cases {
            let error = datum_from_part(datums.each_ref()).unwrap_err();
            assert!(error.to_string().contains(freedom), "{error}");
        }
    }
}
