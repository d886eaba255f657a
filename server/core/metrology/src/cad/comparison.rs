//! What a comparison is asked, and what it says.

use std::borrow::Cow;

use optics::{PartFrame, Rigid};
use remedy::Remedy;

use crate::cad::statistics::{DeviationStatistics, WorstPlace};
use crate::evaluation::alignment::DatumFrame;
use crate::interface::doubts::Missing;
use crate::interface::part_verdict::PartVerdict;
use crate::interface::region::Region;
use crate::interface::request::MeasureError;
use crate::plan::document::Plan;

/// How a scan is brought to the frame of its nominal surface.
#[derive(Debug, Clone, PartialEq)]
pub enum AlignTo {
    /// By all of its points, from a pose that is near.
    Surface {
        /// The first pose.
        start: Rigid<DatumFrame, PartFrame>,
    },
    /// By the datums of a plan, in whose frame the surface is drawn.
    Datums(Box<Plan>),
    /// By the datums, then by all points.
    DatumsThenSurface(Box<Plan>),
}

/// How a cloud is compared.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareRequest {
    /// The alignment.
    pub align: AlignTo,
    /// Largest permitted deviation to either side, mm; asks for a verdict.
    pub tolerance_mm: Option<f64>,
    /// Points further from the surface do not belong to it, mm; 2 % of its diagonal if absent.
    pub reach_mm: Option<f64>,
    /// How far a best fit may start from the surface, mm; 6 % of its diagonal if absent.
    pub capture_mm: Option<f64>,
    /// Points outside (part frame) are not looked at.
    pub region: Option<Region>,
}

/// What a comparison says.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The pose.
    pub datum_from_part: Rigid<DatumFrame, PartFrame>,
    /// Freedoms that a best fit could not hold and left as they were, in words.
    pub locked: Vec<String>,
    /// RMS of the points of a best fit, mm.
    pub fit_rms_mm: Option<f64>,
    /// Deviations by area.
    pub statistics: DeviationStatistics,
    /// The places that are furthest off, worst first.
    pub worst: Vec<WorstPlace>,
    /// Signed distance of every point of the cloud, mm: positive outside; NaN where there is nothing to compare with.
    pub deviations_mm: Vec<f32>,
    /// Its standard uncertainty, mm.
    pub u_mm: Vec<f32>,
    /// The tolerance asked for.
    pub tolerance_mm: Option<f64>,
    /// What the uncertainty should hold and does not.
    pub missing: Vec<Missing>,
    /// The verdict on the covered surface, if there is a tolerance.
    pub verdict: Option<PartVerdict>,
    /// What a reader must know, in sentences.
    pub notes: Vec<String>,
}

/// A comparison could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// The scan is somewhere else.
    #[error("{n_points} points lie within {reach_mm:.2} mm of the surface")]
    NoOverlap {
        /// Points within reach.
        n_points: usize,
        /// The reach.
        reach_mm: f64,
    },
    /// The fit wandered.
    #[error("the best fit did not come to rest")]
    NotConverged,
    /// The datums or the cloud.
    #[error(transparent)]
    Measure(#[from] MeasureError),
}

impl Remedy for CompareError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::NoOverlap { .. } => Some("give a start pose nearer to the part, or align by datums".into()),
            Self::NotConverged => Some("align by datums, or give a start pose nearer to the part".into()),
            Self::Measure(error) => error.remedy(),
        }
    }
}
