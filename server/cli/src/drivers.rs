//! The table of drivers: which driver provides devices of which kind.

use std::sync::Arc;

use devices::always_on::AlwaysOnDriver;
use devices::conveyor::{ConveyorDriver, ConveyorSettings};
use devices::grbl::{GrblDriver, GrblSettings};
use devices::marlin::{MarlinDriver, MarlinSettings};
use devices::replay::{ReplayDriver, ReplaySettings};
use devices::zaber::{ZaberDriver, ZaberSettings};
use devices::{DeviceSet, Driver, Found, MissingSetting};
use genicam::{GenicamDriver, GenicamSettings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use station::StationDevices;
use twin::{TwinDriver, TwinSettings};
use v4l2::{V4l2Driver, V4l2Settings};

/// `[station]`: the driver of each device, and the settings of all drivers.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
pub struct StationSettings {
    /// `[station.camera]`.
    pub camera: DeviceSettings,
    /// `[station.stage]`.
    pub stage: DeviceSettings,
    /// `[station.laser]`.
    pub laser: DeviceSettings,
    /// `[station.twin]`.
    pub twin: TwinSettings,
    /// `[station.replay]`.
    pub replay: ReplaySettings,
    /// `[station.grbl]`.
    pub grbl: GrblSettings,
    /// `[station.zaber]`.
    pub zaber: ZaberSettings,
    /// `[station.marlin]`.
    pub marlin: MarlinSettings,
    /// `[station.conveyor]`.
    pub conveyor: ConveyorSettings,
    /// `[station.genicam]`.
    pub genicam: GenicamSettings,
    /// `[station.v4l2]`.
    pub v4l2: V4l2Settings,
}

/// Driver of a device.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct DeviceSettings {
    /// driver kind: twin, replay, genicam, v4l2 (camera), grbl, marlin, zaber, conveyor (stage) or none (laser that is
    /// always on); a laser of kind genicam is on an output line of that camera
    pub kind: String,
}

impl Default for DeviceSettings {
    fn default() -> Self {
        Self { kind: "twin".to_owned() }
    }
}

/// Why devices cannot form a station.
#[derive(Debug, PartialEq)]
pub enum NoStation {
    /// No driver of this kind provides such a device.
    NoSuchKind {
        /// The device.
        device: &'static str,
        /// The available kinds.
        known: Vec<&'static str>,
    },
    /// A setting that the chosen driver requires is missing.
    Missing {
        /// The device.
        device: &'static str,
        /// Kind of the driver.
        kind: &'static str,
        /// The missing setting.
        setting: MissingSetting,
        /// Values for it found on this computer.
        found: Vec<String>,
    },
    /// Two devices of different drivers, one of which works only with the other of its own driver.
    Apart {
        /// The kind that both must have.
        kind: &'static str,
        /// The device with another kind.
        device: &'static str,
    },
}

impl NoStation {
    /// The setting at fault.
    pub fn key(&self) -> String {
        let (Self::NoSuchKind { device, .. } | Self::Missing { device, .. } | Self::Apart { device, .. }) = self;
        format!("station.{device}.kind")
    }
}

/// The drivers, one per kind; the twin driver is also returned separately.
fn drivers(settings: &StationSettings) -> (Arc<TwinDriver>, Vec<Arc<dyn Driver>>) {
    let twin = Arc::new(TwinDriver::new(settings.twin.clone()));
    let rows: Vec<Arc<dyn Driver>> = vec![
        twin.clone(),
        Arc::new(ReplayDriver(settings.replay.clone())),
        Arc::new(GrblDriver(settings.grbl.clone())),
        Arc::new(ZaberDriver(settings.zaber.clone())),
        Arc::new(MarlinDriver(settings.marlin.clone())),
        Arc::new(ConveyorDriver(settings.conveyor.clone())),
        Arc::new(AlwaysOnDriver),
        Arc::new(GenicamDriver(settings.genicam.clone())),
        Arc::new(V4l2Driver(settings.v4l2.clone())),
    ];
    (twin, rows)
}

/// The devices on this computer found by each driver; none is opened.
pub fn found() -> Vec<(&'static str, DeviceSet, Vec<Found>)> {
    let (_, rows) = drivers(&StationSettings::default());
    rows.iter().map(|row| (row.kind(), row.makes(), row.discover())).collect()
}

