//! A stage: moves are started and polled, `stop` works in every state.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;

use remedy::Remedy;

use crate::{DeviceIdentity, StopHandle};

/// Whether and how the stage is homed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Homing {
    /// It has switches and must be homed before it moves.
    Required,
    /// It has no switches; its zero is the position at power-on, or is set explicitly.
    Absent,
}

/// Kind of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum StageKind {
    /// Linear; positions are millimetres.
    #[default]
    Linear,
    /// Rotary; numbers named in millimetres or mm/s are degrees or °/s.
    Rotary,
}

impl StageKind {
    /// Its name in settings, API and page.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Rotary => "rotary",
        }
    }
}

/// Capabilities of the stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageCapabilities {
    /// Kind of the stage. Scans and calibrations of this version need a linear stage.
    pub kind: StageKind,
    /// Range of positions, mm.
    pub travel_mm: (f64, f64),
    /// Fastest move, mm/s.
    pub max_speed_mm_s: f64,
    /// Acceleration, mm/s²; `None` if unknown or irrelevant.
    pub acceleration_mm_s2: Option<f64>,
    /// How it is homed.
    pub homing: Homing,
    /// Smallest step, mm; 0 if unknown.
    pub resolution_mm: f64,
    /// Whether it is not commanded, and its position is that of the last delivered frame: the stage of a recording, or
    /// a conveyor whose encoder triggers the camera. A sweep needs no run-up, and its frames are those that arrive.
    pub follows_frames: bool,
    /// Travel from one exposure to the next of a belt whose encoder triggers the camera; it accepts no motion command,
    /// and its position is counted by [`Stage::count_exposures`].
    pub frame_pitch_mm: Option<f64>,
}

/// A move as the controller accepted it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AcceptedMove {
    /// Target.
    pub target_mm: f64,
    /// Speed limit.
    pub speed_mm_s: f64,
}

/// State of a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageState {
    /// Position as read back from the controller; `None` if unknown (before homing, after a fault).
    pub position_mm: Option<f64>,
    /// Time of that position, by this computer's monotonic clock.
    pub measured_at: Instant,
    /// Whether it is moving.
    pub moving: bool,
    /// Whether a move is held by the controller (feed hold, door).
    pub held: bool,
    /// Whether it is homed.
    pub homed: bool,
}

/// Why a stage refused or failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StageError {
    /// It is not homed, so that its position is unknown.
    #[error("the position of the stage is unknown")]
    NotHomed,
    /// Outside the soft limits.
    #[error("{target_mm} mm is outside the stage's travel of {min_mm} to {max_mm} mm")]
    OutOfTravel {
        /// The requested target.
        target_mm: f64,
        /// Lowest position.
        min_mm: f64,
        /// Highest position.
        max_mm: f64,
    },
    /// An invalid number.
    #[error("a stage cannot move with {name} = {value}")]
    BadNumber {
        /// The argument.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// It is a belt that belongs to the plant.
    #[error("the belt is not controlled by this station: it cannot be {command} from here")]
    NotCommanded {
        /// The refused command, as a participle.
        command: &'static str,
    },
    /// It is already moving or homing, and accepts one motion at a time.
    #[error("the stage is moving")]
    Moving,
    /// It stopped before the target.
    #[error("the stage stopped at {actual_mm} mm on the way to {target_mm} mm")]
    Stalled {
        /// The target.
        target_mm: f64,
        /// The position, as far as it is known.
        actual_mm: f64,
    },
    /// The controller raised an alarm and accepts no moves.
    #[error("the stage's controller is in alarm {code} ({meaning})")]
    Alarm {
        /// The controller's number.
        code: u32,
        /// What it means.
        meaning: String,
    },
    /// The controller reports by a flag or text that it cannot be used.
    #[error("the stage's controller reports {flag} ({meaning})")]
    Warned {
        /// The controller's flag or text.
        flag: String,
        /// Its meaning.
        meaning: String,
    },
    /// The controller refused a command, with a reason.
    #[error("the stage's controller refused `{command}`: {reason} ({meaning})")]
    Rejected {
        /// The line sent.
        command: String,
        /// The controller's reason.
        reason: String,
        /// Its meaning.
        meaning: String,
    },
    /// The controller refused a command.
    #[error("the stage's controller refused `{command}`: error {code} ({meaning})")]
    Refused {
        /// The line sent.
        command: String,
        /// The controller's number.
        code: u32,
        /// Its meaning.
        meaning: String,
    },
    /// The controller restarted spontaneously; the position is unknown.
    #[error("the stage's controller restarted and has lost its position")]
    Restarted,
    /// The controller does not respond.
    #[error("the stage did not answer within {waited_ms} ms to `{command}`")]
    NoResponse {
        /// The line sent.
        command: String,
        /// How long the answer was awaited.
        waited_ms: u64,
    },
    /// Received data is not part of the protocol.
    #[error("the stage's controller sent `{received}`, which is not part of its protocol")]
    Unreadable {
        /// The line, shortened.
        received: String,
    },
    /// It does not respond; it must be reopened.
    #[error("the stage is disconnected: {reason}")]
    Disconnected {
        /// What was detected.
        reason: String,
    },
    /// A device other than the configured one.
    #[error("expected {expected} at {port_name}, found {found}")]
    WrongDevice {
        /// Its port.
        port_name: String,
        /// The configured device.
        expected: String,
        /// The device found.
        found: String,
    },
}

