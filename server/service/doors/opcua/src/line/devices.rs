//! The devices of the station as clients see them.

use app::doors::{DeviceIdentity, LaserLight, StationStatus};

/// What is known of the devices; `None` while one is not connected.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Devices {
    /// What the camera is.
    pub camera: Option<DeviceIdentity>,
    /// What the controller of the stage is.
    pub stage: Option<DeviceIdentity>,
    /// What the laser is.
    pub laser: Option<DeviceIdentity>,
    /// Frames that were lost since the service started.
    pub frames_lost: Option<u64>,
    /// Whether the stage is homed.
    pub homed: Option<bool>,
    /// Light of the laser: `off`, `armed`, `on`, `unknown`, `not_controlled`.
    pub light: Option<&'static str>,
    /// Whether the interlock is closed; also `None` if the laser does not report it.
    pub interlock_closed: Option<bool>,
}

impl Devices {
    /// Those of this status.
    pub fn of(status: &StationStatus) -> Self {
        let (camera, stage, laser) = (&status.camera, &status.stage, &status.laser);
        let frames_lost = status.frames_dropped.iter().map(|(_, count)| count).sum();
        Self {
            camera: camera.connected.then(|| camera.identity.clone()),
            stage: stage.connected.then(|| stage.identity.clone()),
            laser: laser.connected.then(|| laser.identity.clone()),
            frames_lost: camera.connected.then_some(frames_lost),
            homed: stage.connected.then_some(status.homed),
            light: laser.connected.then_some(light(status.laser_light)),
            interlock_closed: status.interlock_closed.filter(|_| laser.connected),
        }
    }
}

fn light(of: LaserLight) -> &'static str {
    match of {
        LaserLight::NotControlled => "not_controlled",
        LaserLight::Off => "off",
        LaserLight::Armed => "armed",
        LaserLight::On => "on",
        LaserLight::Unknown => "unknown",
    }
}
