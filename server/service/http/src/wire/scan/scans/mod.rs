//! Scans on the wire.

use serde::{Deserialize, Serialize};
use store::{DamagedRow, ScanState};
use utoipa::{IntoParams, ToSchema};

use crate::wire::figures;
use crate::wire::measurement::measurements::{CharacteristicDto, MeasureDto, VerdictDto};
use crate::wire::scan::scan_reports::ScanReportDto;
use crate::wire::scan::scan_runs::{ScanPurposeDto, ScanRunDto};
use app::jobs::{ExportInput, ScanInput, ScanMode, ScanSource, VerifyInput};
use app::measurements::parts::Part;
use app::measurements::{MeasureInput, ScanPurpose};
use app::scan_run::ScanRun;

/// What a scan is worth.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScanStateDto {
    /// Every planned frame is in it.
    Complete,
    /// It was stopped or interrupted.
    Partial,
    /// Frames were lost.
    Invalid,
}

impl ScanStateDto {
    /// The word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Partial => "partial",
            Self::Invalid => "invalid",
        }
    }
}

impl From<ScanStateDto> for ScanState {
    fn from(dto: ScanStateDto) -> Self {
        match dto {
            ScanStateDto::Complete => Self::Complete,
            ScanStateDto::Partial => Self::Partial,
            ScanStateDto::Invalid => Self::Invalid,
        }
    }
}

/// Which scans.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ScansQuery {
    /// Only those worth that much.
    pub state: Option<ScanStateDto>,
    /// Only those computed with this calibration.
    pub calibration_id: Option<String>,
    /// Only parts with this verdict.
    pub verdict: Option<VerdictDto>,
    /// Only those made for this.
    pub purpose: Option<ScanPurposeDto>,
    /// Id of the last scan of the page before.
    pub before: Option<String>,
    /// Scans of a page, 1 to 200; 50 if not said.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

/// Where a scan's frames come from.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ScanSourceDto {
    /// The station itself.
    Station {},
    /// A scan of a capture.
    Capture {
        /// Which capture.
        capture_id: String,
        /// Which of its scans; missing: the only one.
        scan: Option<String>,
    },
}

/// How the stage moves.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScanModeDto {
    /// Stands still for every frame.
    StopAndGo,
    /// Moves at constant speed.
    Continuous,
}

/// Scan a part.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "source": { "kind": "station" }, "from_mm": -20, "to_mm": 20, "step_mm": 0.2 }))]
pub struct StartScanDto {
    /// Where frames come from.
    pub source: ScanSourceDto,
    /// What a person calls it.
    #[schema(max_length = 100)]
    pub name: Option<String>,
    /// First stage position.
    pub from_mm: Option<f64>,
    /// Last stage position.
    pub to_mm: Option<f64>,
    /// Distance between frames.
    #[schema(exclusive_minimum = 0.0)]
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan; the step follows from the frame rate.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_s: Option<f64>,
    /// How the stage moves; continuous if a speed is given, else stop and go.
    pub mode: Option<ScanModeDto>,
    /// Exposure of the frames.
    #[schema(exclusive_minimum = 0.0)]
    pub exposure_us: Option<f64>,
    /// Share of full laser power.
    #[schema(exclusive_minimum = 0.0, maximum = 1.0)]
    pub laser_power: Option<f64>,
    /// Keep the frames as a capture.
    #[serde(default)]
    pub keep_frames: bool,
    /// With which calibration; missing: the active one.
    pub calibration_id: Option<String>,
    /// The partial scan that is continued; it measures what it was begun for.
    pub resume_scan_id: Option<String>,
    /// What is measured on it in the same job: the verdict needs nobody to wait for the scan.
    #[serde(default)]
    #[schema(max_items = 50)]
    pub measure: Vec<MeasureDto>,
}

/// Compute a scan again.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RecomputeDto {
    /// With which calibration; missing: the active one.
    pub calibration_id: Option<String>,
}

/// A known part.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ArtefactDto {
    /// A gauge block; its nominal is its height.
    Gauge,
    /// A ball; its nominal is its radius.
    Sphere,
}

/// Scan a known part and compare.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "artefact": "sphere", "nominal_mm": 18.9, "scan": { "source": { "kind": "station" } } }))]
pub struct StartVerificationDto {
    /// What it is.
    pub artefact: ArtefactDto,
    /// Its height or radius.
    #[schema(exclusive_minimum = 0.0)]
    pub nominal_mm: f64,
    /// Largest deviation allowed.
    #[schema(exclusive_minimum = 0.0)]
    pub tolerance_mm: Option<f64>,
    /// How to scan it.
    pub scan: StartScanDto,
}

/// What is written.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExportWhatDto {
    /// The points.
    Cloud,
    /// The surface.
    Mesh,
}

/// Write a scan in another format.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "what": "mesh", "format": "stl" }))]
pub struct StartExportDto {
    /// What is written.
    pub what: ExportWhatDto,
    /// `ply`, `csv`, `pcd`, `e57` of a cloud; `stl`, `glb`, `ply` of a mesh.
    pub format: String,
}

/// Format of a cloud.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CloudFormatDto {
    /// Binary PLY with σ, order and calibration; as `sheaf scan` writes it.
    #[default]
    Ply,
    /// Text.
    Csv,
    /// Point Cloud Library.
    Pcd,
    /// ASTM E2807.
    E57,
}

impl CloudFormatDto {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Pcd => "pcd",
            Self::E57 => "e57",
        }
    }
}