impl Remedy for StageError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::NotHomed => "home the stage first",
            Self::BadNumber { name: "speed_mm_s", .. } => "give a finite number above 0",
            Self::BadNumber { .. } => "give a finite number",
            Self::NotCommanded { .. } => "start the belt at its own controls, and scan in continuous mode",
            Self::Moving => "wait until it has stopped, or stop it first",
            Self::Stalled { .. } => "check for an obstacle, then home the stage",
            Self::Alarm { .. } => "remove the cause, clear the alarm and home the stage",
            Self::Warned { .. } => "remove the cause, clear the fault and home the stage",
            Self::Restarted => "home the stage",
            Self::NoResponse { .. } | Self::Disconnected { .. } => "check cable and power, then reconnect",
            Self::Unreadable { .. } => "check device and baud rate",
            Self::WrongDevice { .. } => "connect the right device or change the configuration",
            Self::OutOfTravel { .. } | Self::Refused { .. } | Self::Rejected { .. } => return None,
        }))
    }
}

/// A stage.
pub trait Stage: Send {
    /// Which stage this is.
    fn identity(&self) -> DeviceIdentity;

    /// Its capabilities.
    fn capabilities(&self) -> StageCapabilities;

    /// Starts homing and returns at once. A stage without switches takes its position as zero.
    fn start_home(&mut self) -> Result<(), StageError>;

    /// Starts a move and returns at once with the target and speed the controller accepted. A speed above the
    /// fastest is accepted as the fastest.
    ///
    /// # Errors
    /// [`StageError::Moving`] during another motion, [`StageError::OutOfTravel`], [`StageError::BadNumber`],
    /// [`StageError::NotHomed`] where [`Homing::Required`]; nothing moves then.
    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError>;

    /// Starts a move of `distance_mm` from the current position, limited to the travel; before homing it is allowed
    /// only for [`Homing::Absent`].
    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError>;

    /// Position as read back from the controller, and whether it is still moving.
    ///
    /// # Errors
    /// A fault is reported here once it is detected, and again by every call until [`Stage::clear_fault`] or
    /// [`Stage::reconnect`].
    fn poll(&mut self) -> Result<StageState, StageError>;

    /// For a stage with a [`StageCapabilities::frame_pitch_mm`]: so many further exposures were triggered, lost ones
    /// included. Returns the position at the last one.
    fn count_exposures(&mut self, _n_exposures: u64) -> Option<f64> {
        None
    }

    /// For such a stage: the next exposure is the first of a scan.
    fn begin_count(&mut self) {}

    /// Holds a move; [`Stage::resume`] continues it.
    fn hold(&mut self) -> Result<(), StageError>;

    /// Continues a held move.
    fn resume(&mut self) -> Result<(), StageError>;

    /// Stops now and discards the move. Works in every state, also before homing and in alarm.
    fn stop(&mut self) -> Result<(), StageError>;

    /// Stops it from another thread while a call is blocked.
    fn stop_handle(&self) -> Arc<dyn StopHandle>;

    /// Acknowledges a fault whose cause is removed; has no effect without one. If the position was lost by the fault,
    /// it is unknown afterwards. A device that takes time is polled: [`Stage::poll`] returns the fault until it is
    /// cleared.
    ///
    /// # Errors
    /// The fault itself, if only [`Stage::reconnect`] helps.
    fn clear_fault(&mut self) -> Result<(), StageError>;

    /// Starts to reconnect the stage after [`StageError::Disconnected`] or [`StageError::NoResponse`] and returns at once;
    /// [`Stage::poll`] returns the fault until it is connected. It is at rest afterwards and must be homed.
    fn reconnect(&mut self) -> Result<(), StageError>;
}
