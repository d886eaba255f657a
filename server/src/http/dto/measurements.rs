//! Measurements on the wire.

use metrology::{MeasureRequest, Region, Tool, Verdict};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use store::MeasurementRecord;
use utoipa::{IntoParams, ToSchema};

use crate::measurements::INVALID;
use crate::problem::{Problem, ProblemKind};

/// What to measure.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ToolDto {
    /// Distance of the dominant plane from the camera.
    Plane,
    /// Radius of a sphere.
    Sphere,
    /// Radius of a cylinder.
    Cylinder,
    /// Height of a face over the one that surrounds it; below zero for a pocket.
    Step,
    /// Distance between two parallel faces or two spheres.
    Distance,
    /// Angle between the two largest planes, degrees.
    Angle,
    /// Flatness of the dominant plane.
    Flatness,
}

/// What came of a measurement with a tolerance.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerdictDto {
    /// Within the tolerance beyond doubt.
    Pass,
    /// Outside of it beyond doubt.
    Fail,
    /// Neither could be proved.
    Undecided,
    /// Frames of the scan were lost.
    Invalid,
}

impl VerdictDto {
    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => Verdict::Pass.name(),
            Self::Fail => Verdict::Fail.name(),
            Self::Undecided => Verdict::Undecided.name(),
            Self::Invalid => INVALID,
        }
    }
}

/// Which measurements.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct MeasurementsQuery {
    /// Only those by this tool.
    pub tool: Option<ToolDto>,
    /// Only those with this verdict.
    pub verdict: Option<VerdictDto>,
    /// Id of the last measurement of the page before.
    pub before: Option<String>,
    /// Measurements of a page, 1 to 200; 50 if not said.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

/// What to measure, and what it should be.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "tool": "sphere", "nominal_mm": 18.9 }))]
pub struct MeasureDto {
    /// What to measure.
    pub tool: ToolDto,
    /// Nominal value (mm; degrees for an angle).
    pub nominal_mm: Option<f64>,
    /// Symmetric tolerance around the nominal; asks for a verdict by ISO 14253-1.
    #[schema(exclusive_minimum = 0.0)]
    pub tolerance_mm: Option<f64>,
    /// Look only inside this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[schema(min_items = 6, max_items = 6)]
    pub region_mm: Option<[f64; 6]>,
    /// Seed of the search; 1 if not said.
    pub seed: Option<u64>,
}

/// A measurement.
#[derive(Debug, Serialize, ToSchema)]
pub struct MeasurementDto {
    /// Its id.
    pub id: String,
    /// The scan.
    pub scan_id: String,
    /// What was asked.
    pub request: Value,
    /// Value, uncertainty (k = 2), verdict, tables by order.
    pub result: Value,
    /// When, wall clock, ms since 1970.
    pub created_at_ms: i64,
}

impl From<MeasurementRecord> for MeasurementDto {
    fn from(record: MeasurementRecord) -> Self {
        let MeasurementRecord { id, scan_id, request, result, created_at_ms } = record;
        Self { id, scan_id, request, result, created_at_ms }
    }
}

impl From<ToolDto> for Tool {
    fn from(dto: ToolDto) -> Self {
        match dto {
            ToolDto::Plane => Self::Plane,
            ToolDto::Sphere => Self::Sphere,
            ToolDto::Cylinder => Self::Cylinder,
            ToolDto::Step => Self::Step,
            ToolDto::Distance => Self::Distance,
            ToolDto::Angle => Self::Angle,
            ToolDto::Flatness => Self::Flatness,
        }
    }
}

impl TryFrom<MeasureDto> for MeasureRequest {
    type Error = Problem;

    fn try_from(dto: MeasureDto) -> Result<Self, Problem> {
        if dto.tolerance_mm.is_some() && dto.nominal_mm.is_none() && !matches!(dto.tool, ToolDto::Flatness) {
            return Err(Problem::new(ProblemKind::Impossible, "a tolerance needs a nominal")
                .at("/tolerance_mm")
                .remedy("give nominal_mm too"));
        }
        let region = dto.region_mm.map(|[x, y, z, other_x, other_y, other_z]| {
            let pairs = [(x, other_x), (y, other_y), (z, other_z)];
            Region { min_mm: pairs.map(|(a, b)| a.min(b)), max_mm: pairs.map(|(a, b)| a.max(b)) }
        });
        Ok(Self {
            nominal_mm: dto.nominal_mm,
            tolerance_mm: dto.tolerance_mm,
            seed: dto.seed.unwrap_or(1),
            region,
            ..Self::new(dto.tool.into())
        })
    }
}
