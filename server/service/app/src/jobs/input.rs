//! Job inputs as stored in job records.

use serde::{Deserialize, Serialize};

use crate::jobs::Job;
use crate::resources::inspections::InspectedPart;
use crate::resources::scan_run::{BackgroundInput, MeasureInput, ScanMode, ScanPurpose, ScanSource};

/// Where pictures come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Source {
    /// The station itself.
    Station,
    /// A stored capture.
    Capture {
        /// The watch.
        capture_id: String,
    },
}

/// Calibrate camera, light sheets and stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrateInput {
    /// Where pictures come from; on the simulated station a virtual operator moves the board.
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
}

/// Request to scan a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanInput {
    /// Source of the frames.
    pub source: ScanSource,
    /// Its name.
    pub name: Option<String>,
    /// First position of a linear stage.
    pub from_mm: Option<f64>,
    /// Last position of a linear stage.
    pub to_mm: Option<f64>,
    /// Distance between rows.
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan; the step follows from the frame rate.
    pub speed_mm_s: Option<f64>,
    /// First angle of a turntable.
    #[serde(default)]
    pub from_deg: Option<f64>,
    /// Last angle of a turntable; more than a full turn shows the closure.
    #[serde(default)]
    pub to_deg: Option<f64>,
    /// Angle between rows.
    #[serde(default)]
    pub step_deg: Option<f64>,
    /// Speed of a continuous scan on a turntable; the step follows from the frame rate.
    #[serde(default)]
    pub speed_deg_s: Option<f64>,
    /// Motion of the stage.
    pub mode: Option<ScanMode>,
    /// Exposure time of the laser frames.
    pub exposure_us: Option<f64>,
    /// Two to four exposure times per row instead of one (HDR), for parts with dark and bright areas.
    #[serde(default)]
    pub exposures_us: Vec<f64>,
    /// Laser power, share of full power.
    pub laser_power: Option<f64>,
    /// Keep the frames as a capture.
    pub keep_frames: bool,
    /// When laser-off images are captured; `None`: never.
    #[serde(default)]
    pub background: Option<BackgroundInput>,
    /// Record everything that the camera delivers during the scan as an MCAP file.
    #[serde(default)]
    pub record: bool,
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
    /// Its version, decided when the job was accepted.
    pub recipe_version: i64,
    /// The part.
    #[serde(flatten)]
    pub part: InspectedPart,
}

/// Request to judge the scan of an inspection by another version of a recipe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReEvaluateInput {
    /// The inspection.
    pub inspection_id: String,
    /// The recipe.
    pub recipe_id: String,
    /// Its version.
    pub recipe_version: i64,
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

impl ScanInput {
    /// Whether the stage moves while frames are captured: by the mode, or because a speed is given.
    pub fn is_continuous(&self) -> bool {
        let by_speed = self.speed_mm_s.is_some() || self.speed_deg_s.is_some();
        self.mode.map_or(by_speed, |mode| mode == ScanMode::Continuous)
    }
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

    /// Class of similar jobs for forecasts of the duration: the kind, and what matters within it.
    pub fn likeness(&self) -> String {
        match self {
            Self::Scan(input) | Self::Verification(VerifyInput { scan: input, .. }) => {
                let swept = input.is_continuous();
                let source = if input.source == ScanSource::Station { "station" } else { "capture" };
                format!(
                    "{}/{source}/{}/{}",
                    self.kind(),
                    if swept { "swept" } else { "stepped" },
                    input.measure.len()
                )
            }
            Self::Calibration(input) => {
                format!("{}/{}/{}", self.kind(), self.needs_station(), input.session_id.is_some())
            }
            Self::Export(input) => format!("{}/{}/{}", self.kind(), input.what, input.format),
            Self::Inspection(InspectInput { recipe_id, recipe_version, .. })
            | Self::ReEvaluation(ReEvaluateInput { recipe_id, recipe_version, .. }) => {
                format!("{}/{recipe_id}@{recipe_version}", self.kind())
            }
            Self::Recomputation(_) => self.kind().to_owned(),
        }
    }

    /// Amount of work, in the unit of its kind: similar jobs take about the same time per unit.
    pub fn size(&self) -> f64 {
        match self {
            Self::Scan(input) | Self::Verification(VerifyInput { scan: input, .. }) => {
                let way = |to: Option<f64>, from: Option<f64>| Some((to? - from?).abs());
                let travel = way(input.to_mm, input.from_mm).or(way(input.to_deg, input.from_deg));
                let rows = travel.zip(input.step_mm.or(input.step_deg)).map(|(travel, step)| travel / step);
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
