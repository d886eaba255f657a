//! A stage: moves are started and polled, `stop` works in every state.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;

use remedy::Remedy;

use crate::{DeviceIdentity, StopHandle};

/// Whether and how the stage finds its zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Homing {
    /// It has switches and must be homed before it moves.
    Required,
    /// It has no switches; its zero is where it was switched on, or where it is set.
    Absent,
}

/// How the stage moves the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum StageKind {
    /// Along a line; positions are millimetres.
    #[default]
    Linear,
    /// About an axis; where a number is called millimetres or mm/s it is degrees or °/s.
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

/// What the stage can do.
#[derive(Debug, Clone, PartialEq)]
pub struct StageCapabilities {
    /// How it moves the part. Scans and calibrations of this version need a linear stage.
    pub kind: StageKind,
    /// Positions it can go to, mm.
    pub travel_mm: (f64, f64),
    /// Fastest move, mm/s.
    pub max_speed_mm_s: f64,
    /// Acceleration, mm/s²; `None` if it does not say or does not matter.
    pub acceleration_mm_s2: Option<f64>,
    /// How it finds its zero.
    pub homing: Homing,
    /// The smallest step it can make, mm; 0 if unknown.
    pub resolution_mm: f64,
    /// Whether nobody commands it, and it is where the frame last delivered was taken: the stage of a recording, or a
    /// conveyor whose encoder triggers the camera. A sweep needs no run-up, and its frames are those that come.
    pub follows_frames: bool,
}

/// A move as the controller accepted it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AcceptedMove {
    /// Where it goes.
    pub target_mm: f64,
    /// How fast, at most.
    pub speed_mm_s: f64,
}

/// What a stage reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageState {
    /// Position as read back from the controller; `None` is unknown (before homing, after a fault).
    pub position_mm: Option<f64>,
    /// When it was there, by this computer's monotonic clock.
    pub measured_at: Instant,
    /// Whether it moves.
    pub moving: bool,
    /// Whether the controller holds a move back (feed hold, door).
    pub held: bool,
    /// Whether its zero is established.
    pub homed: bool,
}

/// Why a stage did not do what it was asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StageError {
    /// It is not homed, so that no position means anything.
    #[error("the stage does not know where it is")]
    NotHomed,
    /// Outside the soft limits.
    #[error("{target_mm} mm is outside the stage's travel of {min_mm} to {max_mm} mm")]
    OutOfTravel {
        /// The target wanted.
        target_mm: f64,
        /// Lowest position.
        min_mm: f64,
        /// Highest position.
        max_mm: f64,
    },
    /// A number that makes no move.
    #[error("a stage cannot move with {name} = {value}")]
    BadNumber {
        /// Which argument.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// It moves or homes already, and one motion at a time is all it takes.
    #[error("the stage is moving")]
    Moving,
    /// It stopped on the way.
    #[error("the stage stopped at {actual_mm} mm on the way to {target_mm} mm")]
    Stalled {
        /// Where it was to go.
        target_mm: f64,
        /// Where it is, as far as it knows.
        actual_mm: f64,
    },
    /// The controller raised an alarm and takes no moves.
    #[error("the stage's controller is in alarm {code} ({meaning})")]
    Alarm {
        /// The controller's number.
        code: u32,
        /// What it means.
        meaning: String,
    },
    /// The controller says by a flag or in words that it cannot be used.
    #[error("the stage's controller reports {flag} ({meaning})")]
    Warned {
        /// The controller's flag or text.
        flag: String,
        /// What it means.
        meaning: String,
    },
    /// The controller refused a command, and says why in words.
    #[error("the stage's controller refused `{command}`: {reason} ({meaning})")]
    Rejected {
        /// The line sent.
        command: String,
        /// The controller's own word for it.
        reason: String,
        /// What it means.
        meaning: String,
    },
    /// The controller refused a command.
    #[error("the stage's controller refused `{command}`: error {code} ({meaning})")]
    Refused {
        /// The line sent.
        command: String,
        /// The controller's number.
        code: u32,
        /// What it means.
        meaning: String,
    },
    /// The controller restarted by itself; where the stage is, is unknown.
    #[error("the stage's controller restarted and has lost its position")]
    Restarted,
    /// The controller does not answer.
    #[error("the stage did not answer within {waited_ms} ms to `{command}`")]
    NoReply {
        /// The line sent.
        command: String,
        /// How long it was waited for.
        waited_ms: u64,
    },
    /// What came is not the protocol.
    #[error("the stage's controller sent `{received}`, which is not its protocol")]
    Garbage {
        /// The line, shortened.
        received: String,
    },
    /// It does not answer any more; it must be opened again.
    #[error("the stage is gone: {reason}")]
    Gone {
        /// What was noticed.
        reason: String,
    },
    /// Another device than the one the station was set up with.
    #[error("expected {expected} at {place}, found {found}")]
    WrongDevice {
        /// Where it was looked for.
        place: String,
        /// What is configured.
        expected: String,
        /// What answered.
        found: String,
    },
}

