//! How a recipe scans, on the wire.

use app::recipes::RecipeScan;
use app::scan_run::{BackgroundInput, ScanMode};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::scan::scans::{BackgroundDto, ScanModeDto};

/// How a part is scanned: the fields of a scan request that are the same for every part. The calibration is the active one.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "from_mm": -20, "to_mm": 20, "step_mm": 0.2 }))]
pub struct RecipeScanDto {
    /// First position of a linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Last position of a linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
    /// Distance between rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub step_mm: Option<f64>,
    /// Speed of a continuous scan; the step follows from the frame rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_s: Option<f64>,
    /// First angle of a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Last angle of a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
    /// Angle between rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub step_deg: Option<f64>,
    /// Speed of a continuous scan on a turntable; the step follows from the frame rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub speed_deg_s: Option<f64>,
    /// Motion of the stage; default: continuous if a speed is given, else stop-and-go.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<ScanModeDto>,
    /// Exposure time of the frames; default: chosen by the station.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0)]
    pub exposure_us: Option<f64>,
    /// Two to four exposure times per row instead of one (HDR), stop-and-go only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 4)]
    pub exposures_us: Vec<f64>,
    /// Laser power, share of full power; default: chosen by the station.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0.0, maximum = 1.0)]
    pub laser_power: Option<f64>,
    /// When laser-off images are captured for ambient light subtraction; default: never.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundDto>,
    /// Keep the frames as a capture.
    #[serde(default)]
    pub keep_frames: bool,
    /// Record everything that the camera delivers during the scan as an MCAP file.
    #[serde(default)]
    pub record: bool,
}

impl From<RecipeScanDto> for RecipeScan {
    fn from(dto: RecipeScanDto) -> Self {
        Self {
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
            background: dto.background.map(BackgroundInput::from),
            keep_frames: dto.keep_frames,
            record: dto.record,
        }
    }
}

impl From<RecipeScan> for RecipeScanDto {
    fn from(scan: RecipeScan) -> Self {
        Self {
            from_mm: scan.from_mm,
            to_mm: scan.to_mm,
            step_mm: scan.step_mm,
            speed_mm_s: scan.speed_mm_s,
            from_deg: scan.from_deg,
            to_deg: scan.to_deg,
            step_deg: scan.step_deg,
            speed_deg_s: scan.speed_deg_s,
            mode: scan.mode.map(ScanModeDto::from),
            exposure_us: scan.exposure_us,
            exposures_us: scan.exposures_us,
            laser_power: scan.laser_power,
            background: scan.background.map(BackgroundDto::from),
            keep_frames: scan.keep_frames,
            record: scan.record,
        }
    }
}
