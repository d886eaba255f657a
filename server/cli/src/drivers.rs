//! The table of drivers: all device kinds, and which driver provides them.

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

/// `[station]`: which driver makes which device, and the settings of every driver.
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

/// Who makes a device.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct DeviceSettings {
    /// driver kind: twin, replay, genicam, v4l2 (camera), grbl, marlin, zaber, conveyor (stage) or none (laser that is always on); a laser of kind genicam is on an output line of that camera
    pub kind: String,
}

impl Default for DeviceSettings {
    fn default() -> Self {
        Self { kind: "twin".to_owned() }
    }
}

/// Why devices do not make a station.
#[derive(Debug, PartialEq)]
pub enum NoStation {
    /// No driver of that kind makes such a device.
    NoSuchKind {
        /// Which device.
        device: &'static str,
        /// The kinds that there are for it.
        known: Vec<&'static str>,
    },
    /// A driver is chosen and has nothing to open.
    Missing {
        /// The device it is to make.
        device: &'static str,
        /// Its kind.
        kind: &'static str,
        /// What is to be set.
        setting: MissingSetting,
        /// Values of that setting that were found at this computer.
        found: Vec<String>,
    },
    /// Two devices of different drivers, of which one is nothing without the other.
    Apart {
        /// The kind that must make both.
        kind: &'static str,
        /// The device that another one is to make.
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

/// The table, one row for each kind; the simulated world is also needed alone.
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

/// The devices at this computer that each kind of driver finds; nothing is opened.
pub fn found() -> Vec<(&'static str, DeviceSet, Vec<Found>)> {
    let (_, rows) = drivers(&StationSettings::default());
    rows.iter().map(|row| (row.kind(), row.makes(), row.discover())).collect()
}

/// The devices that the settings choose; nothing is opened.
///
/// # Errors
/// [`NoStation`] if a kind does not exist, has nothing to open, or does not go with the others.
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
    let makers = || rows.iter().filter(|row| row.makes().and(needed) == needed);
    let Some(driver) = makers().find(|row| row.kind() == kind) else {
        return Err(NoStation::NoSuchKind { device, known: makers().map(|row| row.kind()).collect() });
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
    fn every_combination_is_taken_but_those_that_lack_their_other_half() {
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
                        "one controller, opened once"
                    );
                }
            }
        }
    }

    #[test]
    fn a_kind_that_makes_no_such_device_is_refused_with_those_that_do() {
        let refused = station_devices(&settings("grbl", "grbl", "grbl")).unwrap_err();
        let known = vec!["twin", "replay", "genicam", "v4l2"];
        assert_eq!(refused, NoStation::NoSuchKind { device: "camera", known });
    }
}
