//! Features: fitted to a cloud, or constructed from other features.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::interface::region::Region;

/// A feature of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    /// Its name within the plan.
    pub id: String,
    /// Its type and parameters.
    pub shape: FeatureShape,
}

/// The points in which a feature is searched; all by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// Region: in the frame of the scan for features the alignment depends on, in the datum frame for all others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<Region>,
    /// Only points of these diffraction orders; all if empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub orders: Vec<i8>,
    /// Only points where the surface faces this direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facing: Option<Facing>,
}

/// A range of directions of the surface normal, which points towards the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Facing {
    /// The central direction, of any length, in the frame of the region.
    pub normal: [f64; 3],
    /// Largest angle from it, degrees.
    pub within_deg: f64,
}

/// Fitted shapes and constructed features.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum FeatureShape {
    /// The plane with the most points.
    Plane {
        /// Points to search.
        #[serde(default)]
        select: Selection,
    },
    /// The sphere with the most points.
    Sphere {
        /// Points to search.
        #[serde(default)]
        select: Selection,
        /// Approximate radius to select the feature, mm; it does not bias the result.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radius_mm: Option<f64>,
    },
    /// The cylinder with the most points.
    Cylinder {
        /// Points to search.
        #[serde(default)]
        select: Selection,
        /// Approximate radius to select the feature, mm; it does not bias the result.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radius_mm: Option<f64>,
    },
    /// A round hole in a plane, or the round rim of a plane: the circle through the points where laser lines cross the rim.
    Circle {
        /// The plane around (or inside) it.
        plane: String,
        /// Points to search; must contain the rim and a strip of the plane along it.
        #[serde(default)]
        select: Selection,
    },
    /// A slot in a plane: two parallel sides and two half circles.
    Slot {
        /// The plane around it.
        plane: String,
        /// Points to search; must contain the rim and a strip of the plane along it.
        #[serde(default)]
        select: Selection,
    },
    /// A straight rim of a plane; the plane is on its left, seen from the camera.
    Edge {
        /// The plane that ends there.
        plane: String,
        /// Points to search; must contain the rim and a strip of the plane along it.
        #[serde(default)]
        select: Selection,
    },
    /// Points near a cut through the part, compared with a nominal contour.
    Section {
        /// Points to search: a slice about the cut.
        #[serde(default)]
        select: Selection,
        /// Origin of the contour's coordinates, mm, datum frame.
        origin_mm: [f64; 3],
        /// Direction of the contour's first coordinate.
        x: [f64; 3],
        /// Direction of its second coordinate: away from the material where the contour runs along the first.
        y: [f64; 3],
        /// Corners of the nominal contour, mm.
        contour_mm: Vec<[f64; 2]>,
    },
    /// A line constructed from other features.
    Line {
        /// The features.
        of: LineOf,
    },
    /// A point constructed from other features.
    Point {
        /// The features.
        of: PointOf,
    },
}

/// How a line is constructed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LineOf {
    /// Intersection of two planes.
    Planes([String; 2]),
    /// The axis of a cylinder, of a circle, or the long axis of a slot.
    Axis(String),
    /// From one point to another.
    Points([String; 2]),
}

/// How a point is constructed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PointOf {
    /// The centre of a sphere, circle or slot, or of a plane's points.
    Centre(String),
    /// Intersection of a line (an edge, an axis) with a plane; line first.
    LineAndPlane([String; 2]),
    /// Intersection of three planes.
    Planes([String; 3]),
    /// The point of the first line nearest to the second.
    Lines([String; 2]),
}

impl FeatureShape {
    /// The features it depends on.
    pub fn depends_on(&self) -> Vec<&str> {
        match self {
            Self::Plane { .. } | Self::Sphere { .. } | Self::Cylinder { .. } | Self::Section { .. } => Vec::new(),
            Self::Circle { plane, .. } | Self::Slot { plane, .. } | Self::Edge { plane, .. } => vec![plane],
            Self::Line { of: LineOf::Axis(id) } | Self::Point { of: PointOf::Centre(id) } => vec![id],
            Self::Line { of: LineOf::Planes(ids) | LineOf::Points(ids) }
            | Self::Point { of: PointOf::LineAndPlane(ids) | PointOf::Lines(ids) } => {
                ids.iter().map(|id| &**id).collect()
            }
            Self::Point { of: PointOf::Planes(ids) } => ids.iter().map(|id| &**id).collect(),
        }
    }

    /// Points to search; `None` for constructed features.
    pub fn selection(&self) -> Option<&Selection> {
        match self {
            Self::Plane { select }
            | Self::Sphere { select, .. }
            | Self::Cylinder { select, .. }
            | Self::Circle { select, .. }
            | Self::Slot { select, .. }
            | Self::Edge { select, .. }
            | Self::Section { select, .. } => Some(select),
            Self::Line { .. } | Self::Point { .. } => None,
        }
    }

    /// Its name in documents and results.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane { .. } => "plane",
            Self::Sphere { .. } => "sphere",
            Self::Cylinder { .. } => "cylinder",
            Self::Circle { .. } => "circle",
            Self::Slot { .. } => "slot",
            Self::Edge { .. } => "edge",
            Self::Section { .. } => "section",
            Self::Line { .. } => "line",
            Self::Point { .. } => "point",
        }
    }
}
