//! A driver: one kind of device that a station can be made of, with its settings, able to open and to find devices.
//!
//! A driver is a value that holds its settings. Every kind is one module with one implementation, and one row in the
//! table of the program (`server/cli/src/drivers.rs`), which chooses by `[station.camera]`, `[station.stage]` and
//! `[station.laser]` who makes which device.

use std::borrow::Cow;
use std::fmt::Debug;

use remedy::Remedy;

use crate::{Camera, Laser, LaserError, Stage, StageError};

/// Some of a station's three devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct DeviceSet {
    /// The camera.
    pub camera: bool,
    /// The stage.
    pub stage: bool,
    /// The laser.
    pub laser: bool,
}

impl DeviceSet {
    /// Camera, stage and laser.
    pub const ALL: Self = Self { camera: true, stage: true, laser: true };

    /// Stage and laser, as one controller has them.
    pub const STAGE_AND_LASER: Self = Self { camera: false, stage: true, laser: true };

    /// Their names, in the order camera, stage, laser.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        [(self.camera, "camera"), (self.stage, "stage"), (self.laser, "laser")]
            .into_iter()
            .filter_map(|(there, name)| there.then_some(name))
    }

    /// Whether it holds none.
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// What either holds.
    pub fn or(self, other: Self) -> Self {
        Self {
            camera: self.camera || other.camera,
            stage: self.stage || other.stage,
            laser: self.laser || other.laser,
        }
    }

    /// What both hold.
    pub fn and(self, other: Self) -> Self {
        Self {
            camera: self.camera && other.camera,
            stage: self.stage && other.stage,
            laser: self.laser && other.laser,
        }
    }
}

/// Devices that were opened: those that were wanted, and no others.
#[derive(Default)]
pub struct Opened {
    /// The camera.
    pub camera: Option<Box<dyn Camera>>,
    /// The stage.
    pub stage: Option<Box<dyn Stage>>,
    /// The laser.
    pub laser: Option<Box<dyn Laser>>,
}

/// Why a driver could not open its devices.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The stage's controller is not as it must be.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The laser's.
    #[error(transparent)]
    Laser(#[from] LaserError),
    /// The settings make no device.
    #[error("{what}")]
    Settings {
        /// What is wrong with them.
        what: String,
        /// What to do about it.
        remedy: String,
    },
    /// What the settings name is not there; it may come.
    #[error("{what}")]
    Absent {
        /// What is missing.
        what: String,
        /// What to do about it.
        remedy: String,
    },
}

impl Remedy for OpenError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::Stage(error) => error.remedy(),
            Self::Laser(error) => error.remedy(),
            Self::Settings { remedy, .. } | Self::Absent { remedy, .. } => Some(Cow::Borrowed(remedy)),
        }
    }
}

/// A setting without which a driver has nothing to open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingSetting {
    /// Its name within the driver's table.
    pub name: &'static str,
    /// What it is to be set to.
    pub expected: &'static str,
}

/// A device that may be this driver's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The setting that chooses it.
    pub setting: &'static str,
    /// The setting's value for it.
    pub value: String,
    /// Who made it; empty if it does not say.
    pub vendor: String,
    /// Which model it is; empty if it does not say.
    pub model: String,
    /// Where it is, if that is not what chooses it: a network address.
    pub address: String,
    /// The program or computer that has it, as far as it tells; `None` if it is free, or does not tell.
    pub in_use_by: Option<String>,
}

impl Found {
    /// A device of which only what chooses it is known.
    pub fn by(setting: &'static str, value: String) -> Self {
        let unknown = String::new;
        Self { setting, value, vendor: unknown(), model: unknown(), address: unknown(), in_use_by: None }
    }
}

/// One kind of device, with its settings.
pub trait Driver: Debug + Send + Sync {
    /// Its name in the configuration, and that of the table with its settings: `[station.<kind>]`.
    fn kind(&self) -> &'static str;

    /// Which devices it can make.
    fn makes(&self) -> DeviceSet;

    /// Whether its devices are real ones; else pictures are computed or recorded.
    fn is_real(&self) -> bool {
        true
    }

    /// Whether its camera and its stage are nothing without each other: pictures of a recording were taken where its
    /// stage was.
    fn binds_camera_to_stage(&self) -> bool {
        false
    }

    /// Whether its laser is nothing without its camera, of which it is an output.
    fn binds_laser_to_camera(&self) -> bool {
        false
    }

    /// The first setting that is missing; without one it can be tried to open devices.
    fn missing(&self) -> Option<MissingSetting> {
        None
    }

    /// Opens what is wanted of [`Driver::makes`]: dark, at rest, stopped. May take seconds.
    ///
    /// # Errors
    /// [`OpenError`]; then nothing is open.
    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError>;

    /// Devices at this computer that may be its own; nothing is opened or sent.
    fn discover(&self) -> Vec<Found> {
        Vec::new()
    }
}
