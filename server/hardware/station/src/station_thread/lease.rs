//! The lease by which a job drives the station.

use devices::{CameraRequest, CameraSettings};

use crate::shared::cancel::CancelFlag;
use crate::shared::frame::{FrameStream, SharedFrame};
use crate::shared::refusal::StationRefusal;
use crate::station_thread::command::{Command, JobCall, Reply};
use crate::station_thread::handle::{StationHandle, Sweep};

/// Exclusive access of one job to the station; calls block until done, cancelled, stopped or failed.
///
/// On drop the laser is turned off, the stage stopped and the camera's settings restored.
pub struct StationLease {
    station: StationHandle,
    number: u64,
}

impl StationLease {
    pub(crate) fn new(station: StationHandle, number: u64) -> Self {
        Self { station, number }
    }

    /// Configures the camera; returns the accepted settings.
    pub fn configure(&self, wanted: &CameraRequest) -> Result<CameraSettings, StationRefusal> {
        self.call(|reply| JobCall::Configure(*wanted, reply))
    }

    /// Turns the laser on with a fraction of full power until [`StationLease::laser_off`]; returns once the laser
    /// reports light.
    ///
    /// The station renews the laser's lease only while frames arrive or the job calls. Light that was suspended because
    /// the job was busy elsewhere is turned on again by its next call.
    pub fn laser_on(&self, power: f64) -> Result<(), StationRefusal> {
        self.call(|reply| JobCall::Light(if power == 0.0 { f64::NAN } else { power }, reply))
    }

    /// Turns the laser off; returns once the laser reports it.
    pub fn laser_off(&self) -> Result<(), StationRefusal> {
        self.call(|reply| JobCall::Light(0.0, reply))
    }

    /// Homes the stage.
    pub fn home(&self, cancel: &CancelFlag) -> Result<(), StationRefusal> {
        self.call(|reply| JobCall::Home(cancel.clone(), reply))
    }

    /// Moves and settles; returns the position read back.
    pub fn move_to(
        &self,
        target_mm: f64,
        speed_mm_s: Option<f64>,
        cancel: &CancelFlag,
    ) -> Result<f64, StationRefusal> {
        self.call(|reply| JobCall::MoveTo { target_mm, speed_mm_s, cancel: cancel.clone(), reply })
    }

    /// Exposes one frame and waits for it.
    pub fn grab(&self, cancel: &CancelFlag) -> Result<SharedFrame, StationRefusal> {
        self.call(|reply| JobCall::Grab(cancel.clone(), reply))
    }

    /// Runs a sweep; returns once the stage moves. The stream delivers the frames with a position from `from_mm` to
    /// `to_mm`, in the order of exposure; none is skipped silently.
    pub fn sweep(&self, sweep: &Sweep, cancel: &CancelFlag) -> Result<FrameStream, StationRefusal> {
        self.call(|reply| JobCall::Sweep(*sweep, cancel.clone(), reply))
    }

    /// Sets the job's activity for the status.
    pub fn activity(&self, activity: &str) {
        // An activity is not worth waiting for a full channel.
        let _ = self.station.send(Command::Job(self.number, JobCall::Activity(activity.to_owned())));
    }

    fn call<T: Send + 'static>(&self, call: impl FnOnce(Reply<T>) -> JobCall) -> Result<T, StationRefusal> {
        let (reply, answer) = Reply::blocking();
        self.station.send(Command::Job(self.number, call(reply)))?;
        answer.recv().unwrap_or_else(|_| Err(self.station.unanswered_reason()))
    }
}

impl Drop for StationLease {
    fn drop(&mut self) {
        let (reply, answer) = Reply::blocking();
        if self.station.release(Command::Release(self.number, reply)) {
            // Without an answer the thread has ended, with light and motion off.
            let _ = answer.recv();
        }
    }
}
