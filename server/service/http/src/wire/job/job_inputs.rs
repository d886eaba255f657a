//! Job inputs on the wire.

use std::collections::BTreeMap;

use metrology::Tool;
use optics::LightModelKind;
use serde::Serialize;
use serde_json::json;
use utoipa::ToSchema;

use crate::wire::calibration::calibrations::{CalibrationSourceDto, K3Dto, LightModelDto};
use crate::wire::measurement::measurements::MeasureDto;
use crate::wire::scan::scans::{ReferencePartDto, ScanSourceDto, StartExportDto};
use crate::wire::scan::settings::ScanJobDto;
use app::inspections::InspectedPart;
use app::jobs::{
    CalibrateInput, ExportInput, InspectInput, JobInput, ReEvaluateInput, RecomputeInput, ScanSource, Source,
    VerifyInput,
};
use app::measurements::MeasureInput;

/// Input of a job.
#[derive(Debug, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum JobInputDto {
    /// Calibrate camera, light and stage.
    Calibration(CalibrationJobDto),
    /// Scan a part.
    Scan(ScanJobDto),
    /// Recompute a scan from its peaks.
    Recomputation(RecomputationJobDto),
    /// Scan a reference part and compare.
    Verification(VerificationJobDto),
    /// Write a scan in another format.
    Export(ExportJobDto),
    /// Inspect a part.
    Inspection(InspectionJobDto),
    /// Re-evaluate the scan of an inspection with another version of a recipe or another calibration.
    ReEvaluation(ReEvaluationJobDto),
}

/// Inspect a part.
#[derive(Debug, Serialize, ToSchema)]
pub struct InspectionJobDto {
    /// The recipe.
    pub recipe_id: String,
    /// Its version, fixed when the job was accepted.
    pub recipe_version: i64,
    /// Serial number of the part.
    pub serial: String,
    /// The order it is made for.
    pub order: Option<String>,
    /// Passed on unchanged to other systems.
    pub attributes: BTreeMap<String, String>,
    /// Source of the frames.
    pub source: ScanSourceDto,
}

/// Re-evaluate the scan of an inspection with another version of a recipe or another calibration.
#[derive(Debug, Serialize, ToSchema)]
pub struct ReEvaluationJobDto {
    /// The inspection.
    pub inspection_id: String,
    /// The recipe.
    pub recipe_id: String,
    /// Its version.
    pub recipe_version: i64,
    /// The calibration; absent: that of the scan.
    pub calibration_id: Option<String>,
}

/// Calibrate camera, light and stage.
#[derive(Debug, Serialize, ToSchema)]
pub struct CalibrationJobDto {
    /// Source of the images.
    pub source: CalibrationSourceDto,
    /// Model of the light sheets; default `auto`.
    pub light_model: Option<LightModelDto>,
    /// Whether k3 is estimated; default `auto`.
    pub k3: Option<K3Dto>,
    /// Ignore images without a readable board or line.
    pub leave_out_unreadable: bool,
    /// Number of board poses to capture at the station.
    pub n_poses: Option<usize>,
    /// The session whose images are used.
    pub session_id: Option<String>,
}

/// Recompute a scan from its peaks.
#[derive(Debug, Serialize, ToSchema)]
pub struct RecomputationJobDto {
    /// The scan.
    pub scan_id: String,
    /// The calibration; default: the active one.
    pub calibration_id: Option<String>,
}

/// Scan a reference part and compare.
#[derive(Debug, Serialize, ToSchema)]
pub struct VerificationJobDto {
    /// Kind of the reference part.
    pub reference_part: ReferencePartDto,
    /// Nominal height or radius.
    pub nominal_mm: f64,
    /// Symmetric tolerance of the deviation.
    pub tolerance_mm: Option<f64>,
    /// The scan.
    pub scan: ScanJobDto,
}

/// Write a scan in another format.
#[derive(Debug, PartialEq, Eq, Serialize, ToSchema)]
pub struct ExportJobDto {
    /// The scan.
    pub scan_id: String,
    /// What is written, and its format.
    #[serde(flatten)]
    pub export: StartExportDto,
}

/// A code in a stored input that this version does not know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownCode(pub String);

fn known<T>(found: Option<T>, word: &str) -> Result<T, UnknownCode> {
    found.ok_or_else(|| UnknownCode(word.to_owned()))
}

impl TryFrom<JobInput> for JobInputDto {
    type Error = UnknownCode;

    fn try_from(input: JobInput) -> Result<Self, UnknownCode> {
        Ok(match input {
            JobInput::Calibration(input) => Self::Calibration(input.try_into()?),
            JobInput::Scan(input) => Self::Scan(input.try_into()?),
            JobInput::Recomputation(RecomputeInput { scan_id, calibration_id }) => {
                Self::Recomputation(RecomputationJobDto { scan_id, calibration_id })
            }
            JobInput::Verification(input) => Self::Verification(input.try_into()?),
            JobInput::Export(input) => Self::Export(input.try_into()?),
            JobInput::Inspection(InspectInput { recipe_id, recipe_version, part, source }) => {
                let InspectedPart { serial, order, attributes } = part;
                let source = source.into();
                Self::Inspection(InspectionJobDto { recipe_id, recipe_version, serial, order, attributes, source })
            }
            JobInput::ReEvaluation(input) => {
                let ReEvaluateInput { inspection_id, recipe_id, recipe_version, calibration_id } = input;
                Self::ReEvaluation(ReEvaluationJobDto { inspection_id, recipe_id, recipe_version, calibration_id })
            }
        })
    }
}

impl TryFrom<CalibrateInput> for CalibrationJobDto {
    type Error = UnknownCode;

