//! Measurements on the wire.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use store::MeasurementRecord;
use utoipa::ToSchema;

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
