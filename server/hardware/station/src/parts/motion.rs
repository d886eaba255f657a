//! The stage as used by the station thread: one motion at a time, monitored until it ends.

use std::time::{Duration, Instant};

use devices::{AcceptedMove, Stage, StageError, StageState};

use crate::params::{
    HOMING_LIMIT, JOG_SILENCE, MOVE_MARGIN, NO_PROGRESS_LIMIT, POLL_IDLE, POLL_MOVING, POSITION_WAIT,
    REPORT_ROUNDING_MM, REST_LIMIT, SETTLE_LIMIT,
};
use crate::parts::track::Track;

/// Purpose of the current motion.
#[derive(Debug, Clone, Copy)]
enum MotionGoal {
    Move { target_mm: f64, progress: Progress, rest_since: Option<Instant> },
    Home,
    Jog { velocity_mm_s: f64, until: Instant },
    Rest,
}

/// Last visible progress of a move.
#[derive(Debug, Clone, Copy)]
struct Progress {
    position_mm: f64,
    at: Instant,
    limit: Duration,
}

/// A motion that ended successfully.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CompletedMotion {
    /// At the target and settled; the position read back.
    Moved(f64),
    /// Homed.
    Homed,
    /// At rest after a jog or a stop.
    Rested,
}

/// Position at which a frame was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FramePosition {
    /// This position; `None` if unknown.
    Known(Option<f64>),
    /// Known only after the next reading.
    Pending,
}

/// The stage and its tracked state.
pub struct Motion {
    device: Box<dyn Stage>,
    state: Option<StageState>,
    track: Track,
    goal: Option<MotionGoal>,
    begun_at: Instant,
    deadline: Instant,
    rest_since: Option<Instant>,
    position_valid: bool,
    polled_at: Option<Instant>,
}

impl Motion {
    /// Wraps a stage that was just opened.
    pub fn new(device: Box<dyn Stage>) -> Self {
        let now = Instant::now();
        Self {
            device,
            state: None,
            track: Track::default(),
            goal: None,
            begun_at: now,
            deadline: now,
            rest_since: None,
            position_valid: true,
            polled_at: None,
        }
    }

    /// The underlying stage, for calls that do not move it.
    pub fn device(&mut self) -> &mut dyn Stage {
        &mut *self.device
    }

    /// Last position read back, or `None` if unknown.
    pub fn position_mm(&self) -> Option<f64> {
        self.state.filter(|_| self.position_valid)?.position_mm
    }

    /// Whether the stage is homed; not before homing has ended, since a driver that reports it earlier may not know its
    /// position yet.
    pub fn homed(&self) -> bool {
        let is_homing = matches!(self.goal, Some(MotionGoal::Home));
        self.position_valid && !is_homing && self.state.is_some_and(|state| state.homed)
    }

    /// Whether it moves or may move.
    pub fn is_moving(&self) -> bool {
        self.goal.is_some() || self.state.is_some_and(|state| state.moving)
    }

    /// Whether it is moving to a target; coming to rest does not count.
    pub fn is_under_way(&self) -> bool {
        !matches!(self.goal, None | Some(MotionGoal::Rest))
    }

    /// Reads the state while no motion is monitored: checks that the stage works and whether a stop has come to rest.
    pub fn check(&mut self) -> Result<(), StageError> {
        let state = self.device.poll()?;
        self.take(state);
        if self.goal.is_some_and(|goal| matches!(goal, MotionGoal::Rest))
            && !state.moving
            && state.measured_at >= self.begun_at
        {
            self.goal = None;
        }
        Ok(())
    }

    /// Whether a reading is due.
    fn is_due(&self, now: Instant) -> bool {
        let period = if self.is_moving() { POLL_MOVING } else { POLL_IDLE };
        self.polled_at.is_none_or(|at| now.saturating_duration_since(at) >= period)
    }

    /// After a fault of the stage no position is valid until it is homed again.
    pub fn invalidate_position(&mut self) {
        self.position_valid = false;
        self.goal = None;
        self.track.clear();
    }

    /// Duration of a move from rest to rest, seconds; infinite if the position is unknown.
    pub fn travel_s(&self, target_mm: f64, speed_mm_s: f64) -> f64 {
        let distance_mm = self.position_mm().map_or(f64::INFINITY, |position_mm| (target_mm - position_mm).abs());
        match self.device.capabilities().acceleration_mm_s2.filter(|a| *a > 0.0) {
            Some(a) if distance_mm < speed_mm_s * speed_mm_s / a => 2.0 * (distance_mm / a).sqrt(),
            Some(a) => distance_mm / speed_mm_s + speed_mm_s / a,
            None => distance_mm / speed_mm_s,
        }
    }

