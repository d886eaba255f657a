//! Measurements on the wire.

use metrology::{MeasureRequest, Region, Tool};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use store::MeasurementRecord;
use utoipa::ToSchema;

use crate::problem::{Problem, ProblemKind};

/// What to measure.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ToolDto {
    /// Distance of the dominant plane from the origin of the part frame.
    Plane,
    /// Radius of a sphere.
    Sphere,
    /// Radius of a cylinder.
    Cylinder,
    /// Height of a face over the dominant plane.
    Step,
    /// Distance between two parallel faces or two spheres.
    Distance,
    /// Angle between the two largest planes, degrees.
    Angle,
    /// Flatness of the dominant plane.
    Flatness,
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
        if dto.tolerance_mm.is_some() && dto.nominal_mm.is_none() {
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
