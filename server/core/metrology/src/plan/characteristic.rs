//! What is measured on features, and within which limits.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::interface::measurement::Unit;
use crate::interface::region::Region;

/// A characteristic of a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Characteristic {
    /// Its name in the plan and in every result.
    pub id: String,
    /// What is measured.
    pub measure: Measure,
    /// Nominal length, mm; 0 for forms and positions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal_mm: Option<f64>,
    /// Nominal angle, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal_deg: Option<f64>,
    /// Smallest permitted deviation from nominal, in the unit of the value; no limit below if null.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// Largest permitted deviation from nominal; no limit above if null.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<f64>,
    /// Copied to the result unchanged.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub attributes: BTreeMap<String, serde_json::Value>,
}

/// An axis of the datum frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

impl Axis {
    /// Its index among the coordinates.
    pub fn idx(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }
}

/// A CAD model, named by its content, so that a plan always means the same surface.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelRef {
    /// Name of its file: STL, GLB or PLY.
    pub name: String,
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub sha256: String,
}

/// What is measured; `of`, `from` and similar fields name features.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Measure {
    /// Two planes: mean of the two distances from the centre of one to the other. Plane and point: signed, along the
    /// plane's normal. Lines and points: the shortest distance.
    Distance {
        /// The first feature.
        from: String,
        /// The second.
        to: String,
        /// If given, the signed distance along this axis of the datum frame.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        along: Option<Axis>,
    },
    /// Height of the centre of one plane above another, negative for a pocket.
    Step {
        /// The plane measured from.
        base: String,
        /// The plane measured.
        top: String,
    },
    /// Angle between normals of planes and directions of lines, degrees.
    Angle {
        /// The first feature.
        from: String,
        /// The second.
        to: String,
        /// If given, the signed rotation about this axis of the datum frame.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        about: Option<Axis>,
    },
    /// Diameter of a sphere, cylinder or circle.
    Diameter {
        /// The feature.
        of: String,
    },
    /// Radius of a sphere, cylinder or circle.
    Radius {
        /// The feature.
        of: String,
    },
    /// A coordinate of a point or centre in the datum frame.
    Coordinate {
        /// The feature.
        of: String,
        /// Which coordinate.
        axis: Axis,
    },
    /// Twice the distance of a point or centre from its nominal position in the datum frame.
    Position {
        /// The feature.
        of: String,
        /// Nominal position, mm; null along axes without tolerance.
        at_mm: [Option<f64>; 3],
    },
    /// Range of a plane's points along the normal of another plane.
    Parallelism {
        /// The toleranced plane.
        of: String,
        /// The datum.
        to: String,
    },
    /// Range of a plane's points along the best-fitting direction perpendicular to the datum's normal.
    Perpendicularity {
        /// The toleranced plane.
        of: String,
        /// The datum.
        to: String,
    },
    /// Range of a plane's points about their least-squares plane.
    Flatness {
        /// The plane.
        of: String,
    },
    /// Twice the largest distance of a section's points from its nominal contour.
    Profile {
        /// The section.
        of: String,
    },
    /// Twice the largest deviation of the covered surface from that of a CAD model: the width of the zone about the nominal
    /// surface that contains it (ISO 1101, profile of any surface). Deviations are means over cells of the
    /// surface with about 12 points or more.
    SurfaceProfile {
        /// The model, in the datum frame.
        model: ModelRef,
        /// Aligned by best fit of all points: from the datums, or from `start` in a plan without an alignment. What a best
        /// fit absorbs does not appear in the deviations.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        best_fit: bool,
        /// Approximate pose of the model in the scan: x, y, z (mm), rotations about x, y, z (degrees).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        start: Option<[f64; 6]>,
        /// Part of the surface that is toleranced, in the frame of the model; all of it if absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        region: Option<Region>,
        /// Points further from the surface do not belong to it, mm; 2 % of the model's diagonal if absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        reach_mm: Option<f64>,
    },
    /// Distance between two rims, along the reference surface and across the seam.
    Gap {
        /// The rim it is measured from: an edge, a line, or a cylinder (a rolled edge).
        from: String,
        /// The other rim.
        to: String,
        /// The reference plane.
        surface: String,
    },
    /// Height of one surface above another at its rim.
    Flush {
        /// The reference plane.
        reference: String,
        /// The plane measured.
        surface: String,
        /// Its rim at the seam (an edge, a line or a cylinder); the centre of its points if absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        at: Option<String>,
    },
    /// Depth of a groove: from its floor's centre to the line across its shoulders.
    GrooveDepth {
        /// The floor.
        floor: String,
        /// The planes on both sides.
        shoulders: [String; 2],
    },
    /// Width of a slot.
    Width {
        /// The slot.
        of: String,
    },
    /// Length of a slot over both ends.
    Length {
        /// The slot.
        of: String,
    },
}

