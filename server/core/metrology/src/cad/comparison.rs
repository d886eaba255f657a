//! Request and result of a comparison with CAD data.

use nalgebra::{Rotation3, Vector3};
use optics::{PartFrame, Rigid};

use crate::cad::statistics::{DeviationStatistics, LargestDeviation, WorstDeviation};
use crate::evaluation::alignment::DatumFrame;
use crate::interface::findings::Missing;
use crate::interface::part_verdict::PartVerdict;
use crate::interface::region::Region;
use crate::plan::document::Plan;

/// How a scan is aligned with its nominal surface.
#[derive(Debug, Clone, PartialEq)]
pub enum AlignTo {
    /// By best fit of all points, from a nearby pose.
    Surface {
        /// The start pose.
        start: Rigid<DatumFrame, PartFrame>,
    },
    /// By the datums of a plan; the surface is given in their frame.
    Datums(Box<Plan>),
    /// By the datums, then by best fit of all points.
    DatumsThenSurface(Box<Plan>),
}

impl AlignTo {
    /// By best fit, from an approximate pose of the model in the scan: x, y, z (mm), then rotations about x, y, z (degrees),
    /// applied in this order.
    pub fn surface_near([x, y, z, rx, ry, rz]: [f64; 6]) -> Self {
        let turn = Rotation3::from_euler_angles(rx.to_radians(), ry.to_radians(), rz.to_radians());
        Self::Surface { start: Rigid::<PartFrame, DatumFrame>::new(turn, Vector3::new(x, y, z)).inverse() }
    }
}

/// How a cloud is compared.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareRequest {
    /// The alignment.
    pub align: AlignTo,
    /// Largest permitted deviation to either side, mm; requests a verdict.
    pub tolerance_mm: Option<f64>,
    /// Points further from the surface do not belong to it, mm; 2 % of its diagonal if absent.
    pub reach_mm: Option<f64>,
    /// How far a best fit may start from the surface, mm; 6 % of its diagonal if absent.
    pub capture_mm: Option<f64>,
    /// Points outside this region (part frame) are ignored.
    pub region: Option<Region>,
    /// Part of the surface (datum frame) that is compared; all of it if absent. A best fit uses the whole surface.
    pub surface_region: Option<Region>,
}

/// Result of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The pose.
    pub datum_from_part: Rigid<DatumFrame, PartFrame>,
    /// Description of each degree of freedom that the points did not constrain and a best fit left unchanged.
    pub locked: Vec<String>,
    /// RMS of the residuals of a best fit, mm.
    pub fit_rms_mm: Option<f64>,
    /// Statistics of the deviations, weighted by area.
    pub statistics: DeviationStatistics,
    /// The largest deviations, largest first.
    pub worst: Vec<WorstDeviation>,
    /// The largest deviation to either side; `None` if no cell of the surface has enough points.
    pub largest: Option<LargestDeviation>,
    /// Signed distance of every point of the cloud, mm: positive outside; NaN where there is no surface to compare with.
    pub deviations_mm: Vec<f32>,
    /// Its standard uncertainty, mm.
    pub u_mm: Vec<f32>,
    /// The tolerance asked for.
    pub tolerance_mm: Option<f64>,
    /// Missing uncertainty contributions; empty if the uncertainty is complete.
    pub missing: Vec<Missing>,
    /// The verdict on the covered surface, if there is a tolerance.
    pub verdict: Option<PartVerdict>,
    /// Remarks for the reader, in sentences.
    pub notes: Vec<String>,
}
