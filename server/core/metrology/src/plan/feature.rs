//! What is fitted to a cloud, or made of what was fitted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::interface::region::Region;

/// A feature of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    /// Its name within the plan.
    pub id: String,
    /// What it is.
    pub shape: FeatureShape,
}

/// The points a feature is looked for in; all if nothing is said.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// Where: in the frame of the scan for features the alignment rests on, in the datum frame for all others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<Region>,
    /// Of these diffraction orders alone; of all if empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub orders: Vec<i8>,
    /// Only where the surface faces this way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facing: Option<Facing>,
}

/// A range of directions of the surface's normal, which looks to the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Facing {
    /// The middle direction, of any length, in the frame of the region.
    pub normal: [f64; 3],
    /// Largest angle from it, degrees.
    pub within_deg: f64,
}

/// Shapes, and what is made of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum FeatureShape {
    /// The plane with the most points.
    Plane {
        /// Where.
        #[serde(default)]
        select: Selection,
    },
    /// The sphere with the most points.
    Sphere {
        /// Where.
        #[serde(default)]
        select: Selection,
        /// A hint which is meant, mm; never a bias.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radius_mm: Option<f64>,
    },
    /// The cylinder with the most points.
    Cylinder {
        /// Where.
        #[serde(default)]
        select: Selection,
        /// A hint which is meant, mm; never a bias.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radius_mm: Option<f64>,
    },
    /// A round hole in a plane, or the round rim of one: the circle through the places where lines cross the rim.
    Circle {
        /// The plane around (or inside) it.
        plane: String,
        /// Where; must hold the rim and a strip of the plane along it.
        #[serde(default)]
        select: Selection,
    },
    /// A slot in a plane: two parallel sides and two half circles.
    Slot {
        /// The plane around it.
        plane: String,
        /// Where; must hold the rim and a strip of the plane along it.
        #[serde(default)]
        select: Selection,
    },
    /// A straight rim of a plane; it runs with the plane on its left, seen from the camera's side.
    Edge {
        /// The plane that ends there.
        plane: String,
        /// Where; must hold the rim and a strip of the plane along it.
        #[serde(default)]
        select: Selection,
    },
    /// Points near a cut through the part, to be compared with the contour they should have.
    Section {
        /// Where: a slice about the cut.
        #[serde(default)]
        select: Selection,
        /// Origin of the contour's coordinates, mm, datum frame.
        origin_mm: [f64; 3],
        /// Direction of the contour's first coordinate.
        x: [f64; 3],
        /// Direction of its second one: away from the material where the contour runs along the first.
        y: [f64; 3],
        /// Corners of the nominal contour, mm.
        contour_mm: Vec<[f64; 2]>,
    },
    /// A line made of other features.
    Line {
        /// Of which.
        of: LineOf,
    },
    /// A point made of other features.
    Point {
        /// Of which.
        of: PointOf,
    },
}

/// What makes a line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LineOf {
    /// Where two planes meet.
    Planes([String; 2]),
    /// The axis of a cylinder, of a circle, or the long axis of a slot.
    Axis(String),
    /// From one point to another.
    Points([String; 2]),
}

/// What makes a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PointOf {
    /// The centre of a sphere, circle or slot, or of a plane's points.
    Centre(String),
    /// Where a line (an edge, an axis) meets a plane: line first.
    LineAndPlane([String; 2]),
    /// Where three planes meet.
    Planes([String; 3]),
    /// Where the first line passes nearest to the second.
    Lines([String; 2]),
}

impl FeatureShape {
    /// The features it rests on.
    pub fn rests_on(&self) -> Vec<&str> {
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

    /// Where it is looked for; `None` for what is made of other features.
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

    /// Its word in documents and results.
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