/// The drivers of the configured devices; none is opened.
///
/// # Errors
/// [`NoStation`] if a kind does not exist, lacks a required setting, or cannot be combined with the others.
pub fn station_devices(settings: &StationSettings) -> Result<StationDevices, NoStation> {
    let (twin, rows) = drivers(settings);
    let none = DeviceSet::default();
    let camera = chosen(&rows, "camera", DeviceSet { camera: true, ..none }, &settings.camera.kind)?;
    let stage = chosen(&rows, "stage", DeviceSet { stage: true, ..none }, &settings.stage.kind)?;
    let laser = chosen(&rows, "laser", DeviceSet { laser: true, ..none }, &settings.laser.kind)?;
    if camera.kind() != stage.kind() {
        for (binding, device) in [(&camera, "stage"), (&stage, "camera")] {
            if binding.binds_camera_to_stage() {
                return Err(NoStation::Apart { kind: binding.kind(), device });
            }
        }
    }
    if laser.kind() != camera.kind() && laser.binds_laser_to_camera() {
        return Err(NoStation::Apart { kind: laser.kind(), device: "camera" });
    }
    let twin = (camera.kind() == twin.kind()).then_some(twin);
    Ok(StationDevices { camera, stage, laser, twin })
}

fn chosen(
    rows: &[Arc<dyn Driver>],
    device: &'static str,
    needed: DeviceSet,
    kind: &str,
) -> Result<Arc<dyn Driver>, NoStation> {
    let providers = || rows.iter().filter(|row| row.makes().and(needed) == needed);
    let Some(driver) = providers().find(|row| row.kind() == kind) else {
        return Err(NoStation::NoSuchKind { device, known: providers().map(|row| row.kind()).collect() });
    };
    match driver.missing() {
        None => Ok(driver.clone()),
        Some(setting) => {
            let found = driver.discover().into_iter().filter(|found| found.setting == setting.name);
            let found = found.map(|found| found.value).collect();
            Err(NoStation::Missing { device, kind: driver.kind(), setting, found })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(camera: &str, stage: &str, laser: &str) -> StationSettings {
        let of = |kind: &str| DeviceSettings { kind: kind.to_owned() };
        StationSettings {
            camera: of(camera),
            stage: of(stage),
            laser: of(laser),
            twin: TwinSettings::default(),
            replay: ReplaySettings { folder: "capture".into(), ..ReplaySettings::default() },
            grbl: GrblSettings { port: "/dev/ttyACM0".to_owned(), ..GrblSettings::default() },
            zaber: ZaberSettings { port: "/dev/ttyUSB0".to_owned(), ..ZaberSettings::default() },
            marlin: MarlinSettings { port: "/dev/ttyUSB1".to_owned(), ..MarlinSettings::default() },
            conveyor: ConveyorSettings::default(),
            genicam: GenicamSettings { serial: "1".to_owned(), ..GenicamSettings::default() },
            v4l2: V4l2Settings { device: "/dev/video0".to_owned(), ..V4l2Settings::default() },
        }
    }

    #[test]
    fn every_combination_is_accepted_except_separated_pairs() {
        for camera in ["twin", "replay", "genicam", "v4l2"] {
            for stage in ["twin", "replay", "grbl", "zaber", "marlin", "conveyor"] {
                for laser in ["twin", "replay", "grbl", "marlin", "none", "genicam"] {
                    let made = station_devices(&settings(camera, stage, laser));
                    let apart =
                        (camera == "replay") != (stage == "replay") || (laser == "genicam" && camera != "genicam");
                    assert_eq!(made.is_err(), apart, "{camera}, {stage}, {laser}: {made:?}");
                    let Ok(made) = made else { continue };
                    let kinds = [made.camera.kind(), made.stage.kind(), made.laser.kind()];
                    assert_eq!(kinds, [camera, stage, laser]);
                    assert_eq!(made.twin.is_some(), camera == "twin");
                    assert_eq!(
                        Arc::ptr_eq(&made.stage, &made.laser),
                        stage == laser,
                        "one controller is opened once"
                    );
                }
            }
        }
    }

    #[test]
    fn a_kind_without_such_a_device_is_refused_with_the_available_kinds() {
        let refused = station_devices(&settings("grbl", "grbl", "grbl")).unwrap_err();
        let known = vec!["twin", "replay", "genicam", "v4l2"];
        assert_eq!(refused, NoStation::NoSuchKind { device: "camera", known });
    }
}
