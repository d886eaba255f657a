//! The laser on the wire.

use serde::{Deserialize, Serialize};
use station::{LaserLight, StationStatus};
use utoipa::ToSchema;

use crate::wire::hardware::devices::{IdentityDto, RangeDto};

/// Whether the laser emits.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LaserLightDto {
    /// Off.
    Off,
    /// Armed: it may be turned on at any moment.
    Armed,
    /// On.
    On,
    /// The laser cannot be reached: treat it as on.
    Unknown,
    /// Not switched by this program: on as long as it has power, also after Stop and after a fault.
    NotControlled,
}

/// The laser.
#[derive(Debug, Serialize, ToSchema)]
pub struct LaserDto {
    /// Whether the device is connected.
    pub connected: bool,
    /// Vendor, model and serial number.
    pub identity: IdentityDto,
    /// Range of power as a fraction of full power; absent if the laser can only be on or off.
    pub powers: Option<RangeDto>,
    /// Whether it emits.
    pub light: LaserLightDto,
    /// Current power, fraction of full power.
    pub power: f64,
    /// Whether the interlock is closed; absent if it is not read back.
    pub interlock_closed: Option<bool>,
}

/// Request to set the laser power.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetLaserDto {
    /// Fraction of full power; 0 is off. The laser is on only while frames arrive.
    #[schema(minimum = 0.0, maximum = 1.0)]
    pub power: f64,
}

impl From<&StationStatus> for LaserDto {
    fn from(status: &StationStatus) -> Self {
        Self {
            connected: status.laser.connected,
            identity: (&status.laser.identity).into(),
            powers: status.laser.capabilities.power.map(RangeDto::from),
            light: match status.laser_light {
                LaserLight::Off => LaserLightDto::Off,
                LaserLight::Armed => LaserLightDto::Armed,
                LaserLight::On => LaserLightDto::On,
                LaserLight::Unknown => LaserLightDto::Unknown,
                LaserLight::NotControlled => LaserLightDto::NotControlled,
            },
            power: status.laser_power,
            interlock_closed: status.interlock_closed,
        }
    }
}
