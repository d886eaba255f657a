//! The user's camera settings, kept across restarts and disconnections.
//!
//! Only settings that a user changed are kept, with the value that the camera accepted; jobs change settings
//! temporarily and restore them.

use devices::{CameraRequest, CameraSettings, PixelFormat, Roi, Trigger};
use serde::{Deserialize, Serialize};
use serde_json::json;
use station::wall_clock::now_ms;
use station::{Manual, StationHandle};
use store::{Change, SettingRecord, StoreError};
use utoipa::ToSchema;

use crate::evented_catalogue::EventedCatalogue;

/// The name of the setting.
const SETTING: &str = "camera.settings";

/// The user's camera settings as stored and published; settings that no user changed are absent.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct StoredCameraSettings {
    /// Exposure time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_us: Option<f64>,
    /// Gain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_db: Option<f64>,
    /// Frame rate in free-running mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_rate_hz: Option<f64>,
    /// Trigger mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trigger: Option<StoredTrigger>,
    /// Pixel format.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_format: Option<StoredPixelFormat>,
    /// Region of interest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roi: Option<StoredRoi>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
/// Trigger mode of the camera.
pub enum StoredTrigger {
    /// Free-running.
    Free,
    /// Software trigger.
    Software,
    /// Hardware trigger input.
    Hardware,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
/// Pixel format.
pub enum StoredPixelFormat {
    /// 8 bits.
    Mono8,
    /// 16 bits.
    Mono16,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
/// Region of interest of the sensor.
pub struct StoredRoi {
    /// First column.
    pub left_px: usize,
    /// First row.
    pub top_px: usize,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
}

impl StoredCameraSettings {
    /// All settings, as the camera `accepted` them.
    pub fn all(accepted: &CameraSettings) -> Self {
        let every = CameraRequest {
            exposure_us: Some(accepted.exposure_us),
            gain_db: Some(accepted.gain_db),
            frame_rate_hz: Some(accepted.frame_rate_hz),
            trigger: Some(accepted.trigger),
            pixel_format: Some(accepted.pixel_format),
            roi: Some(accepted.roi),
        };
        let mut settings = Self::default();
        settings.note(&every, accepted);
        settings
    }

    /// Merges the settings in `asked`, with the `accepted` values.
    fn note(&mut self, asked: &CameraRequest, accepted: &CameraSettings) {
        self.exposure_us = asked.exposure_us.map(|_| accepted.exposure_us).or(self.exposure_us);
        self.gain_db = asked.gain_db.map(|_| accepted.gain_db).or(self.gain_db);
        self.frame_rate_hz = asked.frame_rate_hz.map(|_| accepted.frame_rate_hz).or(self.frame_rate_hz);
        let trigger = match accepted.trigger {
            Trigger::Free => StoredTrigger::Free,
            Trigger::Software => StoredTrigger::Software,
            Trigger::Hardware => StoredTrigger::Hardware,
        };
        self.trigger = asked.trigger.map(|_| trigger).or(self.trigger);
        let format = match accepted.pixel_format {
            PixelFormat::Mono8 => StoredPixelFormat::Mono8,
            PixelFormat::Mono16 => StoredPixelFormat::Mono16,
        };
        self.pixel_format = asked.pixel_format.map(|_| format).or(self.pixel_format);
        let Roi { left_px, top_px, width_px, height_px } = accepted.roi;
        self.roi = asked.roi.map(|_| StoredRoi { left_px, top_px, width_px, height_px }).or(self.roi);
    }

    fn request(&self) -> CameraRequest {
        CameraRequest {
            exposure_us: self.exposure_us,
            gain_db: self.gain_db,
            frame_rate_hz: self.frame_rate_hz,
            trigger: self.trigger.map(|trigger| match trigger {
                StoredTrigger::Free => Trigger::Free,
                StoredTrigger::Software => Trigger::Software,
                StoredTrigger::Hardware => Trigger::Hardware,
            }),
            pixel_format: self.pixel_format.map(|format| match format {
                StoredPixelFormat::Mono8 => PixelFormat::Mono8,
                StoredPixelFormat::Mono16 => PixelFormat::Mono16,
            }),
            roi: self.roi.map(|StoredRoi { left_px, top_px, width_px, height_px }| Roi {
                left_px,
                top_px,
                width_px,
                height_px,
            }),
        }
    }
}

/// Stores the settings in `asked`, with the `accepted` values.
///
/// # Errors
/// If the catalogue cannot be used.
pub async fn remember(
    catalogue: &EventedCatalogue,
    asked: &CameraRequest,
    accepted: &CameraSettings,
) -> Result<(), StoreError> {
    let mut kept = read(catalogue).await?.unwrap_or_default();
    kept.note(asked, accepted);
    let setting = SettingRecord { name: SETTING.to_owned(), value: json!(kept), changed_at_ms: now_ms() };
    catalogue.commit(vec![Change::PutSetting(setting)]).await?;
    Ok(())
}

/// The stored settings; unreadable ones count as none and are logged.
async fn read(catalogue: &EventedCatalogue) -> Result<Option<StoredCameraSettings>, StoreError> {
    let Some(setting) = catalogue.read().setting(SETTING).await? else { return Ok(None) };
    let kept = serde_json::from_value(setting.value);
    Ok(kept.inspect_err(|error| tracing::error!(%error, "stored camera settings are invalid")).ok())
}

/// Applies the stored settings; for a disconnected camera, once it is connected.
pub async fn restore(catalogue: &EventedCatalogue, station: &StationHandle) {
    let wanted = match read(catalogue).await {
        Ok(Some(kept)) => kept.request(),
        Ok(None) => return,
        Err(error) => return tracing::error!(%error, "stored camera settings cannot be read"),
    };
    if let Err(refusal) = station.manual(Manual::Configure(wanted)).await {
        tracing::warn!(%refusal, "stored camera settings were not applied");
    }
}

/// Reapplies the settings whenever the camera reconnects; ends with the station.
pub async fn follow(catalogue: EventedCatalogue, station: StationHandle) {
    let mut status = station.watch_status();
    loop {
        if status.wait_for(|status| !status.camera.connected).await.is_err()
            || status.wait_for(|status| status.camera.connected).await.is_err()
        {
            return;
        }
        restore(&catalogue, &station).await;
    }
}
