//! Job inputs as stored in job records.

use serde::{Deserialize, Serialize};

use crate::jobs::Job;
use crate::resources::calibrations::used_station::UsedStation;
use crate::resources::inspections::InspectedPart;
use crate::resources::scan_run::{MeasureInput, ScanMode, ScanPurpose, ScanSettings, ScanSource};

/// Source of the images.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Source {
    /// The station itself.
    Station,
    /// A stored capture.
    Capture {
        /// Id of the capture.
        capture_id: String,
    },
}

/// Calibrate camera, light sheets and stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrateInput {
    /// Source of the images; on the simulated station a virtual operator moves the board.
    pub source: Source,
    /// `auto`, `planes`, `pencil`, `grating`.
    pub light_model: Option<String>,
    /// `auto`, `on`, `off`.
    pub k3: Option<String>,
    /// Ignore images without a readable board or line, even if most are unreadable.
    pub leave_out_unreadable: bool,
    /// Number of board poses to capture at the station.
    pub n_poses: Option<usize>,
    /// The session whose images are used; `source` is then the station.
    pub session_id: Option<String>,
    /// The station that captured the images, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub station: Option<UsedStation>,
}

/// Request to scan a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanInput {
    /// Source of the frames.
    pub source: ScanSource,
    /// Its name.
    pub name: Option<String>,
    /// Settings of the station.
    #[serde(flatten)]
    pub settings: ScanSettings,
    /// The calibration; `None`: the active one.
    pub calibration_id: Option<String>,
    /// The partial scan to resume.
    pub resume_scan_id: Option<String>,
    /// What is measured in the same job; a resumed scan has its own measurements.
    #[serde(default)]
    pub measure: Vec<MeasureInput>,
    /// Purpose of the scan.
    #[serde(default)]
    pub purpose: ScanPurpose,
}

/// Recompute a scan from its peaks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecomputeInput {
    /// The scan.
    pub scan_id: String,
    /// The calibration; `None`: the active one.
    pub calibration_id: Option<String>,
}

/// Scan a reference part and compare.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerifyInput {
    /// `gauge` or `sphere`.
    pub reference_part: String,
    /// Nominal height or radius.
    pub nominal_mm: f64,
    /// Symmetric tolerance of the deviation.
    pub tolerance_mm: Option<f64>,
    /// The scan; its source may also be a capture.
    pub scan: ScanInput,
}

/// Request to inspect a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InspectInput {
    /// The recipe.
    pub recipe_id: String,
    /// Its version, fixed when the job was accepted.
    pub recipe_version: i64,
    /// The part.
    #[serde(flatten)]
    pub part: InspectedPart,
    /// Source of the frames; of a capture, the settings of the recipe are not used.
    #[serde(default)]
    pub source: ScanSource,
}

/// Request to re-evaluate the scan of an inspection with another version of a recipe or another calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReEvaluateInput {
    /// The inspection.
    pub inspection_id: String,
    /// The recipe.
    pub recipe_id: String,
    /// Its version.
    pub recipe_version: i64,
    /// The calibration; `None`: that of the scan.
    #[serde(default)]
    pub calibration_id: Option<String>,
}

/// Request to write a scan in another format.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExportInput {
    /// The scan.
    pub scan_id: String,
    /// `cloud` or `mesh`.
    pub what: String,
    /// `ply`, `csv`, `pcd`, `e57`; `stl`, `glb`, `ply`.
    pub format: String,
}

/// The input of a job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum JobInput {
    /// See [`CalibrateInput`].
    Calibration(CalibrateInput),
    /// See [`ScanInput`].
    Scan(ScanInput),
    /// See [`RecomputeInput`].
    Recomputation(RecomputeInput),
    /// See [`VerifyInput`].
    Verification(VerifyInput),
    /// See [`ExportInput`].
    Export(ExportInput),
    /// See [`InspectInput`].
    Inspection(InspectInput),
    /// See [`ReEvaluateInput`].
    ReEvaluation(ReEvaluateInput),
}

