//! Measurements on the wire.

use metrology::{PartVerdict, Tool};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use store::{DamagedRow, MeasurementRecord};
use utoipa::{IntoParams, ToSchema};

use crate::wire::measurement::measurement_results::{FeatureDto, MeasurementRequestDto, MeasurementResultDto};
use crate::wire::parse_stored;
use app::measurements::MeasureInput;
use app::measurements::parts::verdict_in;

/// Measurement tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ToolDto {
    /// Distance of the dominant plane from the camera.
    Plane,
    /// Radius of a sphere.
    Sphere,
    /// Radius of a cylinder.
    Cylinder,
    /// Height of a face above the surrounding face; negative for a pocket.
    Step,
    /// Distance between two parallel faces or two spheres.
    Distance,
    /// Angle between the two largest planes, degrees.
    Angle,
    /// Flatness of the dominant plane.
    Flatness,
}

/// Verdict on a characteristic or a part; of several the worst counts: `ok` < `undecided` < `invalid` < `not_ok`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum VerdictDto {
    /// Within the limits, considering the uncertainty.
    Ok,
    /// Too close to a limit to decide.
    Undecided,
    /// Not measurable, or frames of the scan were lost: treat the part as a reject.
    Invalid,
    /// Outside the limits, considering the uncertainty.
    NotOk,
}

impl VerdictDto {
    /// Its code.
    pub fn code(self) -> &'static str {
        PartVerdict::from(self).name()
    }
}

impl From<VerdictDto> for PartVerdict {
    fn from(dto: VerdictDto) -> Self {
        match dto {
            VerdictDto::Ok => Self::Ok,
            VerdictDto::Undecided => Self::Undecided,
            VerdictDto::Invalid => Self::Invalid,
            VerdictDto::NotOk => Self::NotOk,
        }
    }
}

impl From<PartVerdict> for VerdictDto {
    fn from(verdict: PartVerdict) -> Self {
        match verdict {
            PartVerdict::Ok => Self::Ok,
            PartVerdict::Undecided => Self::Undecided,
            PartVerdict::Invalid => Self::Invalid,
            PartVerdict::NotOk => Self::NotOk,
        }
    }
}

/// Selects measurements.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct MeasurementsQuery {
    /// Only measurements with this tool.
    pub tool: Option<ToolDto>,
    /// Only measurements with this verdict.
    pub verdict: Option<VerdictDto>,
    /// Id of the last measurement of the previous page.
    pub before: Option<String>,
    /// Measurements per page, 1 to 200; default 50.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

/// A measurement to make, with nominal value and tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "tool": "sphere", "nominal_mm": 18.9 }))]
pub struct MeasureDto {
    /// Measurement tool.
    pub tool: ToolDto,
    /// Name of the characteristic; distinguishes several uses of one tool, each with its own verdict.
    #[schema(max_length = 100)]
    pub name: Option<String>,
    /// Nominal value (mm; degrees for an angle); flatness is compared with zero by default.
    pub nominal_mm: Option<f64>,
    /// Symmetric tolerance around the nominal; required for a verdict according to ISO 14253-1.
    #[schema(exclusive_minimum = 0.0)]
    pub tolerance_mm: Option<f64>,
    /// Only use points in this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[schema(min_items = 6, max_items = 6)]
    pub region_mm: Option<[f64; 6]>,
    /// Random seed of the search; default 1.
    pub seed: Option<u64>,
}

/// Request to find the features that a tool measures.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "tool": "step", "region_mm": [-10, -10, 380, 10, 10, 410] }))]
pub struct FindFeaturesDto {
    /// Measurement tool.
    pub tool: ToolDto,
    /// Only use points in this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[schema(min_items = 6, max_items = 6)]
    pub region_mm: Option<[f64; 6]>,
    /// Random seed of the search; default 1.
    pub seed: Option<u64>,
}

impl From<FindFeaturesDto> for MeasureInput {
    fn from(dto: FindFeaturesDto) -> Self {
        let FindFeaturesDto { tool, region_mm, seed } = dto;
        MeasureDto { tool, name: None, nominal_mm: None, tolerance_mm: None, region_mm, seed }.into()
    }
}

/// Features found by a tool, in the part frame.
#[derive(Debug, Serialize, ToSchema)]
pub struct FeaturesFoundDto {
    /// The features, in the order in which the tool uses them.
    pub features: Vec<FeatureDto>,
}

