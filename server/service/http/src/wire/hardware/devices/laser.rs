//! The laser on the wire.

use serde::{Deserialize, Serialize};
use station::{LaserLight, StationStatus};
use utoipa::ToSchema;

use crate::wire::hardware::devices::{IdentityDto, RangeDto};

/// Whether there is laser light.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightDto {
    /// Dark.
    Off,
    /// It may be turned on at any moment.
    Armed,
    /// Shining.
    On,
    /// It cannot be reached: treat it as shining.
    Unknown,
    /// This program does not switch it: it is on as long as it has power, also after Stop and after a fault.
    NotControlled,
}

/// The laser.
#[derive(Debug, Serialize, ToSchema)]
pub struct LaserDto {
    /// Whether it answers.
    pub connected: bool,
    /// Which one.
    pub identity: IdentityDto,
    /// Powers as shares of full power; missing: on and off only.
    pub powers: Option<RangeDto>,
    /// Whether it is on.
    pub light: LightDto,
    /// Share of full power.
    pub power: f64,
    /// Whether the interlock is closed; missing if it is not read back.
    pub interlock_closed: Option<bool>,
}

/// The laser power to set.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetLaserDto {
    /// Share of full power; 0 is off. It is on only while frames arrive.
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
                LaserLight::Off => LightDto::Off,
                LaserLight::Armed => LightDto::Armed,
                LaserLight::On => LightDto::On,
                LaserLight::Unknown => LightDto::Unknown,
                LaserLight::NotControlled => LightDto::NotControlled,
            },
            power: status.laser_power,
            interlock_closed: status.interlock_closed,
        }
    }
}
