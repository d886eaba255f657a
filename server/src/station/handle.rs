//! How the rest of the service talks to the station thread.

use std::sync::Arc;

use devices::{AcceptedMove, CameraRequest, CameraSettings};
use tokio::sync::watch;

use crate::cancel::CancelFlag;
use crate::station::frame::{FrameStream, SharedFrame};
use crate::station::refusal::StationRefusal;
use crate::station::status::StationStatus;

/// Everyone's access to the station.
#[derive(Clone)]
pub struct StationHandle {
    status: watch::Receiver<Arc<StationStatus>>,
    newest: watch::Receiver<Option<SharedFrame>>,
}

/// Who wants the station, shown to people.
#[derive(Debug, Clone)]
pub struct Purpose {
    /// The job's id.
    pub job_id: String,
    /// In the operator's words: "scanning".
    pub activity: String,
}

/// A person's single command; refused while a job has the station.
#[derive(Debug, Clone)]
pub enum Manual {
    /// Look for the stage's zero.
    Home,
    /// Go to a position; `None`: as fast as the stage can.
    Move {
        /// Where to.
        target_mm: f64,
        /// How fast at most.
        speed_mm_s: Option<f64>,
    },
    /// Move while this is repeated; stops within 300 ms of silence.
    Jog {
        /// Signed speed.
        velocity_mm_s: f64,
    },
    /// Set the camera.
    Configure(CameraRequest),
    /// Shine with a share of full power while frames arrive; 0 goes dark.
    Laser {
        /// 0–1.
        power: f64,
    },
    /// Acknowledge faults, reach devices again.
    Reset,
}

/// What the live view shall do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveRequest {
    /// Whether it shall run.
    pub running: bool,
    /// Share of full laser power, 0 is dark.
    pub laser_power: f64,
}

/// A continuous run: the stage moves at constant speed while the camera exposes at its own rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// First position of interest; the run-up is added by the station.
    pub from_mm: f64,
    /// Last position of interest.
    pub to_mm: f64,
    /// Speed.
    pub speed_mm_s: f64,
    /// Frames per second.
    pub frame_rate_hz: f64,
}

impl StationHandle {
    /// Opens the devices.
    pub fn start(_config: &crate::config::Config) -> Self {
        todo!()
    }

    /// The virtual operator's hands, where the station is simulated.
    pub fn simulation(&self) -> Option<twin::TwinControl> {
        todo!()
    }

    /// The station as last seen.
    pub fn status(&self) -> Arc<StationStatus> {
        self.status.borrow().clone()
    }

    /// Follows the status; the newest wins.
    pub fn watch_status(&self) -> watch::Receiver<Arc<StationStatus>> {
        self.status.clone()
    }

    /// Follows the frames; the newest wins, whoever made the camera expose.
    pub fn watch_frames(&self) -> watch::Receiver<Option<SharedFrame>> {
        self.newest.clone()
    }

    /// Stops motion, darkens the laser, ends what runs. Always taken; returns once the devices were told.
    pub async fn stop(&self, _actor: &str) -> Result<(), StationRefusal> {
        todo!()
    }

    /// A person's single command; returns once it was accepted, moves go on.
    pub async fn manual(&self, _command: Manual) -> Result<Option<AcceptedMove>, StationRefusal> {
        todo!()
    }

    /// Starts or ends the live view.
    pub async fn live(&self, _request: LiveRequest) -> Result<(), StationRefusal> {
        todo!()
    }

    /// One frame as the camera is set now: the newest of a running view, else a single exposure.
    pub async fn snapshot(&self) -> Result<SharedFrame, StationRefusal> {
        todo!()
    }

    /// Whether a scan could begin depends on a calibration being active: the service tells the station.
    pub fn calibration_changed(&self, _active: bool) {
        todo!()
    }

    /// Takes the station for a job. Ends a running live view; refused while another job has it or it is in error.
    pub fn lease(&self, _purpose: Purpose) -> Result<StationLease, StationRefusal> {
        todo!()
    }

    /// Darkens, stops, closes the devices and ends the thread; returns when it has ended.
    pub fn shut_down(&self) {
        todo!()
    }
}

/// The station in the hands of one job; calls block until done, cancelled, stopped or broken.
///
/// Dropped, it leaves the laser dark, the stage at rest and the camera's settings as they were.
pub struct StationLease {}

impl StationLease {
    /// Sets the camera; returns what it accepted.
    pub fn configure(&self, _wanted: &CameraRequest) -> Result<CameraSettings, StationRefusal> {
        todo!()
    }

    /// Shines with a share of full power until [`StationLease::laser_off`]; the station renews the laser's lease only
    /// while frames arrive or the job calls.
    pub fn laser_on(&self, _power: f64) -> Result<(), StationRefusal> {
        todo!()
    }

    /// Goes dark.
    pub fn laser_off(&self) -> Result<(), StationRefusal> {
        todo!()
    }

    /// Homes the stage.
    pub fn home(&self, _cancel: &CancelFlag) -> Result<(), StationRefusal> {
        todo!()
    }

    /// Moves and settles; returns the position read back.
    pub fn move_to(
        &self,
        _target_mm: f64,
        _speed_mm_s: Option<f64>,
        _cancel: &CancelFlag,
    ) -> Result<f64, StationRefusal> {
        todo!()
    }

    /// Exposes one frame now and waits for it.
    pub fn grab(&self, _cancel: &CancelFlag) -> Result<SharedFrame, StationRefusal> {
        todo!()
    }

    /// Runs a sweep; its frames come through the stream, none is skipped silently.
    pub fn sweep(&self, _sweep: &Sweep, _cancel: &CancelFlag) -> Result<FrameStream, StationRefusal> {
        todo!()
    }

    /// Says what the job does now, for the status.
    pub fn activity(&self, _words: &str) {
        todo!()
    }
}