/// Format of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshFormatDto {
    /// Binary STL.
    #[default]
    Stl,
    /// glTF, binary.
    Glb,
    /// Binary PLY.
    Ply,
}

impl MeshFormatDto {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Glb => "glb",
            Self::Ply => "ply",
        }
    }
}

/// Which format of the cloud.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CloudQuery {
    /// `ply` if not said.
    pub format: Option<CloudFormatDto>,
}

/// Which format of the mesh.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct MeshQuery {
    /// `stl` if not said.
    pub format: Option<MeshFormatDto>,
}

/// Which blocks.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct PointsQuery {
    /// The first block wanted; 0 if not said.
    pub from_block: Option<u32>,
}

/// A scan.
#[derive(Debug, Serialize, ToSchema)]
pub struct ScanDto {
    /// Its id.
    pub id: String,
    /// What a person calls it.
    pub name: String,
    /// `complete`, `partial` (can be resumed), `invalid` (frames were lost: never the base of a verdict).
    #[schema(example = "complete")]
    pub state: &'static str,
    /// The verdict on the part: of every characteristic the newest, of these the worst; missing if none was asked for.
    pub verdict: Option<VerdictDto>,
    /// The measurement that stands for each characteristic, newest first.
    pub characteristics: Vec<CharacteristicDto>,
    /// What it was made for; a verification is no part of the production.
    pub purpose: ScanPurposeDto,
    /// The calibration of the cloud.
    pub calibration_id: String,
    /// How it was made.
    pub plan: ScanRunDto,
    /// Figures: points, dropped by reason, self-consistency, envelope.
    pub report: ScanReportDto,
    /// Its frames, if they were kept.
    pub capture_id: Option<String>,
    /// The scan it was computed from again.
    pub recomputed_from: Option<String>,
    /// The job that made it.
    pub job_id: Option<String>,
    /// Version of the software that computed it.
    pub software_version: String,
    /// Address of the cloud; missing if no point could be computed.
    pub cloud: Option<String>,
    /// When it was made, wall clock, ms since 1970.
    pub created_at_ms: i64,
}

/// Address of a scan.
pub fn scan_href(id: &str) -> String {
    format!("/api/v1/scans/{id}")
}

impl TryFrom<Part> for ScanDto {
    type Error = DamagedRow;

    fn try_from(part: Part) -> Result<Self, DamagedRow> {
        let record = part.scan;
        let run = ScanRun::of(&record).ok().and_then(|run| ScanRunDto::try_from(run).ok());
        let plan = run.ok_or_else(|| DamagedRow { kind: "scan", id: record.id.clone() })?;
        let report = figures("scan", &record.id, record.report)?;
        Ok(Self {
            verdict: part.verdict.map(VerdictDto::from),
            characteristics: part.measured.iter().map(CharacteristicDto::from).collect(),
            purpose: plan.purpose,
            cloud: record.cloud.as_ref().map(|_| format!("{}/cloud", scan_href(&record.id))),
            state: match record.state {
                ScanState::Complete => "complete",
                ScanState::Partial => "partial",
                ScanState::Invalid => "invalid",
            },
            id: record.id,
            name: record.name,
            calibration_id: record.calibration_id,
            plan,
            report,
            capture_id: record.capture_id,
            recomputed_from: record.recomputed_from,
            job_id: record.job_id,
            software_version: record.software_version,
            created_at_ms: record.created_at_ms,
        })
    }
}

impl From<ScanSourceDto> for ScanSource {
    fn from(dto: ScanSourceDto) -> Self {
        match dto {
            ScanSourceDto::Station {} => Self::Station,
            ScanSourceDto::Capture { capture_id, scan } => Self::Capture { capture_id, scan },
        }
    }
}

impl From<StartScanDto> for ScanInput {
    fn from(dto: StartScanDto) -> Self {
        Self {
            source: dto.source.into(),
            name: dto.name,
            from_mm: dto.from_mm,
            to_mm: dto.to_mm,
            step_mm: dto.step_mm,
            speed_mm_s: dto.speed_mm_s,
            mode: dto.mode.map(|mode| match mode {
                ScanModeDto::StopAndGo => ScanMode::StopAndGo,
                ScanModeDto::Continuous => ScanMode::Continuous,
            }),
            exposure_us: dto.exposure_us,
            laser_power: dto.laser_power,
            keep_frames: dto.keep_frames,
            calibration_id: dto.calibration_id,
            resume_scan_id: dto.resume_scan_id,
            measure: dto.measure.into_iter().map(MeasureInput::from).collect(),
            purpose: ScanPurpose::Production,
        }
    }
}

impl From<StartVerificationDto> for VerifyInput {
    fn from(dto: StartVerificationDto) -> Self {
        let artefact = match dto.artefact {
            ArtefactDto::Gauge => "gauge",
            ArtefactDto::Sphere => "sphere",
        };
        Self {
            artefact: artefact.to_owned(),
            nominal_mm: dto.nominal_mm,
            tolerance_mm: dto.tolerance_mm,
            scan: dto.scan.into(),
        }
    }
}

impl StartExportDto {
    /// The job's input.
    pub fn input(self, scan_id: String) -> ExportInput {
        let what = match self.what {
            ExportWhatDto::Cloud => "cloud",
            ExportWhatDto::Mesh => "mesh",
        };
        ExportInput { scan_id, what: what.to_owned(), format: self.format }
    }
}