    /// Starts a move.
    pub fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        let Some(from_mm) = self.position_mm() else { return Err(StageError::NotHomed) };
        let accepted = self.device.start_move(target_mm, speed_mm_s)?;
        let resolution_mm = self.tolerance_mm();
        let limit = NO_PROGRESS_LIMIT.max(Duration::from_secs_f64(
            (4.0 * resolution_mm / accepted.speed_mm_s).clamp(0.0, HOMING_LIMIT.as_secs_f64()),
        ));
        let travel_s = (accepted.target_mm - from_mm).abs() / accepted.speed_mm_s + 2.0 * self.ramp_s(&accepted);
        let progress = Progress { position_mm: from_mm, at: Instant::now(), limit };
        let goal = MotionGoal::Move { target_mm: accepted.target_mm, progress, rest_since: None };
        self.begin(goal, Duration::from_secs_f64(travel_s.min(1e6)) + MOVE_MARGIN);
        Ok(accepted)
    }

    /// Starts homing.
    pub fn start_home(&mut self) -> Result<(), StageError> {
        self.device.start_home()?;
        self.begin(MotionGoal::Home, HOMING_LIMIT);
        Ok(())
    }

    /// Starts or continues a jog; it ends automatically unless this is repeated.
    pub fn jog(&mut self, velocity_mm_s: f64) -> Result<Option<AcceptedMove>, StageError> {
        match &mut self.goal {
            Some(MotionGoal::Jog { velocity_mm_s: present, until }) if *present == velocity_mm_s => {
                *until = Instant::now() + JOG_SILENCE;
                Ok(None)
            }
            Some(MotionGoal::Jog { .. }) => self.stop().map(|()| None),
            Some(MotionGoal::Rest) => Ok(None),
            Some(_) => Err(StageError::Moving),
            None if velocity_mm_s == 0.0 => Ok(None),
            None => self.start_jog(velocity_mm_s).map(Some),
        }
    }

    fn start_jog(&mut self, velocity_mm_s: f64) -> Result<AcceptedMove, StageError> {
        let travel = self.device.capabilities().travel_mm;
        let distance_mm = (travel.1 - travel.0).copysign(velocity_mm_s);
        let accepted = self.device.start_jog(distance_mm, velocity_mm_s.abs())?;
        self.begin(MotionGoal::Jog { velocity_mm_s, until: Instant::now() + JOG_SILENCE }, HOMING_LIMIT);
        Ok(accepted)
    }

    /// Stops; [`Motion::update`] reports when the stage is at rest.
    pub fn stop(&mut self) -> Result<(), StageError> {
        let result = self.device.stop();
        let capabilities = self.device.capabilities();
        let acceleration_mm_s2 = capabilities.acceleration_mm_s2.filter(|a| *a > 0.0);
        // The driver waits twice the ramp before a harder stop.
        let ramps_s = acceleration_mm_s2.map_or(0.0, |a| 2.0 * capabilities.max_speed_mm_s / a);
        let ramps = Duration::from_secs_f64(ramps_s.clamp(0.0, HOMING_LIMIT.as_secs_f64()));
        self.begin(MotionGoal::Rest, REST_LIMIT + ramps);
        result
    }

    /// Reads the state if due and monitors the motion.
    ///
    /// # Errors
    /// The error of the stage, or [`StageError::Stalled`] if a move makes no progress.
    pub fn update(&mut self, now: Instant) -> Result<Option<CompletedMotion>, StageError> {
        if let Some(MotionGoal::Jog { until, .. }) = self.goal
            && now >= until
        {
            self.stop()?;
        }
        if !self.is_due(now) {
            return Ok(None);
        }
        self.polled_at = Some(now);
        let state = self.device.poll()?;
        self.take(state);
        if state.measured_at < self.begun_at {
            return self.timeout_error(now).map_or(Ok(None), Err);
        }
        self.monitor(&state, now)
    }

    /// Position of the stage at `at`, for a frame reported at `now`.
    pub fn frame_position(&self, at: Instant, now: Instant) -> FramePosition {
        let Some(position_mm) = self.position_mm() else { return FramePosition::Known(None) };
        if self.goal.is_none() && self.rest_since.is_some_and(|since| since <= at) {
            return FramePosition::Known(Some(position_mm));
        }
        if self.track.reaches(at) || now.saturating_duration_since(at) > POSITION_WAIT {
            return FramePosition::Known(self.track.position_mm(at));
        }
        FramePosition::Pending
    }

    /// Position at a past time.
    pub fn position_at_mm(&self, at: Instant) -> Option<f64> {
        match self.frame_position(at, at) {
            FramePosition::Known(position_mm) => position_mm,
            FramePosition::Pending => None,
        }
    }

    /// Permitted deviation of the position read back from a target.
    pub fn tolerance_mm(&self) -> f64 {
        self.device.capabilities().resolution_mm.max(0.0) + REPORT_ROUNDING_MM
    }

    fn ramp_s(&self, accepted: &AcceptedMove) -> f64 {
        let acceleration = self.device.capabilities().acceleration_mm_s2.filter(|a| *a > 0.0);
        acceleration.map_or(0.0, |a| accepted.speed_mm_s / a)
    }

    fn begin(&mut self, goal: MotionGoal, limit: Duration) {
        let now = Instant::now();
        if let (None, Some(position_mm)) = (self.goal, self.position_mm()) {
            // At rest until now: interpolation begins here, not at the last idle reading.
            self.track.push(now, position_mm);
        }
        self.goal = Some(goal);
        (self.begun_at, self.deadline, self.rest_since, self.polled_at) = (now, now + limit, None, None);
    }

    fn take(&mut self, state: StageState) {
        match state.position_mm {
            Some(position_mm) if self.position_valid => self.track.push(state.measured_at, position_mm),
            _ => self.track.clear(),
        }
        if state.moving {
            self.rest_since = None;
        } else if self.rest_since.is_none() && state.measured_at >= self.begun_at {
            self.rest_since = Some(state.measured_at);
        }
        self.state = Some(state);
    }

    fn monitor(&mut self, state: &StageState, now: Instant) -> Result<Option<CompletedMotion>, StageError> {
        let tolerance_mm = self.tolerance_mm();
        let ended = match &mut self.goal {
            None => None,
            Some(MotionGoal::Home) => (!state.moving && state.homed).then_some(CompletedMotion::Homed),
            Some(MotionGoal::Rest | MotionGoal::Jog { .. }) => (!state.moving).then_some(CompletedMotion::Rested),
            Some(MotionGoal::Move { target_mm, progress, rest_since }) => {
                let Some(position_mm) = state.position_mm else { return Err(StageError::NotHomed) };
                let stalled = StageError::Stalled { target_mm: *target_mm, actual_mm: position_mm };
                if (position_mm - progress.position_mm).abs() > tolerance_mm || state.held {
                    *progress = Progress { position_mm, at: state.measured_at, ..*progress };
                }
                if state.held {
                    self.deadline = self.deadline.max(now + MOVE_MARGIN);
                }
                let since = if state.moving { None } else { Some(rest_since.unwrap_or(now)) };
                *rest_since = since;
                let there = (position_mm - *target_mm).abs() <= tolerance_mm;
                if !there && since.is_some_and(|since| now - since > SETTLE_LIMIT) {
                    return Err(stalled);
                }
                // Based on reports; silence is reported by the driver.
                if state.moving
                    && !there
                    && state.measured_at.saturating_duration_since(progress.at) > progress.limit
                {
                    return Err(stalled);
                }
                (there && !state.moving).then_some(CompletedMotion::Moved(position_mm))
            }
        };
        match ended {
            Some(completed) => {
                self.goal = None;
                self.position_valid |= completed == CompletedMotion::Homed;
                Ok(Some(completed))
            }
            None => self.timeout_error(now).map_or(Ok(None), Err),
        }
    }

    /// The error of a motion that takes too long.
    fn timeout_error(&self, now: Instant) -> Option<StageError> {
        if self.goal.is_none() || now < self.deadline {
            return None;
        }
        let waited_ms = (now - self.begun_at).as_millis() as u64;
        let no_response = |command: &str| StageError::NoResponse { command: command.to_owned(), waited_ms };
        Some(match self.goal? {
            MotionGoal::Move { target_mm, .. } => match self.position_mm() {
                Some(actual_mm) => StageError::Stalled { target_mm, actual_mm },
                None => StageError::NotHomed,
            },
            MotionGoal::Home => no_response("home"),
            MotionGoal::Jog { .. } => no_response("jog"),
            MotionGoal::Rest => no_response("stop"),
        })
    }
}

#[cfg(test)]
#[path = "motion_tests.rs"]
mod tests;