impl TryFrom<(String, Value)> for FeaturesFoundDto {
    type Error = DamagedRow;

    /// From the scan's id and the features as they are stored with a measurement.
    fn try_from((scan_id, features): (String, Value)) -> Result<Self, DamagedRow> {
        Ok(Self { features: parse_stored("features", &scan_id, features)? })
    }
}

/// A measurement.
#[derive(Debug, Serialize, ToSchema)]
pub struct MeasurementDto {
    /// Its id.
    pub id: String,
    /// The scan.
    pub scan_id: String,
    /// The request.
    pub request: MeasurementRequestDto,
    /// Value, expanded uncertainty (k = 2), verdict, results per order.
    pub result: MeasurementResultDto,
    /// Time of the measurement, ms since 1970 (UTC).
    pub created_at_ms: i64,
}

impl TryFrom<MeasurementRecord> for MeasurementDto {
    type Error = DamagedRow;

    fn try_from(record: MeasurementRecord) -> Result<Self, DamagedRow> {
        let verdict = verdict_in(&record);
        let MeasurementRecord { id, scan_id, request, mut result, created_at_ms } = record;
        // Records of earlier versions have other codes.
        result["verdict"] = json!(verdict.map(PartVerdict::name));
        let request = parse_stored("measurement", &id, request)?;
        let result = parse_stored("measurement", &id, result)?;
        Ok(Self { id, scan_id, request, result, created_at_ms })
    }
}

impl From<Tool> for ToolDto {
    fn from(tool: Tool) -> Self {
        match tool {
            Tool::Plane => Self::Plane,
            Tool::Sphere => Self::Sphere,
            Tool::Cylinder => Self::Cylinder,
            Tool::Step => Self::Step,
            Tool::Distance => Self::Distance,
            Tool::Angle => Self::Angle,
            Tool::Flatness => Self::Flatness,
        }
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

impl From<MeasureDto> for MeasureInput {
    fn from(dto: MeasureDto) -> Self {
        let MeasureDto { tool, name, nominal_mm, tolerance_mm, region_mm, seed } = dto;
        let tool = Tool::from(tool).name().to_owned();
        Self { tool, name, nominal_mm, tolerance_mm, region_mm, seed }
    }
}

/// The current measurement of a characteristic: the newest with a verdict, else the newest.
#[derive(Debug, Serialize, ToSchema)]
pub struct CharacteristicDto {
    /// Id of the measurement.
    pub measurement_id: String,
    /// The tool.
    pub tool: String,
    /// Name of the characteristic, if the same tool is used more than once.
    pub name: Option<String>,
    /// `mm` or `°`, unit of all values except `rmse_mm`.
    pub unit: String,
    /// The value; absent if it could not be measured.
    pub value: Option<f64>,
    /// Expanded uncertainty U (k = 2).
    pub expanded_uncertainty: Option<f64>,
    /// Nominal value.
    pub nominal: Option<f64>,
    /// Symmetric tolerance around the nominal.
    pub tolerance: Option<f64>,
    /// RMS distance of the points from the fitted feature, mm.
    pub rmse_mm: Option<f64>,
    /// The verdict; absent without a tolerance.
    pub verdict: Option<VerdictDto>,
    /// Time of the measurement, ms since 1970 (UTC).
    pub created_at_ms: i64,
}

impl From<&MeasurementRecord> for CharacteristicDto {
    fn from(record: &MeasurementRecord) -> Self {
        let (request, result) = (&record.request, &record.result);
        let text = |value: &Value| value.as_str().map(str::to_owned);
        Self {
            measurement_id: record.id.clone(),
            tool: text(&request["tool"]).unwrap_or_default(),
            name: text(&request["name"]),
            unit: text(&result["unit"]).unwrap_or_else(|| "mm".to_owned()),
            value: result["value"].as_f64(),
            expanded_uncertainty: result["expanded_uncertainty"].as_f64(),
            nominal: result["nominal"].as_f64(),
            tolerance: result["tolerance"].as_f64(),
            rmse_mm: result["errors"]["rmse_mm"].as_f64(),
            verdict: verdict_in(record).map(VerdictDto::from),
            created_at_ms: record.created_at_ms,
        }
    }
}
