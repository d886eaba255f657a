//! The driver's entry in the table: stage and laser of one controller.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{GrblConfig, open};
use crate::traits::driver::{DeviceSet, Driver, Found, MissingSetting, OpenError, Opened};
use crate::{Laser, LaserError, Stage, StageKind};

/// Longest opening of a controller, within the timeout of the service's start.
const OPEN_LIMIT: Duration = Duration::from_millis(3500);

/// `[station.grbl]`: a controller that moves the stage, switches the laser, or both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GrblSettings {
    /// serial port of the controller, or tcp://host:port (telnet port of FluidNC)
    pub port: String,
    /// baud rate
    #[schemars(range(min = 1200, max = 10_000_000))]
    pub baud: u32,
    /// steps per millimetre, as set by $100 of the controller
    #[schemars(range(min = 0.001, max = 1e6))]
    pub steps_per_mm: f64,
    /// text that the response to $I must contain; empty: any
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
    /// rotary stage: positions and speeds are degrees and °/s
    pub rotary: bool,
}

impl Default for GrblSettings {
    /// A small stage with switches at its upper end; the port must be given.
    fn default() -> Self {
        Self {
            port: String::new(),
            baud: 115_200,
            steps_per_mm: 80.0,
            identity: String::new(),
            travel_from_mm: -40.0,
            travel_to_mm: 40.0,
            zero_at_machine_mm: -50.0,
            rotary: false,
        }
    }
}

/// Creates stage and laser of the configured controller.
#[derive(Debug, Clone)]
pub struct GrblDriver(pub GrblSettings);

impl GrblDriver {
    fn config(&self) -> GrblConfig {
        let settings = &self.0;
        GrblConfig {
            baud_rate: settings.baud,
            expected_name: Some(settings.identity.clone()).filter(|name| !name.is_empty()),
            zero_at_machine_mm: settings.zero_at_machine_mm,
            kind: if settings.rotary { StageKind::Rotary } else { StageKind::Linear },
            open_limit: OPEN_LIMIT,
            ..GrblConfig::new(
                &settings.port,
                settings.steps_per_mm,
                (settings.travel_from_mm, settings.travel_to_mm),
            )
        }
    }
}

impl Driver for GrblDriver {
    fn kind(&self) -> &'static str {
        "grbl"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet::STAGE_AND_LASER
    }

    fn missing(&self) -> Option<MissingSetting> {
        let expected = "the serial port of the controller, or tcp://host:port";
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
