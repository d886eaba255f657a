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
    /// A frame did not arrive, or only incomplete.
    #[error("{}", no_frame(*waited_ms, *n_incomplete))]
    NoFrame {
        /// Time waited.
        waited_ms: u64,
        /// Incomplete frames since the last complete one.
        n_incomplete: u64,
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

fn no_frame(waited_ms: u64, n_incomplete: u64) -> String {
    match n_incomplete {
        0 => format!("no frame arrived within {waited_ms} ms"),
        1 => format!("no complete frame arrived within {waited_ms} ms: one was incomplete"),
        _ => format!("no complete frame arrived within {waited_ms} ms: {n_incomplete} were incomplete"),
    }
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
            Self::NoFrame { n_incomplete: 0, .. } => "check the camera and its trigger",
            Self::NoFrame { .. } => {
                "check the camera's cable; a network camera's packet size must be one that the network card and every \
                 switch pass on (MTU)"
            }
            Self::Cancelled | Self::ShuttingDown => return None,
        }))
    }
}
