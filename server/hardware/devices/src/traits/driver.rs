//! A driver: one kind of device of a station, with its settings, which can open and discover devices.
//!
//! A driver is a value that holds its settings. Every kind is one module with one implementation, and one entry in the
//! table of the program (`server/cli/src/drivers.rs`), which selects the driver of each device by `[station.camera]`,
//! `[station.stage]` and
//! `[station.laser]`.

use std::borrow::Cow;
use std::fmt::Debug;

use remedy::Remedy;

use crate::{Camera, Laser, LaserError, Stage, StageError};

/// A subset of a station's three devices.
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

    /// Whether it is empty.
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }

    /// Union.
    pub fn or(self, other: Self) -> Self {
        Self {
            camera: self.camera || other.camera,
            stage: self.stage || other.stage,
            laser: self.laser || other.laser,
        }
    }

    /// Intersection.
    pub fn and(self, other: Self) -> Self {
        Self {
            camera: self.camera && other.camera,
            stage: self.stage && other.stage,
            laser: self.laser && other.laser,
        }
    }
}

/// Open devices: exactly those requested.
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
    /// Error of the stage's controller.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// Error of the laser.
    #[error(transparent)]
    Laser(#[from] LaserError),
    /// Invalid settings.
    #[error("{what}")]
    Settings {
        /// What is wrong with them.
        what: String,
        /// What to do about it.
        remedy: String,
    },
    /// The configured device is absent; it may appear later.
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

/// A required setting that is missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingSetting {
    /// Its name within the driver's table.
    pub name: &'static str,
    /// Expected value.
    pub expected: &'static str,
}

/// A device that this driver may use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The setting that selects it.
    pub setting: &'static str,
    /// The setting's value for it.
    pub value: String,
    /// Its vendor; empty if unknown.
    pub vendor: String,
    /// Its model; empty if unknown.
    pub model: String,
    /// Its network address, if that does not select it.
    pub address: String,
    /// The program or computer that uses it, if known; `None` if it is free, or unknown.
    pub in_use_by: Option<String>,
}

impl Found {
    /// A device of which only the selecting setting is known.
    pub fn by(setting: &'static str, value: String) -> Self {
        let unknown = String::new;
        Self { setting, value, vendor: unknown(), model: unknown(), address: unknown(), in_use_by: None }
    }
}

/// A driver for one kind of device, with its settings.
pub trait Driver: Debug + Send + Sync {
    /// Its name in the configuration, which is also the name of its settings table: `[station.<kind>]`.
    fn kind(&self) -> &'static str;

    /// The devices it can create.
    fn makes(&self) -> DeviceSet;

    /// Whether its devices are real, as opposed to simulated or recorded.
    fn is_real(&self) -> bool {
        true
    }

    /// Whether its camera and its stage must be used together: images of a recording were taken at the positions of
    /// its stage.
    fn binds_camera_to_stage(&self) -> bool {
        false
    }

    /// Whether its laser requires its camera, of which it is an output.
    fn binds_laser_to_camera(&self) -> bool {
        false
    }

    /// The first missing setting; if there is none, opening can be tried.
    fn missing(&self) -> Option<MissingSetting> {
        None
    }

    /// Opens the requested devices among [`Driver::makes`]: laser off, at rest, acquisition stopped. May take seconds.
    ///
    /// # Errors
    /// [`OpenError`]; then nothing is open.
    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError>;

    /// Devices at this computer that it may use; nothing is opened or sent.
    fn discover(&self) -> Vec<Found> {
        Vec::new()
    }
}
