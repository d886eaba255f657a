//! The driver's entry in the table: one axis of a device.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ZaberConfig, open};
use crate::traits::driver::{DeviceSet, Driver, Found, MissingSetting, OpenError, Opened};
use crate::{Stage, StageKind};

/// Longest opening of a device, within the timeout of the service's start.
const OPEN_LIMIT: Duration = Duration::from_millis(3500);

/// `[station.zaber]`: one axis of a device with Zaber's ASCII protocol.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ZaberSettings {
    /// serial port of the device, or tcp://host:port
    pub port: String,
    /// baud rate
    #[schemars(range(min = 9600, max = 115_200))]
    pub baud: u32,
    /// number of the device in its chain
    #[schemars(range(min = 1, max = 99))]
    pub address: u8,
    /// number of the axis
    #[schemars(range(min = 1, max = 9))]
    pub axis: u8,
    /// expected serial number; 0: any
    pub serial: u32,
    /// rotary stage: positions and speeds are degrees and °/s
    pub rotary: bool,
    /// travel in one turn of the motor, from the data sheet
    #[schemars(range(min = 1e-6, max = 1e4))]
    pub travel_per_turn_mm: f64,
    /// full steps in one turn of the motor
    #[schemars(range(min = 1, max = 10_000))]
    pub steps_per_turn: f64,
    /// lowest position of the stage
    #[schemars(range(min = -1e4, max = 1e4))]
    pub travel_from_mm: f64,
    /// highest position of the stage
    #[schemars(range(min = -1e4, max = 1e4))]
    pub travel_to_mm: f64,
    /// device position of the stage's zero
    #[schemars(range(min = -1e4, max = 1e4))]
    pub zero_at_device_mm: f64,
    /// whether the stage's scale is reversed relative to the device's
    pub reversed: bool,
}

impl Default for ZaberSettings {
    /// A stage of 100 mm with a 2 mm screw; the port must be given.
    fn default() -> Self {
        Self {
            port: String::new(),
            baud: 115_200,
            address: 1,
            axis: 1,
            serial: 0,
            rotary: false,
            travel_per_turn_mm: 2.0,
            steps_per_turn: 200.0,
            travel_from_mm: -40.0,
            travel_to_mm: 40.0,
            zero_at_device_mm: 50.0,
            reversed: false,
        }
    }
}

/// Creates the configured stage.
#[derive(Debug, Clone)]
pub struct ZaberDriver(pub ZaberSettings);

impl ZaberDriver {
    fn config(&self) -> ZaberConfig {
        let settings = &self.0;
        let travel_mm = (settings.travel_from_mm, settings.travel_to_mm);
        ZaberConfig {
            baud_rate: settings.baud,
            address: settings.address,
            axis: settings.axis,
            kind: if settings.rotary { StageKind::Rotary } else { StageKind::Linear },
            steps_per_turn: settings.steps_per_turn,
            zero_at_device_mm: settings.zero_at_device_mm,
            reversed: settings.reversed,
            expected_serial: Some(settings.serial).filter(|serial| *serial != 0),
            open_limit: OPEN_LIMIT,
            ..ZaberConfig::new(&settings.port, settings.travel_per_turn_mm, travel_mm)
        }
    }
}

impl Driver for ZaberDriver {
    fn kind(&self) -> &'static str {
        "zaber"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet { stage: true, ..DeviceSet::default() }
    }

    fn missing(&self) -> Option<MissingSetting> {
        let expected = "the serial port of the device";
        self.0.port.is_empty().then_some(MissingSetting { name: "port", expected })
    }

    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let stage = open(&self.config())?;
        Ok(Opened { stage: wanted.stage.then(|| Box::new(stage) as Box<dyn Stage>), ..Opened::default() })
    }

    /// Serial ports with a USB device.
    fn discover(&self) -> Vec<Found> {
        crate::lines::ports::ports_on_usb()
    }
}