impl Measure {
    /// Its name in documents and results.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Distance { .. } => "distance",
            Self::Step { .. } => "step",
            Self::Angle { .. } => "angle",
            Self::Diameter { .. } => "diameter",
            Self::Radius { .. } => "radius",
            Self::Coordinate { .. } => "coordinate",
            Self::Position { .. } => "position",
            Self::Parallelism { .. } => "parallelism",
            Self::Perpendicularity { .. } => "perpendicularity",
            Self::Flatness { .. } => "flatness",
            Self::Profile { .. } => "profile",
            Self::SurfaceProfile { .. } => "surface_profile",
            Self::Gap { .. } => "gap",
            Self::Flush { .. } => "flush",
            Self::GrooveDepth { .. } => "groove_depth",
            Self::Width { .. } => "width",
            Self::Length { .. } => "length",
        }
    }

    /// The unit of its value.
    pub fn unit(&self) -> Unit {
        if matches!(self, Self::Angle { .. }) { Unit::Degree } else { Unit::Mm }
    }

    /// The features it refers to.
    pub fn features(&self) -> Vec<&str> {
        match self {
            Self::Distance { from, to, .. } | Self::Angle { from, to, .. } => vec![from, to],
            Self::Step { base, top } => vec![base, top],
            Self::Diameter { of }
            | Self::Radius { of }
            | Self::Coordinate { of, .. }
            | Self::Position { of, .. }
            | Self::Flatness { of }
            | Self::Profile { of }
            | Self::Width { of }
            | Self::Length { of } => vec![of],
            Self::Parallelism { of, to } | Self::Perpendicularity { of, to } => vec![of, to],
            Self::Gap { from, to, surface } => vec![from, to, surface],
            Self::Flush { reference, surface, at } => {
                [reference, surface].into_iter().chain(at).map(|id| &**id).collect()
            }
            Self::SurfaceProfile { .. } => Vec::new(),
            Self::GrooveDepth { floor, shoulders } => vec![floor, &shoulders[0], &shoulders[1]],
        }
    }

    /// Whether its value depends on the datum frame.
    pub fn needs_datum_frame(&self) -> bool {
        matches!(
            self,
            Self::Distance { along: Some(_), .. }
                | Self::Angle { about: Some(_), .. }
                | Self::Coordinate { .. }
                | Self::Position { .. }
                | Self::Profile { .. }
        )
    }

    /// Whether its value is a length that may extend along the travel of the stage.
    pub fn may_span_travel(&self) -> bool {
        matches!(
            self,
            Self::Distance { .. }
                | Self::Coordinate { .. }
                | Self::Position { .. }
                | Self::Gap { .. }
                | Self::Length { .. }
                | Self::SurfaceProfile { .. }
        )
    }

    /// Whether its value is an unsigned deviation from nominal: nominal 0, only an upper limit.
    pub fn is_deviation(&self) -> bool {
        matches!(
            self,
            Self::Position { .. }
                | Self::Parallelism { .. }
                | Self::Perpendicularity { .. }
                | Self::Flatness { .. }
                | Self::Profile { .. }
                | Self::SurfaceProfile { .. }
        )
    }
}
