//! Commands of the stage.

use std::time::Instant;

use super::{Activity, CommandKind, Link, Session, Travel, being_opened};
use crate::drivers::controller::StageDialogue;
use crate::drivers::progress::Progress;
use crate::drivers::stage_checks::{check_numbers, check_travel};
use crate::lines::serial_controller::Dialogue;
use crate::{AcceptedMove, DeviceIdentity, StageCapabilities, StageError, StageState};

/// The device's data for a speed of one microstep a second (ASCII Protocol Manual, "data conversion").
pub const SPEED_DATA: f64 = 1.6384;

impl StageDialogue for Session {
    fn identity(&self) -> DeviceIdentity {
        let unknown = || DeviceIdentity { vendor: "Zaber".to_owned(), ..DeviceIdentity::unknown("zaber") };
        self.machine().map_or_else(unknown, |machine| machine.identity.clone())
    }

    fn stage_capabilities(&self) -> Option<StageCapabilities> {
        self.machine().map(|machine| machine.capabilities.clone())
    }

    fn start_home(&mut self, now: Instant) -> Result<Option<u64>, StageError> {
        self.ready_to_move()?;
        self.homed = false;
        self.activity = Activity::Homing { begun_at: now, accepted_at: None };
        Ok(Some(self.send(self.config.axis, "home", CommandKind::Home, now)))
    }

    fn start_move(
        &mut self,
        target_mm: f64,
        speed_mm_s: f64,
        now: Instant,
    ) -> Result<(AcceptedMove, Option<u64>), StageError> {
        check_numbers("target_mm", target_mm, speed_mm_s)?;
        self.ready_to_move()?;
        if !self.homed {
            return Err(StageError::NotHomed);
        }
        check_travel(target_mm, self.config.travel_mm)?;
        Ok(self.start_travel(target_mm, speed_mm_s, now))
    }

    fn start_jog(
        &mut self,
        distance_mm: f64,
        speed_mm_s: f64,
        now: Instant,
    ) -> Result<(AcceptedMove, Option<u64>), StageError> {
        check_numbers("distance_mm", distance_mm, speed_mm_s)?;
        self.ready_to_move()?;
        let from_mm = self.position_mm().filter(|_| self.homed).ok_or(StageError::NotHomed)?;
        let (low_mm, high_mm) = self.config.travel_mm;
        Ok(self.start_travel((from_mm + distance_mm).clamp(low_mm, high_mm), speed_mm_s, now))
    }

    /// The stage as last reported.
    fn stage_state(&self, now: Instant) -> StageState {
        let busy = self.seen.as_ref().is_some_and(|seen| seen.busy);
        let moving = match self.activity {
            Activity::Rest => busy,
            Activity::Held(_) => false,
            Activity::Travel(_) | Activity::Homing { .. } | Activity::Stopping { .. } => true,
        };
        StageState {
            position_mm: if self.homed { self.position_mm() } else { None },
            measured_at: self.seen.as_ref().map_or(now, |seen| seen.at),
            moving,
            held: matches!(self.activity, Activity::Held(_)),
            homed: self.homed,
        }
    }

    /// The protocol has no hold: a move is stopped, and sent again by [`Session::resume`].
    fn hold(&mut self, now: Instant) -> Result<(), StageError> {
        self.check_fault()?;
        if let Activity::Travel(travel) = self.activity {
            self.send_stop(now);
            self.activity = Activity::Stopping { sent_at: now, then: Some(travel) };
        }
        Ok(())
    }

    fn resume(&mut self, now: Instant) -> Result<(), StageError> {
        self.check_fault()?;
        if let Activity::Held(travel) = self.activity {
            self.send_travel(travel, now);
        }
        Ok(())
    }

    /// Clears a fault that can be cleared; the device is requested to clear its flag, and the fault persists until it
    /// has.
    fn clear_fault(&mut self, now: Instant) -> Result<(), StageError> {
        match &self.fault {
            None => Ok(()),
            Some(fault) if !matches!(self.link, Link::Up) => Err(fault.clone()),
            Some(_) => {
                self.clearing = true;
                self.send(self.config.axis, "warnings clear", CommandKind::Clear, now);
                Ok(())
            }
        }
    }

    /// Reopens the line, unless that is in progress; if the device works, it is stopped instead.
    fn reconnect(&mut self, now: Instant) {
        if self.should_be_open || matches!(self.link, Link::Opening(_)) {
            return;
        }
        if self.fault.is_none() {
            if self.activity != Activity::Rest {
                self.stop_begun(now);
            }
            return;
        }
        self.down(being_opened());
        self.should_be_open = true;
    }

    fn stage_error(refusal: &StageError) -> StageError {
        refusal.clone()
    }
}

impl Session {
    fn start_travel(&mut self, target_mm: f64, speed_mm_s: f64, now: Instant) -> (AcceptedMove, Option<u64>) {
        let fastest = self.machine.as_ref().map_or(f64::INFINITY, |machine| machine.capabilities.max_speed_mm_s);
        let speed_mm_s = speed_mm_s.min(fastest);
        let target_steps = self.steps_from_mm(target_mm);
        let target_mm = self.mm_from_steps(target_steps);
        let speed_data = ((speed_mm_s * self.steps_per_mm() * SPEED_DATA).round() as i64).max(1);
        let last_steps = self.seen.as_ref().map_or(target_steps, |seen| seen.steps);
        let travel = Travel {
            target_mm,
            target_steps,
            speed_data,
            accepted_at: None,
            last_steps,
            progress: Progress::begun(now),
        };
        (AcceptedMove { target_mm, speed_mm_s }, Some(self.send_travel(travel, now)))
    }

    fn send_travel(&mut self, travel: Travel, now: Instant) -> u64 {
        self.activity = Activity::Travel(Travel { accepted_at: None, progress: Progress::begun(now), ..travel });
        let (axis, Travel { target_steps, speed_data, .. }) = (self.config.axis, travel);
        self.send(axis, &format!("move abs {target_steps} {speed_data}"), CommandKind::Move, now)
    }

    /// Checks that there is no fault and nothing in progress.
    fn ready_to_move(&self) -> Result<(), StageError> {
        self.check_fault()?;
        let busy = self.seen.as_ref().is_none_or(|seen| seen.busy);
        let stopping = self.pending.iter().any(|pending| pending.what == CommandKind::Stop);
        if self.activity != Activity::Rest || busy || stopping {
            return Err(StageError::Moving);
        }
        Ok(())
    }

    /// A stop was sent bypassing this session. It is sent once more after everything that the session wrote before it
    /// knew of the stop, so that no move follows the last stop.
    pub(super) fn stop_begun(&mut self, now: Instant) {
        if !matches!(self.link, Link::Up) {
            return;
        }
        self.send_stop(now);
        if matches!(self.activity, Activity::Homing { .. }) {
            self.homed = false;
        }
        self.activity = Activity::Stopping { sent_at: now, then: None };
        self.query_position(now);
    }
}
