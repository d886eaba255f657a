//! The pictures of a calibration, taken with the station in hand: the board by ordinary light, the lines on it by
//! laser light.

use devices::{CameraRequest, Trigger};
use optics::StagePosition;

use station::cancel::CancelFlag;
use station::{SharedFrame, StationLease, StationRefusal};

/// Exposure times and laser power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposures {
    /// Exposure time for the board, laser off.
    pub board_exposure_us: f64,
    /// Exposure time for the laser lines.
    pub laser_exposure_us: f64,
    /// Share of full laser power, above 0 and at most 1.
    pub laser_power: f64,
}

impl Default for Exposures {
    /// What suits a white board at the simulated station.
    fn default() -> Self {
        Self {
            board_exposure_us: twin::live::BOARD_EXPOSURE_US,
            laser_exposure_us: twin::live::LASER_EXPOSURE_US,
            laser_power: 1.0,
        }
    }
}

/// Takes pictures until it is dropped; then the station is dark, at rest and free again.
pub struct Photographer {
    lease: StationLease,
    cancel: CancelFlag,
    exposures: Exposures,
}

impl Photographer {
    /// With the station in hand.
    pub fn new(lease: StationLease, cancel: CancelFlag, exposures: Exposures) -> Self {
        Self { lease, cancel, exposures }
    }

    /// The board by ordinary light.
    pub fn board(&self) -> Result<SharedFrame, StationRefusal> {
        self.lease.laser_off()?;
        self.expose(self.exposures.board_exposure_us)
    }

    /// The laser lines.
    pub fn laser(&self) -> Result<SharedFrame, StationRefusal> {
        self.lease.laser_on(self.exposures.laser_power)?;
        let frame = self.expose(self.exposures.laser_exposure_us);
        self.lease.laser_off()?;
        frame
    }

    /// Homes the stage.
    pub fn home(&self) -> Result<(), StationRefusal> {
        self.lease.home(&self.cancel)
    }

    /// Moves the stage and returns the position read back.
    pub fn go_to(&self, position: StagePosition) -> Result<StagePosition, StationRefusal> {
        Ok(position.kind().position(self.lease.move_to(position.value(), None, &self.cancel)?))
    }

    /// Tells the station's status what is done now.
    pub fn say(&self, words: &str) {
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
