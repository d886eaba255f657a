//! Camera, stage and laser on the wire.

mod camera;
mod laser;
pub mod stage;

use devices::{DeviceIdentity, ValueRange};
use serde::Serialize;
use utoipa::ToSchema;

pub use camera::{CameraDto, CameraSettingsDto, ChangeCameraDto};
pub use laser::{LaserDto, SetLaserDto};
pub use stage::{JogDto, MotionDto, MoveDto, StageDto};

/// Identity of a device, as it reports it.
#[derive(Debug, Serialize, ToSchema)]
pub struct IdentityDto {
    /// Driver, such as `twin`, `replay` or `grbl`.
    pub driver: &'static str,
    /// Vendor.
    pub vendor: String,
    /// Model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Firmware version.
    pub firmware: String,
}

/// Allowed range of a number.
#[derive(Debug, Serialize, ToSchema)]
pub struct RangeDto {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

impl From<&DeviceIdentity> for IdentityDto {
    fn from(identity: &DeviceIdentity) -> Self {
        Self {
            driver: identity.driver,
            vendor: identity.vendor.clone(),
            model: identity.model.clone(),
            serial: identity.serial.clone(),
            firmware: identity.firmware.clone(),
        }
    }
}

impl From<ValueRange> for RangeDto {
    fn from(range: ValueRange) -> Self {
        Self { min: range.min, max: range.max }
    }
}
