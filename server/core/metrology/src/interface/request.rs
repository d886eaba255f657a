//! Measurement requests, and why one may be impossible.

use std::borrow::Cow;

use remedy::Remedy;

use crate::interface::region::Region;

/// What to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Tool {
    /// The dominant plane; value: its mean distance from the camera over its points.
    Plane,
    /// The sphere on the table; value: its radius.
    Sphere,
    /// The cylinder on the table; value: its radius.
    Cylinder,
    /// The two largest parallel planes; value: the height of the smaller one above the one with the larger area, at its
    /// own centroid, negative for a pocket.
    Step,
    /// Two parallel planes (mean of the two centroid-to-plane distances), or two spheres (between the centres) if they
    /// have more than twice the points of the second plane.
    Distance,
    /// The two largest planes; value: the angle between their normals towards the camera, or its supplement if that is
    /// closer to the nominal value (degrees).
    Angle,
    /// The dominant plane; value: the width of the band about the least-squares plane that contains 99.9 % of its
    /// points, corrected for noise. Nominal 0.
    Flatness,
}

impl Tool {
    /// All tools.
    pub const ALL: [Self; 7] =
        [Self::Plane, Self::Sphere, Self::Cylinder, Self::Step, Self::Distance, Self::Angle, Self::Flatness];

    /// Its name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
            Self::Step => "step",
            Self::Distance => "distance",
            Self::Angle => "angle",
            Self::Flatness => "flatness",
        }
    }

    /// The tool with that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|tool| tool.name() == name)
    }
}

impl std::fmt::Display for Tool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// A measurement request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasureRequest {
    /// What to measure.
    pub tool: Tool,
    /// The nominal value, mm (degrees for `angle`). Also used to select the feature; it does not bias the value.
    pub nominal_mm: Option<f64>,
    /// Largest permitted deviation from nominal, mm (degrees for `angle`); requests a verdict.
    pub tolerance_mm: Option<f64>,
    /// Seed of the random choices of the search; the same seed gives the same result.
    pub seed: u64,
    /// Region to search; the whole cloud if `None`.
    pub region: Option<Region>,
}

impl MeasureRequest {
    /// A request for `tool` with default settings.
    pub fn new(tool: Tool) -> Self {
        Self { tool, nominal_mm: None, tolerance_mm: None, seed: 1, region: None }
    }
}

/// Why a measurement could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeasureError {
    /// Too few points.
    #[error("{got} points to measure, at least {needed} are needed")]
    TooFewPoints {
        /// Points needed.
        needed: usize,
        /// Points available.
        got: usize,
    },
    /// The cloud shows no such feature.
    #[error("no {feature} found among {n_points} points")]
    FeatureNotFound {
        /// The feature searched for.
        feature: &'static str,
        /// Points searched.
        n_points: usize,
    },
    /// Too few lines cross the rim of a plane.
    #[error("{got} lines cross the rim of the {feature} where at least {needed} are needed")]
    TooFewCrossings {
        /// What the rim belongs to.
        feature: &'static str,
        /// Crossings needed.
        needed: usize,
        /// Crossings available.
        got: usize,
    },
    /// An arc of a round rim has no crossings.
    #[error("no line crosses the rim of the {feature} over {gap_deg:.0}°")]
    OpenRim {
        /// What the rim belongs to.
        feature: &'static str,
        /// The arc without crossings, degrees.
        gap_deg: f64,
    },
    /// The datums do not constrain a degree of freedom.
    #[error("the datums do not constrain {freedom}")]
    UnderconstrainedDatums {
        /// The unconstrained degree of freedom.
        freedom: &'static str,
    },
    /// The features do not determine the value.
    #[error("the {what} is not determined by its features")]
    NotDetermined {
        /// What is not determined.
        what: &'static str,
    },
    /// A feature that this one depends on is missing.
    #[error("\"{id}\" is missing: {reason}")]
    Missing {
        /// The feature.
        id: String,
        /// Why it is missing.
        reason: String,
    },
    /// The points do not determine the radius.
    #[error("the radius is not determined: {radius_mm:.3} mm with a standard uncertainty of {u_mm:.3} mm")]
    RadiusUndetermined {
        /// The fitted radius.
        radius_mm: f64,
        /// Its standard uncertainty.
        u_mm: f64,
    },
    /// The cloud and a nominal surface do not overlap.
    #[error("{n_points} points lie within {reach_mm:.2} mm of the surface")]
    NoOverlap {
        /// Points within reach.
        n_points: usize,
        /// The reach.
        reach_mm: f64,
    },
    /// The best fit with a nominal surface did not converge.
    #[error("the best fit did not converge")]
    NotConverged,
    /// The model of a nominal surface is not available.
    #[error("the model {name} is missing")]
    ModelMissing {
        /// Its name in the plan.
        name: String,
    },
    /// The calibration does not reproduce the cloud.
    #[error(
        "the calibration does not belong to this cloud: its pixels triangulate {median_mm:.3} mm (median) away from its points"
    )]
    CalibrationMismatch {
        /// Median distance between the points and their re-triangulated pixels.
        median_mm: f64,
    },
    /// An invalid number in the request.
    #[error("{name} cannot be {value}")]
    BadNumber {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Further condition on it.
        condition: &'static str,
    },
}

impl Remedy for MeasureError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::TooFewPoints { .. } => "check the region and the cloud".into(),
            Self::FeatureNotFound { .. } => "check the tool, or give a region around the feature".into(),
            Self::TooFewCrossings { .. } => {
                "give a region with the whole rim and a strip of its plane; lines must cross it, not run along it"
                    .into()
            }
            Self::OpenRim { .. } => "scan the whole rim, or give a larger region".into(),
            Self::UnderconstrainedDatums { .. } => {
                "choose datums that constrain all six degrees of freedom".into()
            }
            Self::NotDetermined { .. } => "choose other features".into(),
            Self::Missing { .. } => "correct that feature first".into(),
            Self::RadiusUndetermined { .. } => "scan more of the curve".into(),
            Self::NoOverlap { .. } => "give a start pose closer to the part, or align by datums".into(),
            Self::NotConverged => "align by datums, or give a start pose closer to the part".into(),
            Self::ModelMissing { .. } => "give the model again: its content is named by its SHA-256".into(),
            Self::CalibrationMismatch { .. } => "give the calibration the scan was made with".into(),
            Self::BadNumber { condition, .. } => format!("give a finite number{condition}").into(),
        })
    }
}
