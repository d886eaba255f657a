//! The commands of the station thread.

use std::sync::Arc;
use std::sync::mpsc::sync_channel;

use devices::{AcceptedMove, CameraRequest, CameraSettings};
use tokio::sync::oneshot;

use crate::shared::cancel::CancelFlag;
use crate::shared::dark_frame::CameraDarkFrame;
use crate::shared::frame::{FrameStream, SharedFrame};
use crate::shared::refusal::StationRefusal;
use crate::shared::status::Fault;
use crate::shared::tap::FrameTap;
use crate::station_thread::handle::{LiveRequest, Manual, Purpose, Sweep};

/// Result of a call.
pub type Answer<T> = Result<T, StationRefusal>;

/// Destination of an answer.
pub struct Reply<T>(Box<dyn FnOnce(Answer<T>) + Send>);

impl<T: Send + 'static> Reply<T> {
    /// For a caller that awaits it.
    pub fn awaited() -> (Self, oneshot::Receiver<Answer<T>>) {
        let (sender, receiver) = oneshot::channel();
        // A caller that has stopped waiting does not need its answer.
        (Self(Box::new(move |answer| drop(sender.send(answer)))), receiver)
    }

    /// For a caller that blocks until it arrives.
    pub fn blocking() -> (Self, std::sync::mpsc::Receiver<Answer<T>>) {
        let (sender, receiver) = sync_channel(1);
        (Self(Box::new(move |answer| drop(sender.send(answer)))), receiver)
    }

    /// Sends the answer.
    pub fn send(self, answer: Answer<T>) {
        (self.0)(answer);
    }
}

/// A command for the station thread.
pub enum Command {
    /// See [`crate::StationHandle::manual`].
    Manual(Manual, Reply<Option<AcceptedMove>>),
    /// See [`crate::StationHandle::live`].
    Live(LiveRequest, Reply<()>),
    /// See [`crate::StationHandle::snapshot`].
    Snapshot(Reply<SharedFrame>),
    /// See [`crate::StationHandle::tap`].
    Tap(Reply<FrameTap>),
    /// See [`crate::StationHandle::close_tap`].
    CloseTap(Reply<()>),
    /// See [`crate::StationHandle::calibration_changed`].
    CalibrationChanged(bool),
    /// See [`crate::StationHandle::set_dark_frame`].
    DarkFrame(Option<Arc<CameraDarkFrame>>),
    /// See [`crate::StationHandle::lease`]; answered with the number of the lease.
    Lease(Purpose, Reply<u64>),
    /// A call of the job with that lease.
    Job(u64, JobCall),
    /// The job releases the station.
    Release(u64, Reply<()>),
    /// A failure outside the station: motion and light end, a person has to act.
    Alarm(Fault),
    /// Check for a pending Stop.
    Wake,
    /// Turn the laser off, stop the stage, end.
    ShutDown,
}

/// The calls of [`crate::StationLease`].
pub enum JobCall {
    /// Configure the camera.
    Configure(CameraRequest, Reply<CameraSettings>),
    /// Turn the laser on with that power; 0 turns it off.
    Light(f64, Reply<()>),
    /// Home the stage.
    Home(CancelFlag, Reply<()>),
    /// Move and settle.
    MoveTo {
        /// Target position.
        target_mm: f64,
        /// Highest speed.
        speed_mm_s: Option<f64>,
        /// Ends the wait and the motion.
        cancel: CancelFlag,
        /// Receives the position read back.
        reply: Reply<f64>,
    },
    /// Expose one frame.
    Grab(CancelFlag, Reply<SharedFrame>),
    /// Run a sweep.
    Sweep(Sweep, CancelFlag, Reply<FrameStream>),
    /// Set the job's activity.
    Activity(String),
}

impl JobCall {
    /// Answers the call with a refusal.
    pub fn refuse(self, refusal: StationRefusal) {
        match self {
            Self::Configure(_, reply) => reply.send(Err(refusal)),
            Self::Light(_, reply) | Self::Home(_, reply) => reply.send(Err(refusal)),
            Self::MoveTo { reply, .. } => reply.send(Err(refusal)),
            Self::Grab(_, reply) => reply.send(Err(refusal)),
            Self::Sweep(_, _, reply) => reply.send(Err(refusal)),
            Self::Activity(_) => {}
        }
    }
}
