//! The geometry of fitted features, and lines and points constructed from it.

use nalgebra::{Matrix3, Vector3};
use optics::{PartFrame, Rigid};

use crate::interface::shape::Shape;
use crate::plan::feature::{LineOf, PointOf};

/// Smallest sine between directions whose intersection is determined: 1°.
const MIN_SINE: f64 = 0.017;

/// A feature in the part frame, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Geometry {
    /// A plane, sphere or cylinder.
    Surface(Shape),
    /// A circle in space.
    Circle {
        /// Its centre.
        centre_mm: Vector3<f64>,
        /// The normal of its plane, towards the camera.
        normal: Vector3<f64>,
        /// Its radius.
        radius_mm: f64,
    },
    /// A slot: two parallel sides and two half circles.
    Slot {
        /// Its centre.
        centre_mm: Vector3<f64>,
        /// The normal of its plane, towards the camera.
        normal: Vector3<f64>,
        /// The direction of its long axis.
        direction: Vector3<f64>,
        /// Length over both ends.
        length_mm: f64,
        /// Width between the sides.
        width_mm: f64,
    },
    /// A line; its point is the centre of the data it was fitted to.
    Line {
        /// A point on it.
        point_mm: Vector3<f64>,
        /// Unit vector along it.
        direction: Vector3<f64>,
    },
    /// A point.
    Point {
        /// Its position.
        at_mm: Vector3<f64>,
    },
}

impl Geometry {
    /// Point and normal, if it is a plane.
    pub(crate) fn plane(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        match self {
            Self::Surface(Shape::Plane { point_mm, normal }) => Some((*point_mm, *normal)),
            _ => None,
        }
    }

    /// Point and direction, if it is a line or has an axis.
    pub(crate) fn line(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        match self {
            Self::Surface(Shape::Cylinder { point_mm, axis, .. }) => Some((*point_mm, *axis)),
            Self::Line { point_mm, direction } => Some((*point_mm, *direction)),
            _ => None,
        }
    }

    /// Its position, if it is a point or has a centre.
    pub(crate) fn point(&self) -> Option<Vector3<f64>> {
        match self {
            Self::Surface(Shape::Sphere { centre_mm, .. })
            | Self::Circle { centre_mm, .. }
            | Self::Slot { centre_mm, .. } => Some(*centre_mm),
            Self::Point { at_mm } => Some(*at_mm),
            _ => None,
        }
    }

    /// Its radius, if it has one, mm.
    pub(crate) fn radius_mm(&self) -> Option<f64> {
        match self {
            Self::Surface(Shape::Sphere { radius_mm, .. } | Shape::Cylinder { radius_mm, .. })
            | Self::Circle { radius_mm, .. } => Some(*radius_mm),
            _ => None,
        }
    }

    /// The same geometry in another frame.
    pub(crate) fn moved<To>(&self, pose: &Rigid<To, PartFrame>) -> Self {
        let at = |place: &Vector3<f64>| pose.rotation * place + pose.translation_mm;
        let to = |direction: &Vector3<f64>| pose.rotation * direction;
        match self {
            Self::Surface(shape) => Self::Surface(shape.moved(pose)),
            Self::Circle { centre_mm, normal, radius_mm } => {
                Self::Circle { centre_mm: at(centre_mm), normal: to(normal), radius_mm: *radius_mm }
            }
            Self::Slot { centre_mm, normal, direction, length_mm, width_mm } => Self::Slot {
                centre_mm: at(centre_mm),
                normal: to(normal),
                direction: to(direction),
                length_mm: *length_mm,
                width_mm: *width_mm,
            },
            Self::Line { point_mm, direction } => Self::Line { point_mm: at(point_mm), direction: to(direction) },
            Self::Point { at_mm } => Self::Point { at_mm: at(at_mm) },
        }
    }

    /// The normal of a plane or the direction of a line.
    pub(crate) fn direction(&self) -> Option<Vector3<f64>> {
        self.plane().or(self.line()).map(|(_, direction)| direction)
    }
}

/// The line constructed from other features; `of` returns a feature by its id.
pub(crate) fn line_of<'a>(rule: &LineOf, of: impl Fn(&str) -> Option<&'a Geometry>) -> Option<Geometry> {
    let (point_mm, direction) = match rule {
        LineOf::Axis(id) => match of(id)? {
            Geometry::Circle { centre_mm, normal, .. } => (*centre_mm, *normal),
            Geometry::Slot { centre_mm, direction, .. } => (*centre_mm, *direction),
            other => other.line()?,
        },
        LineOf::Points([from, to]) => {
            let (from, to) = (of(from)?.point()?, of(to)?.point()?);
            (from, (to - from).try_normalize(f64::MIN_POSITIVE)?)
        }
        LineOf::Planes([first, second]) => {
            let ((p, n), (q, m)) = (of(first)?.plane()?, of(second)?.plane()?);
            let cross = n.cross(&m);
            let direction = cross.try_normalize(MIN_SINE)?;
            // The point of the line nearest to the midpoint of the planes' points.
            let middle = (p + q) / 2.0;
            let rows = Matrix3::from_rows(&[n.transpose(), m.transpose(), direction.transpose()]);
            let at = Vector3::new(n.dot(&p), m.dot(&q), direction.dot(&middle));
            (rows.try_inverse()? * at, direction)
        }
    };
    Some(Geometry::Line { point_mm, direction })
}

/// The point constructed from other features.
pub(crate) fn point_of<'a>(rule: &PointOf, of: impl Fn(&str) -> Option<&'a Geometry>) -> Option<Geometry> {
    let at_mm = match rule {
        PointOf::Centre(id) => {
            let geometry = of(id)?;
            geometry.point().or_else(|| Some(geometry.plane()?.0))?
        }
        PointOf::LineAndPlane([line, plane]) => {
            let ((p, direction), (q, n)) = (of(line)?.line()?, of(plane)?.plane()?);
            let steepness = n.dot(&direction);
            (steepness.abs() > MIN_SINE).then(|| p + direction * (n.dot(&(q - p)) / steepness))?
        }
        PointOf::Planes(ids) => {
            let planes = [of(&ids[0])?.plane()?, of(&ids[1])?.plane()?, of(&ids[2])?.plane()?];
            let rows = Matrix3::from_rows(&planes.map(|(_, n)| n.transpose()));
            let at = Vector3::from(planes.map(|(p, n)| n.dot(&p)));
            (rows.determinant().abs() > MIN_SINE).then(|| rows.try_inverse().map(|inverse| inverse * at))??
        }
        PointOf::Lines([first, second]) => {
            let ((p, l), (q, m)) = (of(first)?.line()?, of(second)?.line()?);
            let cross = l.cross(&m);
            let square = cross.norm_squared();
            (square > MIN_SINE * MIN_SINE).then(|| p + l * ((q - p).cross(&m).dot(&cross) / square))?
        }
    };
    Some(Geometry::Point { at_mm })
}
