//! Acceptance tests on the wire.

use std::borrow::Cow;

use app::studies::StudyPosition;
use metrology::acceptance::{
    AcceptancePlan, AcceptanceResult, Dispersion, Figures, Linearity, MissingPositions, PositionError, Procedure,
    Quantity, QuantityResult, Repeatability,
};
use serde::{Deserialize, Serialize};
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use crate::wire::measurement::measurements::VerdictDto;
use crate::wire::recipe::plan_document::{parts_of, root_of};

/// The artefacts of an acceptance test with their calibrated values and limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AcceptancePlanDto(pub AcceptancePlan);

/// Schema name of the document in the API, and prefix of the names of its parts.
const NAME: &str = "AcceptancePlan";

impl PartialSchema for AcceptancePlanDto {
    fn schema() -> RefOr<Schema> {
        root_of(NAME, AcceptancePlan::schema())
    }
}

impl ToSchema for AcceptancePlanDto {
    fn name() -> Cow<'static, str> {
        NAME.into()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.extend(parts_of(NAME, AcceptancePlan::schema()));
    }
}

/// A procedure of an acceptance test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProcedureDto {
    /// A ball at many positions.
    Sphere,
    /// Two balls at a calibrated distance.
    SpherePair,
    /// A flat plate at many positions.
    Plate,
    /// A plate at known heights.
    Linearity,
    /// A plate that is scanned repeatedly without being moved.
    Repeatability,
}

impl From<ProcedureDto> for Procedure {
    fn from(dto: ProcedureDto) -> Self {
        match dto {
            ProcedureDto::Sphere => Self::Sphere,
            ProcedureDto::SpherePair => Self::SpherePair,
            ProcedureDto::Plate => Self::Plate,
            ProcedureDto::Linearity => Self::Linearity,
            ProcedureDto::Repeatability => Self::Repeatability,
        }
    }
}

impl From<Procedure> for ProcedureDto {
    fn from(procedure: Procedure) -> Self {
        match procedure {
            Procedure::Sphere => Self::Sphere,
            Procedure::SpherePair => Self::SpherePair,
            Procedure::Plate => Self::Plate,
            Procedure::Linearity => Self::Linearity,
            Procedure::Repeatability => Self::Repeatability,
        }
    }
}

/// A quantity of an acceptance test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum QuantityCodeDto {
    /// Probing error of form PF: range of all points but 3 ‰.
    ProbingForm,
    /// Probing dispersion: narrowest band with 95 % of the points.
    ProbingFormD95,
    /// Probing error of size PS.
    ProbingSize,
    /// Sphere spacing error SD.
    SphereSpacing,
    /// Flatness error F: range of all points but 3 ‰.
    Flatness,
    /// Flatness: narrowest band with 95 % of the points.
    FlatnessD95,
    /// Deviation of a height from the least-squares line.
    Linearity,
    /// Standard deviation of a single point from scan to scan.
    RepeatabilitySingle,
    /// Standard deviation of the mean height of the plate.
    RepeatabilityAveraged,
}

impl From<Quantity> for QuantityCodeDto {
    fn from(quantity: Quantity) -> Self {
        match quantity {
            Quantity::ProbingForm => Self::ProbingForm,
            Quantity::ProbingFormD95 => Self::ProbingFormD95,
            Quantity::ProbingSize => Self::ProbingSize,
            Quantity::SphereSpacing => Self::SphereSpacing,
            Quantity::Flatness => Self::Flatness,
            Quantity::FlatnessD95 => Self::FlatnessD95,
            Quantity::Linearity => Self::Linearity,
            Quantity::RepeatabilitySingle => Self::RepeatabilitySingle,
            Quantity::RepeatabilityAveraged => Self::RepeatabilityAveraged,
        }
    }
}

/// A position of an artefact.
#[derive(Debug, Serialize, ToSchema)]
pub struct PositionDto {
    /// The procedure that it belongs to.
    pub procedure: ProcedureDto,
    /// The scan.
    pub scan_id: String,
    /// Its name.
    pub scan_name: String,
    /// The calibration of its cloud.
    pub calibration_id: String,
    /// Whether the devices were simulated.
    pub simulated: bool,
    /// Who added it.
    pub added_by: String,
    /// When, ms since 1970 (UTC).
    pub added_at_ms: i64,
    /// Temperature of the artefact, °C.
    pub temperature_c: Option<f64>,
    /// Linearity: the height at which the plate was placed, mm.
    pub reference_mm: Option<f64>,
    /// The artefact, or each of two balls.
    pub features: Vec<ArtefactFeatureDto>,
}

/// A ball or a plate as found in a scan.
#[derive(Debug, Serialize, ToSchema)]
pub struct ArtefactFeatureDto {
    /// Centre of the ball, or centroid of the plate, part frame, mm.
    pub place_mm: [f64; 3],
    /// Diameter of the ball, mm.
    pub diameter_mm: Option<f64>,
    /// Points inside the evaluated region.
    pub n_points: usize,
    /// Points left out of the fit, at most 3 ‰.
    pub n_rejected: usize,
    /// Points on the artefact outside the evaluated region: near its border, or viewed or lit too steeply.
    pub n_excluded: usize,
    /// Largest minus smallest distance from the least-squares feature, mm.
    pub range_mm: f64,
    /// Width of the narrowest band with 95 % of the points, mm.
    pub d95_mm: f64,
}

fn feature(
    place_mm: [f64; 3],
    diameter_mm: Option<f64>,
    dispersion: Dispersion,
    n_excluded: usize,
) -> ArtefactFeatureDto {
    let Dispersion { n_points, n_rejected, range_mm, d95_mm } = dispersion;
    ArtefactFeatureDto { place_mm, diameter_mm, n_points, n_rejected, n_excluded, range_mm, d95_mm }
}