impl JobInput {
    /// The kind stored with the job.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Calibration(_) => "calibration",
            Self::Scan(_) => "scan",
            Self::Recomputation(_) => "recomputation",
            Self::Verification(_) => "verification",
            Self::Export(_) => "export",
            Self::Inspection(_) => "inspection",
            Self::ReEvaluation(_) => "re_evaluation",
        }
    }

    /// Class of jobs with similar duration, for forecasts.
    pub fn duration_class(&self) -> String {
        match self {
            Self::Scan(input) | Self::Verification(VerifyInput { scan: input, .. }) => {
                let swept = input.settings.mode() == ScanMode::Continuous;
                format!(
                    "{}/{}/{}/{}",
                    self.kind(),
                    input.source.label(),
                    if swept { "swept" } else { "stepped" },
                    input.measure.len()
                )
            }
            Self::Calibration(input) => {
                format!("{}/{}/{}", self.kind(), self.needs_station(), input.session_id.is_some())
            }
            Self::Export(input) => format!("{}/{}/{}", self.kind(), input.what, input.format),
            Self::Inspection(InspectInput { recipe_id, recipe_version, source, .. }) => {
                format!("{}/{}/{recipe_id}@{recipe_version}", self.kind(), source.label())
            }
            Self::ReEvaluation(ReEvaluateInput { recipe_id, recipe_version, calibration_id, .. }) => {
                format!("{}/{recipe_id}@{recipe_version}/{}", self.kind(), calibration_id.is_some())
            }
            Self::Recomputation(_) => self.kind().to_owned(),
        }
    }

    /// Amount of work, in the unit of its kind: similar jobs take about the same time per unit.
    pub fn size(&self) -> f64 {
        match self {
            Self::Scan(input) | Self::Verification(VerifyInput { scan: input, .. }) => {
                let way = |to: Option<f64>, from: Option<f64>| Some((to? - from?).abs());
                let settings = &input.settings;
                let travel = way(settings.to_mm, settings.from_mm).or(way(settings.to_deg, settings.from_deg));
                let rows = travel.zip(settings.step_mm.or(settings.step_deg)).map(|(travel, step)| travel / step);
                rows.or(travel).filter(|size| size.is_finite()).map_or(1.0, |size| size + 1.0)
            }
            Self::Calibration(input) => input.n_poses.unwrap_or(super::calibrate::N_POSES) as f64,
            Self::Recomputation(_) | Self::Export(_) | Self::Inspection(_) | Self::ReEvaluation(_) => 1.0,
        }
    }

    /// Whether it needs the station: such jobs run one at a time, and Stop ends them.
    pub fn needs_station(&self) -> bool {
        matches!(Job::from(self.clone()), Job::Station(_))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::resources::scan_run::BackgroundInput;

    fn scan(stored: serde_json::Value) -> ScanInput {
        match serde_json::from_value(stored).unwrap() {
            JobInput::Scan(input) => input,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_job_of_version_0_1_with_null_fields_is_read() {
        let input = scan(json!({
            "kind": "scan", "source": { "kind": "station" }, "name": null, "from_mm": -20, "to_mm": 20.5, "step_mm": 0.2,
            "speed_mm_s": null, "mode": null, "exposure_us": 800.0, "exposures_us": [], "laser_power": null,
            "keep_frames": true, "background": { "every_rows": 2, "above_levels": null }, "record": false,
            "calibration_id": null, "resume_scan_id": null, "measure": [], "purpose": "production",
        }));
        let expected = ScanSettings {
            from_mm: Some(-20.0),
            to_mm: Some(20.5),
            step_mm: Some(0.2),
            exposure_us: Some(800.0),
            keep_frames: true,
            background: Some(BackgroundInput { every_rows: Some(2), above_levels: None }),
            ..ScanSettings::default()
        };
        assert_eq!(input.settings, expected);
        let again = serde_json::to_value(JobInput::Scan(input.clone())).unwrap();
        assert_eq!(again["from_mm"], -20.0);
        assert_eq!(scan(again), input);
    }
}
