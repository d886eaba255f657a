//! The driver's entry in the table: stage and laser of one controller.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{MarlinConfig, open};
use crate::traits::driver::{DeviceSet, Driver, Found, MissingSetting, OpenError, Opened};
use crate::{Laser, LaserError, Stage, StageKind};

/// Longest opening of a controller, within the timeout of the service's start.
const OPEN_LIMIT: Duration = Duration::from_millis(3500);

/// `[station.marlin]`: a controller that moves the stage, switches the laser, or both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MarlinSettings {
    /// serial port of the controller, or tcp://host:port
    pub port: String,
    /// baud rate
    #[schemars(range(min = 1200, max = 10_000_000))]
    pub baud: u32,
    /// steps per millimetre, as set by M92 of the controller
    #[schemars(range(min = 0.001, max = 1e6))]
    pub steps_per_mm: f64,
    /// text that the response to M115 must contain; empty: any
    pub identity: String,
    /// lowest position of the stage
    #[schemars(range(min = -1e4, max = 1e4))]
    pub travel_from_mm: f64,
    /// highest position of the stage
    #[schemars(range(min = -1e4, max = 1e4))]
    pub travel_to_mm: f64,
    /// machine position of the stage's zero
    #[schemars(range(min = -1e4, max = 1e4))]
    pub zero_at_machine_mm: f64,
    /// S of M3 at full power
    #[schemars(range(min = 1, max = 65_535))]
    pub power_at_full: f64,
    /// rotary stage: positions and speeds are degrees and °/s
    pub rotary: bool,
    /// whether the stage's scale is reversed relative to the machine's
    pub reversed: bool,
}

impl Default for MarlinSettings {
    /// A small stage with its switch at the lower end; the port must be given.
    fn default() -> Self {
        Self {
            port: String::new(),
            baud: 115_200,
            steps_per_mm: 80.0,
            identity: String::new(),
            travel_from_mm: -40.0,
            travel_to_mm: 40.0,
            zero_at_machine_mm: 50.0,
            power_at_full: 255.0,
            rotary: false,
            reversed: false,
        }
    }
}

/// Creates stage and laser of the configured controller.
#[derive(Debug, Clone)]
pub struct MarlinDriver(pub MarlinSettings);

impl MarlinDriver {
    fn config(&self) -> MarlinConfig {
        let settings = &self.0;
        MarlinConfig {
            baud_rate: settings.baud,
            expected_name: Some(settings.identity.clone()).filter(|name| !name.is_empty()),
            zero_at_machine_mm: settings.zero_at_machine_mm,
            full_power: settings.power_at_full,
            kind: if settings.rotary { StageKind::Rotary } else { StageKind::Linear },
            reversed: settings.reversed,
            open_limit: OPEN_LIMIT,
            ..MarlinConfig::new(
                &settings.port,
                settings.steps_per_mm,
                (settings.travel_from_mm, settings.travel_to_mm),
            )
        }
    }
}

impl Driver for MarlinDriver {
    fn kind(&self) -> &'static str {
        "marlin"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet::STAGE_AND_LASER
    }

    fn missing(&self) -> Option<MissingSetting> {
        let expected = "the serial port of the controller";
        self.0.port.is_empty().then_some(MissingSetting { name: "port", expected })
    }

    /// Both belong to one controller, which is opened and checked as a whole whichever is requested.
    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let (stage, laser) = open(&self.config()).map_err(|error| match wanted.stage {
            true => OpenError::Stage(error),
            false => OpenError::Laser(LaserError::Disconnected { reason: error.to_string() }),
        })?;
        Ok(Opened {
            camera: None,
            stage: wanted.stage.then(|| Box::new(stage) as Box<dyn Stage>),
            laser: wanted.laser.then(|| Box::new(laser) as Box<dyn Laser>),
        })
    }

    /// Serial ports with a USB device.
    fn discover(&self) -> Vec<Found> {
        crate::lines::ports::ports_on_usb()
    }
}
