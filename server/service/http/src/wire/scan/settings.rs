//! The settings of a scan on the wire: the same fields in a request, in a stored job and in a recipe.

use app::jobs::{ScanInput, ScanMode};
use app::measurements::{MeasureInput, ScanPurpose};
use app::scan_run::{BackgroundInput, ScanSettings};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::job::job_inputs::{UnknownCode, measure_dtos};
use crate::wire::measurement::measurements::MeasureDto;
use crate::wire::scan::scan_runs::ScanPurposeDto;
use crate::wire::scan::scans::ScanSourceDto;

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
    /// Stop-and-go: at least one every so many rows, default 1; an outdated one is captured again. A continuous scan has
    /// one before it, and one after it for comparison.
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

impl From<ScanMode> for ScanModeDto {
    fn from(mode: ScanMode) -> Self {
        match mode {
            ScanMode::StopAndGo => Self::StopAndGo,
            ScanMode::Continuous => Self::Continuous,
        }
    }
}

/// A type with the given fields and those of [`ScanSettings`]. Not `serde(flatten)`: errors name the field, and the schema
/// forbids unknown fields.
macro_rules! with_scan_settings {
    ($(#[$($attribute:tt)*])* pub struct $name:ident { $($own:tt)* }) => {
        $(#[$($attribute)*])*
        pub struct $name {
            $($own)*
            /// First position of a linear stage.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub from_mm: Option<f64>,
            /// Last position of a linear stage.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub to_mm: Option<f64>,
            /// Distance between rows.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            #[schema(exclusive_minimum = 0.0)]
            pub step_mm: Option<f64>,
            /// Speed of a continuous scan on a linear stage; the step follows from the frame rate.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            #[schema(exclusive_minimum = 0.0)]
            pub speed_mm_s: Option<f64>,
            /// First angle of a turntable.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub from_deg: Option<f64>,
            /// Last angle of a turntable; more than a full turn shows the closure.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub to_deg: Option<f64>,
            /// Angle between rows.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            #[schema(exclusive_minimum = 0.0)]
            pub step_deg: Option<f64>,
            /// Speed of a continuous scan on a turntable; the step follows from the frame rate.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            #[schema(exclusive_minimum = 0.0)]
            pub speed_deg_s: Option<f64>,
            /// Motion of the stage; default: continuous if a speed is given, else stop-and-go.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub mode: Option<ScanModeDto>,
            /// Exposure time of the frames; default: chosen by the station.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            #[schema(exclusive_minimum = 0.0)]
            pub exposure_us: Option<f64>,
            /// Two to four exposure times per row instead of one (HDR), stop-and-go only: dark areas of a part are taken
            /// from the long exposures, bright areas from the short ones. Each at least 1.5 times the next shorter one;
            /// four to eight times is usual.
            #[serde(default, skip_serializing_if = "Vec::is_empty")]
            #[schema(max_items = 4)]
            pub exposures_us: Vec<f64>,
            /// Laser power, fraction of full power; default: chosen by the station.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            #[schema(exclusive_minimum = 0.0, maximum = 1.0)]
            pub laser_power: Option<f64>,
            /// Keep the frames as a capture.
            #[serde(default)]
            pub keep_frames: bool,
            /// When laser-off images are captured for ambient light subtraction; default: never.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub background: Option<BackgroundDto>,
            /// Record everything that the camera delivers during the scan as an MCAP file (`GET /recordings`). A full
            /// disk ends the recording, not the scan.
            #[serde(default)]
            pub record: bool,
        }
    };
}

/// The settings in a value of one of these types; leaves its other fields usable.
macro_rules! settings_of {
    ($dto:ident) => {
        ScanSettings {
            from_mm: $dto.from_mm,
            to_mm: $dto.to_mm,
            step_mm: $dto.step_mm,
            speed_mm_s: $dto.speed_mm_s,
            from_deg: $dto.from_deg,
            to_deg: $dto.to_deg,
            step_deg: $dto.step_deg,
            speed_deg_s: $dto.speed_deg_s,
            mode: $dto.mode.map(ScanMode::from),
            exposure_us: $dto.exposure_us,
            exposures_us: $dto.exposures_us,
            laser_power: $dto.laser_power,
            keep_frames: $dto.keep_frames,
            background: $dto.background.map(BackgroundInput::from),
            record: $dto.record,
        }
    };
}

/// A value of one of these types from its own fields and the settings.
macro_rules! from_settings {
    ($settings:ident, $name:ident { $($own:ident: $value:expr,)* }) => {
        $name {
            $($own: $value,)*
            from_mm: $settings.from_mm,
            to_mm: $settings.to_mm,
            step_mm: $settings.step_mm,
            speed_mm_s: $settings.speed_mm_s,
            from_deg: $settings.from_deg,
            to_deg: $settings.to_deg,
            step_deg: $settings.step_deg,
            speed_deg_s: $settings.speed_deg_s,
            mode: $settings.mode.map(ScanModeDto::from),
            exposure_us: $settings.exposure_us,
            exposures_us: $settings.exposures_us,
            laser_power: $settings.laser_power,
            keep_frames: $settings.keep_frames,
            background: $settings.background.map(BackgroundDto::from),
            record: $settings.record,
        }
    };
}

with_scan_settings! {
    /// How a part is scanned: the fields of a scan request that are the same for every part. The calibration is the
    /// active one.
    #[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
    #[serde(deny_unknown_fields)]
    #[schema(example = json!({ "from_mm": -20, "to_mm": 20, "step_mm": 0.2 }))]
    pub struct ScanSettingsDto {}
}

with_scan_settings! {
    /// Request to scan a part.
    #[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
    #[serde(deny_unknown_fields)]
    #[schema(example = json!({ "source": { "kind": "station" }, "from_mm": -20, "to_mm": 20, "step_mm": 0.2 }))]
    pub struct StartScanDto {
        /// Source of the frames.
        pub source: ScanSourceDto,
        /// Name of the scan.
        #[schema(max_length = 100)]
        pub name: Option<String>,
        /// The calibration; default: the active one.
        pub calibration_id: Option<String>,
        /// The partial scan to resume; its own measurements apply.
        pub resume_scan_id: Option<String>,
        /// What is measured in the same job; the verdict does not depend on a connected client.
        #[serde(default)]
        #[schema(max_items = 50)]
        pub measure: Vec<MeasureDto>,
    }
}

with_scan_settings! {
    /// Scan a part: the fields of the request.
    #[derive(Debug, Serialize, ToSchema)]
    pub struct ScanJobDto {
        /// Source of the frames.
        pub source: ScanSourceDto,
        /// Name of the scan.
        pub name: Option<String>,
        /// The calibration; default: the active one.
        pub calibration_id: Option<String>,
        /// The partial scan to resume.
        pub resume_scan_id: Option<String>,
        /// What is measured in the same job.
        pub measure: Vec<MeasureDto>,
        /// Purpose of the scan.
        pub purpose: ScanPurposeDto,
    }
}

impl From<ScanSettingsDto> for ScanSettings {
    fn from(dto: ScanSettingsDto) -> Self {
        settings_of!(dto)
    }
}

impl From<ScanSettings> for ScanSettingsDto {
    fn from(settings: ScanSettings) -> Self {
        from_settings!(settings, ScanSettingsDto {})
    }
}

impl From<StartScanDto> for ScanInput {
    fn from(dto: StartScanDto) -> Self {
        Self {
            settings: settings_of!(dto),
            source: dto.source.into(),
            name: dto.name,
            calibration_id: dto.calibration_id,
            resume_scan_id: dto.resume_scan_id,
            measure: dto.measure.into_iter().map(MeasureInput::from).collect(),
            purpose: ScanPurpose::Production,
        }
    }
}

impl TryFrom<ScanInput> for ScanJobDto {
    type Error = UnknownCode;

    fn try_from(input: ScanInput) -> Result<Self, UnknownCode> {
        let settings = input.settings;
        Ok(from_settings!(
            settings,
            ScanJobDto {
                source: input.source.into(),
                name: input.name,
                calibration_id: input.calibration_id,
                resume_scan_id: input.resume_scan_id,
                measure: measure_dtos(input.measure)?,
                purpose: input.purpose.into(),
            }
        ))
    }
}