impl Remedy for StageError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::NotHomed => "home it first",
            Self::BadNumber { name: "speed_mm_s", .. } => "give a finite number above 0",
            Self::BadNumber { .. } => "give a finite number",
            Self::Moving => "wait for its end or stop it first",
            Self::Stalled { .. } => "look for an obstacle, then home it",
            Self::Alarm { .. } => "remove the cause, clear the alarm and home",
            Self::Warned { .. } => "remove the cause, clear the fault and home",
            Self::Restarted => "home it",
            Self::NoReply { .. } | Self::Gone { .. } => "check cable and power, then reconnect",
            Self::Garbage { .. } => "check device and baud rate",
            Self::WrongDevice { .. } => "connect the right device or change the configuration",
            Self::OutOfTravel { .. } | Self::Refused { .. } | Self::Rejected { .. } => return None,
        }))
    }
}

/// A stage.
pub trait Stage: Send {
    /// Which stage this is.
    fn identity(&self) -> DeviceIdentity;

    /// What it can do.
    fn capabilities(&self) -> StageCapabilities;

    /// Starts looking for the zero and returns at once. A stage without switches takes its place as zero.
    fn start_home(&mut self) -> Result<(), StageError>;

    /// Starts a move and returns at once with the target and speed the controller accepted. A speed above the
    /// fastest is accepted as the fastest.
    ///
    /// # Errors
    /// [`StageError::Moving`] during another motion, [`StageError::OutOfTravel`], [`StageError::BadNumber`],
    /// [`StageError::NotHomed`] where [`Homing::Required`]; nothing moves then.
    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError>;

    /// Starts a move of `distance_mm` from here, held within the travel; allowed before homing only where
    /// [`Homing::Absent`].
    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError>;

    /// Position as read back from the controller, and whether it is still moving.
    ///
    /// # Errors
    /// A fault is reported here once it is noticed, and again at every call until [`Stage::clear_fault`] or
    /// [`Stage::reconnect`].
    fn poll(&mut self) -> Result<StageState, StageError>;

    /// Holds a move back; [`Stage::resume`] goes on with it.
    fn hold(&mut self) -> Result<(), StageError>;

    /// Goes on with a move held back.
    fn resume(&mut self) -> Result<(), StageError>;

    /// Stops now and forgets the move. Works in every state, also before homing and in alarm.
    fn stop(&mut self) -> Result<(), StageError>;

    /// Stops it from another thread while a call has not come back.
    fn stop_handle(&self) -> Arc<dyn StopHandle>;

    /// Acknowledges a fault whose cause is gone; without one it does nothing. The position is unknown afterwards if
    /// the fault cost it. A device that takes its time is asked on: [`Stage::poll`] tells the fault until it is gone.
    ///
    /// # Errors
    /// The fault itself, if only [`Stage::reconnect`] helps.
    fn clear_fault(&mut self) -> Result<(), StageError>;

    /// Starts to reach the stage again after [`StageError::Gone`] or [`StageError::NoReply`] and returns at once;
    /// [`Stage::poll`] tells the fault until it is reached. It comes back at rest and must be homed then.
    fn reconnect(&mut self) -> Result<(), StageError>;
}
