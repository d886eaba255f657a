//! Why the station refused a request or failed.

use std::borrow::Cow;

use devices::{CameraError, LaserError, StageError};
use remedy::Remedy;

/// Why the station refused a request or failed.
#[derive(Debug, thiserror::Error)]
pub enum StationRefusal {
    /// A job or the live view uses it.
    #[error("the station is busy: {activity}")]
    Busy {
        /// The current activity.
        activity: String,
    },
    /// A fault waits for acknowledgement.
    #[error("the station is in error: {detail}")]
    InError {
        /// The fault.
        detail: String,
        /// The remedy.
        remedy: String,
    },
    /// A person stopped it before.
    #[error("the station was stopped")]
    Halted,
    /// A person can use the laser only in a live view.
    #[error("the laser is on only while frames arrive")]
    NoLiveView,
    /// A speed outside the range of this stage.
    #[error("the stage moves at {min_mm_s} to {max_mm_s} mm/s, not at {speed_mm_s}")]
    SpeedOutOfRange {
        /// Requested speed.
        speed_mm_s: f64,
        /// Slowest: one step of its resolution per second.
        min_mm_s: f64,
        /// Fastest.
        max_mm_s: f64,
    },
    /// The command channel is full.
    #[error("too many commands are waiting")]
    TooManyCommands,
    /// A person stopped it during the call.
    #[error("stopped by {actor}")]
    Stopped {
        /// Who stopped it.
        actor: String,
    },
    /// The job was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The station has no such device.
    #[error("this station has no {device}")]
    Absent {
        /// The device.
        device: &'static str,
    },
    /// The camera refused or failed.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The stage refused or failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The laser refused or failed.
    #[error(transparent)]
    Laser(#[from] LaserError),
    /// A requested frame did not arrive.
    #[error("no frame arrived within {waited_ms} ms")]
    NoFrame {
        /// Time waited.
        waited_ms: u64,
    },
    /// The encoder of a belt sent no trigger during a scan.
    #[error("the belt has stopped: no trigger within {waited_ms} ms")]
    BeltStopped {
        /// Time waited.
        waited_ms: u64,
    },
    /// The station thread has ended.
    #[error("the station is shutting down")]
    ShuttingDown,
}

impl Remedy for StationRefusal {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::Busy { .. } => "wait until it is finished, or stop it",
            Self::InError { remedy, .. } => return Some(format!("{remedy}, then reset the station").into()),
            Self::Halted => "check that the area is clear, take control and reset the station",
            Self::NoLiveView => "start the live view first",
            Self::SpeedOutOfRange { .. } => "choose a speed within this range",
            Self::TooManyCommands => "send fewer commands",
            Self::Stopped { .. } => "start again when it is safe",
            Self::Absent { .. } => "configure one under `[station]`",
            Self::Camera(error) => return error.remedy(),
            Self::Stage(error) => return error.remedy(),
            Self::Laser(error) => return error.remedy(),
            Self::BeltStopped { .. } => {
                "start the belt, check the encoder's trigger input on the camera, then scan again"
            }
            Self::NoFrame { .. } => "check the camera and its trigger",
            Self::Cancelled | Self::ShuttingDown => return None,
        }))
    }
}
