//! Requests that start a scan, verification, recomputation or export, on the wire.

use app::jobs::{ExportInput, ScanInput, ScanMode, ScanSource, VerifyInput};
use app::measurements::{MeasureInput, ScanPurpose};
use app::scan_run::BackgroundInput;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::measurement::measurements::MeasureDto;

/// Source of the frames of a scan.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ScanSourceDto {
    /// The station itself.
    Station {},
    /// A scan of a capture.
    Capture {
        /// Id of the capture.
        capture_id: String,
        /// Name of the scan in the capture; default: the only one.
        scan: Option<String>,
    },
}

/// Motion of the stage.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScanModeDto {
    /// Stops for every frame.
    StopAndGo,
    /// Moves at constant speed.
    Continuous,
}

/// When laser-off images are captured during a scan, for ambient light subtraction.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BackgroundDto {
    /// Stop-and-go: at least one every so many rows, default 1; an outdated one is captured again. A continuous scan has one
    /// before it, and one after it for comparison.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1)]
    pub every_rows: Option<usize>,
    /// Only if the ambient light exceeds this level, of 255; default: always.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0.0, maximum = 255.0)]
    pub above_levels: Option<f64>,
}

impl From<ScanModeDto> for ScanMode {
    fn from(dto: ScanModeDto) -> Self {
        match dto {
            ScanModeDto::StopAndGo => Self::StopAndGo,
            ScanModeDto::Continuous => Self::Continuous,
        }
    }
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

/// Request to scan a part.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "source": { "kind": "station" }, "from_mm": -20, "to_mm": 20, "step_mm": 0.2 }))]
pub struct StartScanDto {
    /// Source of the frames.
    pub source: ScanSourceDto,
    /// Its name.
    #[schema(max_length = 100)]
    pub name: Option<String>,
    /// First position of a linear stage.
    pub from_mm: Option<f64>,
    /// Last position of a linear stage.
    pub to_mm: Option<f64>,
    /// Distance between rows.
    #[schema(exclusive_minimum = 0.0)]
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan on a linear stage; the step follows from the frame rate.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_s: Option<f64>,
    /// First angle of a turntable.
    pub from_deg: Option<f64>,
    /// Last angle of a turntable; more than a full turn shows the closure.
    pub to_deg: Option<f64>,
    /// Angle between rows.
    #[schema(exclusive_minimum = 0.0)]
    pub step_deg: Option<f64>,
    /// Speed of a continuous scan on a turntable; the step follows from the frame rate.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_deg_s: Option<f64>,
    /// Motion of the stage; default: continuous if a speed is given, else stop-and-go.
    pub mode: Option<ScanModeDto>,
    /// Exposure time of the frames; default: chosen by the station.
    #[schema(exclusive_minimum = 0.0)]
    pub exposure_us: Option<f64>,
    /// Two to four exposure times per row instead of one (HDR), stop-and-go only: dark areas of a part are taken from the
    /// long exposures, bright areas from the short ones. Each at least 1.5 times the next shorter one; four to eight times is
    /// usual.
    #[serde(default)]
    #[schema(max_items = 4)]
    pub exposures_us: Vec<f64>,
    /// Laser power, share of full power; default: chosen by the station.
    #[schema(exclusive_minimum = 0.0, maximum = 1.0)]
    pub laser_power: Option<f64>,
    /// Keep the frames as a capture.
    #[serde(default)]
    pub keep_frames: bool,
    /// When laser-off images are captured for ambient light subtraction; default: never.
    pub background: Option<BackgroundDto>,
    /// Record everything that the camera delivers during the scan as an MCAP file (`GET /recordings`). A full disk ends the
    /// recording, not the scan.
    #[serde(default)]
    pub record: bool,
    /// The calibration; default: the active one.
    pub calibration_id: Option<String>,
    /// The partial scan to resume; its own measurements apply.
    pub resume_scan_id: Option<String>,
    /// What is measured in the same job; the verdict does not depend on a connected client.
    #[serde(default)]
    #[schema(max_items = 50)]
    pub measure: Vec<MeasureDto>,
}

/// Request to recompute a scan.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RecomputeDto {
    /// The calibration; default: the active one.
    pub calibration_id: Option<String>,
}

/// A reference part.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReferencePartDto {
    /// A gauge block; its nominal is its height.
    Gauge,
    /// A sphere; its nominal is its radius.
    Sphere,
}

/// Request to scan a reference part and compare it with its nominal value.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "reference_part": "sphere", "nominal_mm": 18.9, "scan": { "source": { "kind": "station" } } }))]
pub struct StartVerificationDto {
    /// Kind of the reference part.
    pub reference_part: ReferencePartDto,
    /// Nominal height or radius.
    #[schema(exclusive_minimum = 0.0)]
    pub nominal_mm: f64,
    /// Symmetric tolerance of the deviation.
    #[schema(exclusive_minimum = 0.0)]
    pub tolerance_mm: Option<f64>,
    /// The scan.
    pub scan: StartScanDto,
}

/// What an export contains.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExportWhatDto {
    /// The points.
    Cloud,
    /// The surface.
    Mesh,
}

/// Request to write a scan in another format.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "what": "mesh", "format": "stl" }))]
pub struct StartExportDto {
    /// What an export contains.
    pub what: ExportWhatDto,
    /// `ply`, `csv`, `pcd` or `e57` for a cloud; `stl`, `glb` or `ply` for a mesh.
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
            mode: dto.mode.map(ScanMode::from),
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
        let reference_part = match dto.reference_part {
            ReferencePartDto::Gauge => "gauge",
            ReferencePartDto::Sphere => "sphere",
        };
        Self {
            reference_part: reference_part.to_owned(),
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
