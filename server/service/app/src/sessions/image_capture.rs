//! Captures calibration images with exclusive use of the station: the board with the laser off, its lines with the
//! laser on.

use devices::{CameraRequest, Trigger};
use optics::StagePosition;

use station::cancel::CancelFlag;
use station::{SharedFrame, StationLease, StationRefusal};

use crate::camera::background::Background;

/// Ambient light above which it is subtracted by default, in levels of 255: an eighth of a line at a good exposure, and
/// above the black level of common sensors. Subtracting less than that adds noise and removes nothing.
const BACKGROUND_ABOVE_LEVELS: f64 = 20.0;

/// Exposure times and laser power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposures {
    /// Exposure time for the board, laser off.
    pub board_exposure_us: f64,
    /// Exposure time for the laser lines.
    pub laser_exposure_us: f64,
    /// Fraction of full laser power, above 0 and at most 1.
    pub laser_power: f64,
    /// Ambient light, in levels of 255, above which the laser lines are exposed with the laser off as well, to be
    /// subtracted; `None`: never.
    pub background_above_levels: Option<f64>,
}

impl Default for Exposures {
    /// Defaults for a white board on the simulated station.
    fn default() -> Self {
        Self {
            board_exposure_us: twin::live::BOARD_EXPOSURE_US,
            laser_exposure_us: twin::live::LASER_EXPOSURE_US,
            laser_power: 1.0,
            background_above_levels: Some(BACKGROUND_ABOVE_LEVELS),
        }
    }
}

/// The laser lines of a pose.
pub struct LaserShot {
    /// With the laser on.
    pub lines: SharedFrame,
    /// The same scene with the laser off, if the ambient light is above the limit.
    pub background: Option<SharedFrame>,
}

/// Captures images until it is dropped; then the laser is off, the stage at rest and the station free.
pub struct ImageCapture {
    lease: StationLease,
    cancel: CancelFlag,
    exposures: Exposures,
}

impl ImageCapture {
    /// With exclusive use of the station.
    pub fn new(lease: StationLease, cancel: CancelFlag, exposures: Exposures) -> Self {
        Self { lease, cancel, exposures }
    }

    /// Captures the board with the laser off.
    pub fn board(&self) -> Result<SharedFrame, StationRefusal> {
        self.lease.laser_off()?;
        self.expose(self.exposures.board_exposure_us)
    }

    /// Captures the laser lines, and the same scene with the laser off.
    pub fn laser(&self) -> Result<LaserShot, StationRefusal> {
        self.lease.laser_on(self.exposures.laser_power)?;
        let lines = self.expose(self.exposures.laser_exposure_us);
        self.lease.laser_off()?;
        let lines = lines?;
        let Some(limit_levels) = self.exposures.background_above_levels else {
            return Ok(LaserShot { lines, background: None });
        };
        let laser_off = self.expose(self.exposures.laser_exposure_us)?;
        let is_bright = Background::new(&laser_off).ambient_levels() > limit_levels;
        Ok(LaserShot { lines, background: is_bright.then_some(laser_off) })
    }

    /// Homes the stage.
    pub fn home(&self) -> Result<(), StationRefusal> {
        self.lease.home(&self.cancel)
    }

    /// Moves the stage and returns the position read back.
    pub fn go_to(&self, position: StagePosition) -> Result<StagePosition, StationRefusal> {
        Ok(position.kind().position(self.lease.move_to(position.value(), None, &self.cancel)?))
    }

    /// Sets the activity in the station status.
    pub fn report_activity(&self, words: &str) {
        self.lease.activity(words);
    }

    fn expose(&self, exposure_us: f64) -> Result<SharedFrame, StationRefusal> {
        let wanted = CameraRequest {
            exposure_us: Some(exposure_us),
            trigger: Some(Trigger::Software),
            ..CameraRequest::default()
        };
        self.lease.configure(&wanted)?;
        self.lease.grab(&self.cancel)
    }
}
