//! Camera, stage and laser on the wire.

mod camera;
mod laser;
mod stage;

use devices::{DeviceIdentity, ValueRange};
use serde::Serialize;
use utoipa::ToSchema;

pub use camera::{CameraDto, CameraSettingsDto, ChangeCameraDto};
pub use laser::{LaserDto, SetLaserDto};
pub use stage::{JogDto, MotionDto, MoveDto, StageDto};

/// What a device says about itself.
#[derive(Debug, Serialize, ToSchema)]
pub struct IdentityDto {
    /// The driver: `twin`, `replay`, `grbl`.
    pub driver: &'static str,
    /// Who made it.
    pub vendor: String,
    /// Which model.
    pub model: String,
    /// Which one of them.
    pub serial: String,
    /// Version of its firmware.
    pub firmware: String,
}

/// What a number may be set to.
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