    fn try_from(input: CalibrateInput) -> Result<Self, UnknownCode> {
        let CalibrateInput { source, light_model, k3, leave_out_unreadable, n_poses, session_id, station: _ } =
            input;
        let source = match source {
            Source::Station => CalibrationSourceDto::Station {},
            Source::Capture { capture_id } => CalibrationSourceDto::Capture { capture_id },
        };
        let light_model = light_model.map(|word| known(light_model_of(&word), &word)).transpose()?;
        let k3 = k3.map(|word| known(k3_of(&word), &word)).transpose()?;
        Ok(Self { source, light_model, k3, leave_out_unreadable, n_poses, session_id })
    }
}

fn light_model_of(word: &str) -> Option<LightModelDto> {
    if word == "auto" {
        return Some(LightModelDto::Auto);
    }
    let kind = LightModelKind::ALL.into_iter().find(|kind| kind.name() == word)?;
    Some(match kind {
        LightModelKind::Planes => LightModelDto::Planes,
        LightModelKind::Pencil => LightModelDto::Pencil,
        LightModelKind::Grating => LightModelDto::Grating,
    })
}

fn k3_of(word: &str) -> Option<K3Dto> {
    match word {
        "auto" => Some(K3Dto::Auto),
        "on" => Some(K3Dto::On),
        "off" => Some(K3Dto::Off),
        _ => None,
    }
}

impl From<ScanSource> for ScanSourceDto {
    fn from(source: ScanSource) -> Self {
        match source {
            ScanSource::Station => Self::Station {},
            ScanSource::Capture { capture_id, scan } => Self::Capture { capture_id, scan },
        }
    }
}

/// A requested measurement.
pub fn measure_dtos(inputs: Vec<MeasureInput>) -> Result<Vec<MeasureDto>, UnknownCode> {
    let dto = |input: MeasureInput| {
        let MeasureInput { tool, name, nominal_mm, tolerance_mm, region_mm, seed } = input;
        let tool = known(Tool::from_name(&tool), &tool)?.into();
        Ok(MeasureDto { tool, name, nominal_mm, tolerance_mm, region_mm, seed })
    };
    inputs.into_iter().map(dto).collect()
}

impl TryFrom<VerifyInput> for VerificationJobDto {
    type Error = UnknownCode;

    fn try_from(input: VerifyInput) -> Result<Self, UnknownCode> {
        let VerifyInput { reference_part, nominal_mm, tolerance_mm, scan } = input;
        let found = match reference_part.as_str() {
            "gauge" => Some(ReferencePartDto::Gauge),
            "sphere" => Some(ReferencePartDto::Sphere),
            _ => None,
        };
        Ok(Self {
            reference_part: known(found, &reference_part)?,
            nominal_mm,
            tolerance_mm,
            scan: scan.try_into()?,
        })
    }
}

impl TryFrom<ExportInput> for ExportJobDto {
    type Error = UnknownCode;

    fn try_from(input: ExportInput) -> Result<Self, UnknownCode> {
        let ExportInput { scan_id, what, format } = input;
        let export = serde_json::from_value(json!({ "what": what, "format": format }));
        Ok(Self { scan_id, export: export.map_err(|_| UnknownCode(format!("{what} as {format}")))? })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::Value;

    use super::*;

    /// Every kind of stored job is returned in full.
    #[test]
    fn stored_inputs_are_returned_in_full() {
        let scan = json!({
            "source": { "kind": "capture", "capture_id": "c", "scan": "gauge" }, "name": "n", "from_mm": -1.0,
            "to_mm": 1.0, "step_mm": 0.5, "mode": "stop_and_go", "exposure_us": 800.0,
            "laser_power": 1.0, "keep_frames": true, "record": false, "calibration_id": "k", "resume_scan_id": null,
            "measure": [{ "tool": "sphere", "name": "ball", "nominal_mm": 18.9, "tolerance_mm": 0.1,
                "region_mm": [0.0, 0.0, 0.0, 1.0, 1.0, 1.0], "seed": 3 }],
            "purpose": "production",
        });
        let with = |kind: &str, mut value: Value| {
            value["kind"] = json!(kind);
            value
        };
        let stored = [
            with("scan", scan.clone()),
            json!({ "kind": "verification", "reference_part": "gauge", "nominal_mm": 10.0, "tolerance_mm": null,
                "scan": scan }),
            json!({ "kind": "calibration", "source": { "kind": "station" }, "light_model": "pencil", "k3": "on",
                "leave_out_unreadable": true, "n_poses": 12, "session_id": null }),
            json!({ "kind": "recomputation", "scan_id": "s", "calibration_id": null }),
            json!({ "kind": "export", "scan_id": "s", "what": "mesh", "format": "stl" }),
            json!({ "kind": "inspection", "recipe_id": "bracket", "recipe_version": 7, "serial": "S1", "order": "4711",
                "attributes": { "line": "2" }, "source": { "kind": "capture", "capture_id": "c", "scan": null } }),
            json!({ "kind": "re_evaluation", "inspection_id": "i", "recipe_id": "bracket", "recipe_version": 8,
                "calibration_id": "k" }),
        ];
        for stored in stored {
            let input: JobInput = serde_json::from_value(stored.clone()).unwrap();
            let returned = serde_json::to_value(JobInputDto::try_from(input).unwrap()).unwrap();
            assert_eq!(returned, stored);
        }
    }

    #[test]
    fn an_unknown_code_of_another_version_is_not_guessed() {
        let input = ExportInput { scan_id: "s".into(), what: "voxels".into(), format: "x".into() };
        assert_eq!(ExportJobDto::try_from(input), Err(UnknownCode("voxels as x".to_owned())));
    }
}