impl From<StudyPosition> for PositionDto {
    fn from(stored: StudyPosition) -> Self {
        let balls = |balls: &[metrology::acceptance::Ball]| {
            balls
                .iter()
                .map(|ball| feature(ball.centre_mm, Some(ball.diameter_mm), ball.dispersion, ball.n_excluded))
                .collect()
        };
        let features = match &stored.position.figures {
            Figures::Ball(ball) => balls(std::slice::from_ref(ball)),
            Figures::Pair { balls: pair, .. } => balls(pair),
            Figures::Plate(plate) => vec![feature(plate.point_mm, None, plate.dispersion, plate.n_excluded)],
        };
        Self {
            procedure: stored.position.procedure.into(),
            scan_id: stored.scan_id,
            scan_name: stored.scan_name,
            calibration_id: stored.calibration_id,
            simulated: stored.simulated,
            added_by: stored.added_by,
            added_at_ms: stored.added_at_ms,
            temperature_c: stored.position.temperature_c,
            reference_mm: stored.position.reference_mm,
            features,
        }
    }
}

/// Positions that are still missing.
#[derive(Debug, Serialize, ToSchema)]
pub struct MissingPositionsDto {
    /// Of which procedure.
    pub procedure: ProcedureDto,
    /// Positions present.
    pub n_present: usize,
    /// Positions needed.
    pub n_needed: usize,
}

impl From<MissingPositions> for MissingPositionsDto {
    fn from(missing: MissingPositions) -> Self {
        let MissingPositions { procedure, n_present, n_needed } = missing;
        Self { procedure: procedure.into(), n_present, n_needed }
    }
}

/// The error of one position.
#[derive(Debug, Serialize, ToSchema)]
pub struct PositionErrorDto {
    /// Index of the position in `positions`.
    pub position_idx: usize,
    /// The error, mm.
    pub error_mm: f64,
    /// Expanded uncertainty of the test (k = 2), mm; absent if the temperature of a length is unknown.
    pub test_uncertainty_mm: Option<f64>,
}

impl From<PositionError> for PositionErrorDto {
    fn from(error: PositionError) -> Self {
        let PositionError { position_idx, error_mm, test_uncertainty_mm } = error;
        Self { position_idx, error_mm, test_uncertainty_mm }
    }
}

/// A quantity with its limit and verdict.
#[derive(Debug, Serialize, ToSchema)]
pub struct QuantityDto {
    /// Which.
    pub quantity: QuantityCodeDto,
    /// The largest permissible error, mm.
    pub mpe_mm: Option<f64>,
    /// The error of largest magnitude, mm.
    pub worst_mm: Option<f64>,
    /// The errors of its positions; a single one for a standard deviation.
    pub errors: Vec<PositionErrorDto>,
    /// The worst verdict of its positions; absent without a limit, or before all positions are present.
    pub verdict: Option<VerdictDto>,
}

impl From<QuantityResult> for QuantityDto {
    fn from(result: QuantityResult) -> Self {
        Self {
            quantity: result.quantity.into(),
            mpe_mm: result.mpe_mm,
            worst_mm: result.worst_mm,
            errors: result.errors.into_iter().map(PositionErrorDto::from).collect(),
            verdict: result.verdict.map(VerdictDto::from),
        }
    }
}

/// Linearity along z, from three different heights on.
#[derive(Debug, Serialize, ToSchema)]
pub struct LinearityDto {
    /// Slope of the least-squares line through measured over reference heights.
    pub slope: f64,
    /// Heights covered, mm: the full scale.
    pub range_mm: f64,
    /// Deviation of largest magnitude from the line, mm.
    pub largest_mm: f64,
    /// Its magnitude in per cent of the full scale.
    pub percent_of_range: f64,
    /// Largest minus smallest deviation, mm.
    pub peak_to_peak_mm: f64,
    /// Fewest points averaged for a height.
    pub n_averaged: usize,
}

/// Repeatability along z, from two scans on: standard deviations, 1 σ.
#[derive(Debug, Serialize, ToSchema)]
pub struct RepeatabilityDto {
    /// Scans.
    pub n_scans: usize,
    /// Of a single point, mm.
    pub single_mm: f64,
    /// Of the mean height of the plate, mm.
    pub averaged_mm: f64,
    /// Fewest points averaged.
    pub n_averaged: usize,
}

/// The figures of an acceptance test.
#[derive(Debug, Serialize, ToSchema)]
pub struct AcceptanceFiguresDto {
    /// The quantities of the planned procedures.
    pub quantities: Vec<QuantityDto>,
    /// Linearity along z.
    pub linearity: Option<LinearityDto>,
    /// Repeatability along z.
    pub repeatability: Option<RepeatabilityDto>,
}

impl From<AcceptanceResult> for AcceptanceFiguresDto {
    fn from(result: AcceptanceResult) -> Self {
        let linearity = |found: Linearity| LinearityDto {
            slope: found.slope,
            range_mm: found.range_mm,
            largest_mm: found.largest_mm,
            percent_of_range: found.percent_of_range,
            peak_to_peak_mm: found.peak_to_peak_mm,
            n_averaged: found.n_averaged,
        };
        let repeatability = |found: Repeatability| {
            let Repeatability { n_scans, single_mm, averaged_mm, n_averaged } = found;
            RepeatabilityDto { n_scans, single_mm, averaged_mm, n_averaged }
        };
        Self {
            quantities: result.quantities.into_iter().map(QuantityDto::from).collect(),
            linearity: result.linearity.map(linearity),
            repeatability: result.repeatability.map(repeatability),
        }
    }
}
