//! The camera on the wire.

use devices::{CameraRequest, CameraSettings, PixelFormat, Roi, Trigger};
use serde::{Deserialize, Serialize};
use station::StationStatus;
use utoipa::ToSchema;

use crate::wire::hardware::dark_frame::DarkFrameUseDto;
use crate::wire::hardware::devices::{IdentityDto, RangeDto};

/// Trigger mode of the camera.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TriggerDto {
    /// Free-running.
    Free,
    /// Software trigger.
    Software,
    /// Hardware trigger input.
    Hardware,
}

/// Pixel format.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PixelFormatDto {
    /// 8 bits.
    Mono8,
    /// 16 bits.
    Mono16,
}

/// Region of interest of the sensor.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RoiDto {
    /// First column.
    pub left_px: u32,
    /// First row.
    pub top_px: u32,
    /// Columns.
    #[schema(minimum = 1)]
    pub width_px: u32,
    /// Rows.
    #[schema(minimum = 1)]
    pub height_px: u32,
}

/// Camera settings.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct CameraSettingsDto {
    /// Exposure time.
    pub exposure_us: f64,
    /// Gain.
    pub gain_db: f64,
    /// Frame rate in free-running mode.
    pub frame_rate_hz: f64,
    /// Trigger mode.
    pub trigger: TriggerDto,
    /// Pixel format.
    pub pixel_format: PixelFormatDto,
    /// Region of interest.
    pub roi: RoiDto,
}

/// Settings to change; absent settings are not changed. The camera uses the nearest supported value.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ChangeCameraDto {
    /// Exposure time.
    #[schema(minimum = 0.0, example = 1000.0)]
    pub exposure_us: Option<f64>,
    /// Gain.
    pub gain_db: Option<f64>,
    /// Frame rate in free-running mode.
    #[schema(minimum = 0.0)]
    pub frame_rate_hz: Option<f64>,
    /// Trigger mode.
    pub trigger: Option<TriggerDto>,
    /// Pixel format.
    pub pixel_format: Option<PixelFormatDto>,
    /// Region of interest.
    pub roi: Option<RoiDto>,
}

/// Capabilities of the camera; a range is absent if the camera lacks the setting.
#[derive(Debug, Serialize, ToSchema)]
pub struct CameraCapabilitiesDto {
    /// Sensor width.
    pub width_px: usize,
    /// Sensor height.
    pub height_px: usize,
    /// Range of exposure times.
    pub exposure_us: Option<RangeDto>,
    /// Range of gains.
    pub gain_db: Option<RangeDto>,
    /// Range of frame rates in free-running mode.
    pub frame_rate_hz: Option<RangeDto>,
    /// Supported trigger modes.
    pub triggers: Vec<TriggerDto>,
    /// Supported pixel formats.
    pub pixel_formats: Vec<PixelFormatDto>,
    /// Whether the camera supports a region of interest.
    pub roi: bool,
}

/// The camera.
#[derive(Debug, Serialize, ToSchema)]
pub struct CameraDto {
    /// Whether the device is connected.
    pub connected: bool,
    /// Vendor, model and serial number.
    pub identity: IdentityDto,
    /// Capabilities.
    pub capabilities: CameraCapabilitiesDto,
    /// Current settings.
    pub settings: CameraSettingsDto,
    /// How frames are corrected for what the sensor shows without light.
    pub dark_frame: DarkFrameUseDto,
    /// Frame rate over the last second.
    pub measured_rate_hz: f64,
}

impl From<Trigger> for TriggerDto {
    fn from(trigger: Trigger) -> Self {
        match trigger {
            Trigger::Free => Self::Free,
            Trigger::Software => Self::Software,
            Trigger::Hardware => Self::Hardware,
        }
    }
}

impl From<TriggerDto> for Trigger {
    fn from(dto: TriggerDto) -> Self {
        match dto {
            TriggerDto::Free => Self::Free,
            TriggerDto::Software => Self::Software,
            TriggerDto::Hardware => Self::Hardware,
        }
    }
}

impl From<PixelFormat> for PixelFormatDto {
    fn from(format: PixelFormat) -> Self {
        match format {
            PixelFormat::Mono8 => Self::Mono8,
            PixelFormat::Mono16 => Self::Mono16,
        }
    }
}

impl From<PixelFormatDto> for PixelFormat {
    fn from(dto: PixelFormatDto) -> Self {
        match dto {
            PixelFormatDto::Mono8 => Self::Mono8,
            PixelFormatDto::Mono16 => Self::Mono16,
        }
    }
}

impl From<&CameraSettings> for CameraSettingsDto {
    fn from(settings: &CameraSettings) -> Self {
        let px = |px: usize| u32::try_from(px).unwrap_or(u32::MAX);
        Self {
            exposure_us: settings.exposure_us,
            gain_db: settings.gain_db,
            frame_rate_hz: settings.frame_rate_hz,
            trigger: settings.trigger.into(),
            pixel_format: settings.pixel_format.into(),
            roi: RoiDto {
                left_px: px(settings.roi.left_px),
                top_px: px(settings.roi.top_px),
                width_px: px(settings.roi.width_px),
                height_px: px(settings.roi.height_px),
            },
        }
    }
}

impl From<ChangeCameraDto> for CameraRequest {
    fn from(dto: ChangeCameraDto) -> Self {
        Self {
            exposure_us: dto.exposure_us,
            gain_db: dto.gain_db,
            frame_rate_hz: dto.frame_rate_hz,
            trigger: dto.trigger.map(Trigger::from),
            pixel_format: dto.pixel_format.map(PixelFormat::from),
            roi: dto.roi.map(|roi| Roi {
                left_px: roi.left_px as usize,
                top_px: roi.top_px as usize,
                width_px: roi.width_px as usize,
                height_px: roi.height_px as usize,
            }),
        }
    }
}

impl From<&StationStatus> for CameraDto {
    fn from(status: &StationStatus) -> Self {
        let can = &status.camera.capabilities;
        Self {
            connected: status.camera.connected,
            identity: (&status.camera.identity).into(),
            capabilities: CameraCapabilitiesDto {
                width_px: can.sensor_px.0,
                height_px: can.sensor_px.1,
                exposure_us: can.exposure_us.map(RangeDto::from),
                gain_db: can.gain_db.map(RangeDto::from),
                frame_rate_hz: can.frame_rate_hz.map(RangeDto::from),
                triggers: can.triggers.iter().map(|&trigger| trigger.into()).collect(),
                pixel_formats: can.pixel_formats.iter().map(|&format| format.into()).collect(),
                roi: can.roi,
            },
            settings: (&status.camera_settings).into(),
            dark_frame: status.dark_frame_use.into(),
            measured_rate_hz: status.frame_rate_hz,
        }
    }
}
