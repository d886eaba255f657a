//! Why the station did not do what it was asked.

use devices::{CameraError, LaserError, StageError};

/// Why the station did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StationRefusal {
    /// A job or the live view has it.
    #[error("the station is busy: {activity}; wait, or stop it")]
    Busy {
        /// What it does.
        activity: String,
    },
    /// A fault waits for a person.
    #[error("the station is in error: {detail}; {remedy}, then reset the station")]
    InError {
        /// The fault.
        detail: String,
        /// What to do.
        remedy: String,
    },
    /// A person stopped it before.
    #[error("the station was stopped; check that the area is clear, take control and reset it")]
    Halted,
    /// Light by hand belongs to a live view.
    #[error("the laser shines only while frames arrive; start the live view first")]
    NoLiveView,
    /// A speed that this stage does not have.
    #[error("the stage moves at {min_mm_s} to {max_mm_s} mm/s, not at {speed_mm_s}; choose a speed within")]
    SpeedOutOfRange {
        /// What was asked for.
        speed_mm_s: f64,
        /// Slowest: one step of its resolution a second.
        min_mm_s: f64,
        /// Fastest.
        max_mm_s: f64,
    },
    /// More commands wait than the station takes.
    #[error("the station has too many commands to obey; send fewer")]
    TooManyCommands,
    /// A person stopped it while this ran.
    #[error("stopped by {actor}; start again when it is safe")]
    Stopped {
        /// Who.
        actor: String,
    },
    /// The job was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// No such device in this station.
    #[error("this station has no {device}; configure one")]
    Absent {
        /// Which.
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
    /// No frame came although one was asked for.
    #[error("no frame arrived within {waited_ms} ms; check the camera and its trigger")]
    NoFrame {
        /// How long it was waited for.
        waited_ms: u64,
    },
    /// The station thread ended.
    #[error("the station is shutting down")]
    ShuttingDown,
}
