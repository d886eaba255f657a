//! What starts a scan, a verification, a computation again or an export, on the wire.

use app::jobs::{ExportInput, ScanInput, ScanMode, ScanSource, VerifyInput};
use app::measurements::{MeasureInput, ScanPurpose};
use app::scan_run::BackgroundInput;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::measurement::measurements::MeasureDto;

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

/// When pictures with the laser off are taken during a scan, to be taken away from its frames.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BackgroundDto {
    /// Stop-and-go: one at least every so many rows, 1 if missing; one that no longer shows what a frame shows is taken
    /// anew. A continuous scan has one before it, and one after it to compare.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1)]
    pub every_rows: Option<usize>,
    /// Only while the ambient light, in levels of 255, is above this; missing: always.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0.0, maximum = 255.0)]
    pub above_levels: Option<f64>,
}

impl From<BackgroundDto> for BackgroundInput {
    fn from(dto: BackgroundDto) -> Self {
        let BackgroundDto { every_rows, above_levels } = dto;
        Self { every_rows, above_levels }
    }
}

impl From<BackgroundInput> for BackgroundDto {
    fn from(input: BackgroundInput) -> Self {
        let BackgroundInput { every_rows, above_levels } = input;
        Self { every_rows, above_levels }
    }
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
    /// First position, of a stage that travels.
    pub from_mm: Option<f64>,
    /// Last position.
    pub to_mm: Option<f64>,
    /// Distance between frames.
    #[schema(exclusive_minimum = 0.0)]
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan; the step follows from the frame rate.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_s: Option<f64>,
    /// First angle, of a turntable.
    pub from_deg: Option<f64>,
    /// Last angle; more than a whole turn shows how well it closes.
    pub to_deg: Option<f64>,
    /// Angle between frames.
    #[schema(exclusive_minimum = 0.0)]
    pub step_deg: Option<f64>,
    /// Speed of a continuous scan on a turntable; the step follows from the frame rate.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_deg_s: Option<f64>,
    /// How the stage moves; continuous if a speed is given, else stop and go.
    pub mode: Option<ScanModeDto>,
    /// Exposure of the frames.
    #[schema(exclusive_minimum = 0.0)]
    pub exposure_us: Option<f64>,
    /// Two to four exposures of every row in place of one, stop and go: dark places of a part are taken from the long ones,
    /// bright places from the short ones. Each at least one and a half times another; four to eight times is usual.
    #[serde(default)]
    #[schema(max_items = 4)]
    pub exposures_us: Vec<f64>,
    /// Share of full laser power.
    #[schema(exclusive_minimum = 0.0, maximum = 1.0)]
    pub laser_power: Option<f64>,
    /// Keep the frames as a capture.
    #[serde(default)]
    pub keep_frames: bool,
    /// When pictures with the laser off are taken, to be taken away from the frames; missing: never.
    pub background: Option<BackgroundDto>,
    /// Record everything that the camera delivers meanwhile, as an MCAP file (`GET /recordings`). A disk without room
    /// ends the recording, not the scan.
    #[serde(default)]
    pub record: bool,
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
            from_deg: dto.from_deg,
            to_deg: dto.to_deg,
            step_deg: dto.step_deg,
            speed_deg_s: dto.speed_deg_s,
            mode: dto.mode.map(|mode| match mode {
                ScanModeDto::StopAndGo => ScanMode::StopAndGo,
                ScanModeDto::Continuous => ScanMode::Continuous,
            }),
            exposure_us: dto.exposure_us,
            exposures_us: dto.exposures_us,
            laser_power: dto.laser_power,
            keep_frames: dto.keep_frames,
            background: dto.background.map(BackgroundInput::from),
            record: dto.record,
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
