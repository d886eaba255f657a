//! The driver's entry in the table: camera, stage and laser of a recording.

use std::path::PathBuf;

use remedy::with_causes;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    ImageSelection, Pace, ReplayCamera, ReplayConfig, ReplayError, ReplayLaser, ReplaySource, ReplayStage, open,
};
use crate::traits::driver::{DeviceSet, Driver, MissingSetting, OpenError, Opened};
use crate::{Camera, Laser, Stage, ThreadedCamera};

/// `[station.replay]`: a capture folder or a recording that is played.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReplaySettings {
    /// the capture folder that is played
    pub folder: PathBuf,
    /// the recording (MCAP file) that is played instead of a capture folder
    pub recording: PathBuf,
    /// which scan of the capture folder; empty: the first
    pub scan: String,
    /// frames per second
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub frame_rate_hz: f64,
    /// load all images into memory before playback
    pub preload: bool,
    /// restart at the end
    pub repeat: bool,
}

impl Default for ReplaySettings {
    /// The first scan from memory, repeated; folder or recording must be given.
    fn default() -> Self {
        Self {
            folder: PathBuf::new(),
            recording: PathBuf::new(),
            scan: String::new(),
            frame_rate_hz: 30.0,
            preload: true,
            repeat: true,
        }
    }
}

/// Plays the configured capture folder or recording.
#[derive(Debug, Clone)]
pub struct ReplayDriver(pub ReplaySettings);

impl ReplayDriver {
    fn devices(&self) -> Result<(ReplayCamera, ReplayStage, ReplayLaser), ReplayError> {
        let settings = &self.0;
        let played = if settings.recording.as_os_str().is_empty() {
            let scan = if settings.scan.is_empty() { self.first_scan()? } else { settings.scan.clone() };
            ReplaySource::Folder { folder: settings.folder.clone(), images: ImageSelection::Scan(scan) }
        } else {
            ReplaySource::Recording(settings.recording.clone())
        };
        open(&ReplayConfig {
            played,
            pace: Pace::Hz(settings.frame_rate_hz),
            repeat: settings.repeat,
            preload: settings.preload,
        })
    }

    /// Reading images from a disk may take arbitrarily long: callers must not be blocked.
    fn non_blocking(&self, camera: ReplayCamera) -> Box<dyn Camera> {
        if self.0.preload { Box::new(camera) } else { Box::new(ThreadedCamera::over(camera)) }
    }

    fn first_scan(&self) -> Result<String, ReplayError> {
        let folder = &self.0.folder;
        let capture = capture::Capture::open(folder)?;
        let first = capture.manifest.scans.first().map(|scan| scan.name.clone());
        first.ok_or_else(|| ReplayError::NoImages { path: folder.clone(), images: "scan" })
    }
}

impl Driver for ReplayDriver {
    fn kind(&self) -> &'static str {
        "replay"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet::ALL
    }

    fn is_real(&self) -> bool {
        false
    }

    fn binds_camera_to_stage(&self) -> bool {
        true
    }

    fn missing(&self) -> Option<MissingSetting> {
        let expected = "the capture folder to be played, or with station.replay.recording an MCAP file";
        let nothing = [&self.0.folder, &self.0.recording].iter().all(|path| path.as_os_str().is_empty());
        nothing.then_some(MissingSetting { name: "folder", expected })
    }

    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let (camera, stage, laser) = self.devices().map_err(|error| {
            let remedy =
                "put it in place and reset the station, or correct station.replay.folder, .scan or .recording";
            OpenError::Absent { what: with_causes(&error), remedy: remedy.to_owned() }
        })?;
        Ok(Opened {
            camera: wanted.camera.then(|| self.non_blocking(camera)),
            stage: wanted.stage.then(|| Box::new(stage) as Box<dyn Stage>),
            laser: wanted.laser.then(|| Box::new(laser) as Box<dyn Laser>),
        })
    }
}
