//! Commands of stage and laser.

use std::time::{Duration, Instant};

use super::{Activity, Device, LaserLease, LineKind, Link, Session, Stopping, Travel, being_opened, for_laser};
use crate::drivers::controller::{LaserDialogue, StageDialogue};
use crate::drivers::stage_checks::{check_numbers, check_travel};
use crate::lines::serial_controller::Dialogue;
use crate::params::MARLIN_DARK_LIMIT;
use crate::{
    AcceptedMove, DeviceIdentity, LASER_LEASE_LIMIT, LaserError, LaserState, StageCapabilities, StageError,
    StageState,
};

impl StageDialogue for Session {
    fn identity(&self) -> DeviceIdentity {
        self.machine().map_or_else(|| DeviceIdentity::unknown("marlin"), |machine| machine.identity.clone())
    }

    fn stage_capabilities(&self) -> Option<StageCapabilities> {
        self.machine().map(|machine| machine.capabilities.clone())
    }

    fn start_home(&mut self, now: Instant) -> Result<Option<u64>, StageError> {
        self.ready_to_move()?;
        self.turn_laser_off(now);
        self.homed = false;
        self.activity = Activity::Homing { begun_at: now, done_at: None };
        let letter = self.config.axis.letter();
        Ok(Some(self.want(format!("G28 {letter}"), LineKind::Home)))
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
        self.start_travel(target_mm, speed_mm_s, now)
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
        self.start_travel((from_mm + distance_mm).clamp(low_mm, high_mm), speed_mm_s, now)
    }

    /// The stage as last reported.
    fn stage_state(&self, now: Instant) -> StageState {
        StageState {
            position_mm: if self.homed { self.position_mm() } else { None },
            measured_at: self.seen.map_or(now, |seen| seen.at),
            moving: !matches!(self.activity, Activity::Rest | Activity::Held(_)),
            held: matches!(self.activity, Activity::Held(_)),
            homed: self.homed,
        }
    }

    /// No more pieces are sent; [`Session::resume`] sends the rest.
    fn hold(&mut self, now: Instant) -> Result<(), StageError> {
        self.sound()?;
        if let Activity::Travel(travel) = self.activity {
            self.begin_stop(Some(travel), now);
        }
        Ok(())
    }

    fn resume(&mut self, now: Instant) -> Result<(), StageError> {
        self.sound()?;
        if let (Activity::Held(travel), Some(seen)) = (self.activity, self.seen) {
            let (sent_steps, last_steps) = (seen.steps, seen.steps);
            self.activity = Activity::Travel(Travel {
                sent_steps,
                last_steps,
                last_progress_at: now,
                settled_at: None,
                ..travel
            });
        }
        Ok(())
    }

    fn clear_fault(&mut self, now: Instant) -> Result<(), StageError> {
        match &self.fault {
            None => Ok(()),
            Some((fault, _)) if !matches!(self.link, Link::Up) => Err(fault.clone()),
            Some(_) => {
                self.fault = None;
                self.asked_position_at = None;
                self.send_next(now);
                Ok(())
            }
        }
    }

    /// Reopens the line, unless that is in progress; if the controller works, it is stopped and its laser turned off
    /// instead.
    fn reconnect(&mut self, now: Instant) {
        if self.should_be_open || matches!(self.link, Link::Opening(_)) {
            return;
        }
        if let Some((StageError::Rejected { .. }, Device::Laser)) = self.fault {
            self.fault = None;
        }
        if self.fault.is_none() {
            self.turn_laser_off(now);
            self.begin_stop(None, now);
            return;
        }
        self.down(being_opened());
        self.should_be_open = true;
    }

    fn stage_error(refusal: &StageError) -> StageError {
        refusal.clone()
    }
}

impl LaserDialogue for Session {
    /// The firmware does not state its build options.
    fn lost_host(&self) -> &'static str {
        "the laser goes off a second after the last motion (LASER_SAFETY_TIMEOUT_MS as delivered); firmware built \
         without that timeout leaves it on until it is reset"
    }

    fn switch_on(&mut self, power: f64, lease: Duration, now: Instant) -> Result<u64, LaserError> {
        self.laser_sound()?;
        if self.activity == Activity::Rest && self.dark_by.is_some() {
            return Err(LaserError::NotYet { reason: "its controller has not confirmed M5" });
        }
        if self.activity != Activity::Rest {
            let reason =
                "the stage is moving or being stopped, and the controller would wait for its end".to_owned();
            return Err(LaserError::Fault { reason, remedy: "wait until the stage rests" });
        }
        self.lit = Some(LaserLease { power, until: now + lease.min(LASER_LEASE_LIMIT) });
        self.light_kept_at = Some(now);
        Ok(self.want(format!("M3 S{:.0}", power * self.config.full_power), LineKind::LaserOn))
    }

    fn renew(&mut self, lease: Duration, now: Instant) -> Result<(), LaserError> {
        self.laser_sound()?;
        if let Some(lit) = self.lit.as_mut().filter(|lit| now < lit.until && self.dark_by.is_none()) {
            lit.until = now + lease.min(LASER_LEASE_LIMIT);
        }
        Ok(())
    }

    /// Switches the laser off; returns the ticket of the line that does so.
    fn switch_off(&mut self, now: Instant) -> Option<u64> {
        self.turn_laser_off(now);
        let off = self.wanted.iter().chain(self.pending.as_ref().map(|pending| &pending.wanted));
        off.filter(|wanted| wanted.kind == LineKind::LaserOff).map(|wanted| wanted.ticket).max()
    }

    /// Checks that the laser's state is known. Over a working link it is.
    fn laser_known(&self) -> Result<(), LaserError> {
        match &self.fault {
            Some((fault, _)) if !matches!(self.link, Link::Up) => Err(for_laser(fault)),
            Some((fault @ StageError::Rejected { .. }, Device::Laser)) => Err(for_laser(fault)),
            _ => Ok(()),
        }
    }

    /// The laser's last known state.
    fn laser_state(&self) -> LaserState {
        LaserState {
            emitting: self.lit.is_some(),
            power: self.lit.map_or(0.0, |lit| lit.power),
            interlock_closed: None,
        }
    }

    fn laser_error(refusal: &StageError) -> LaserError {
        LaserError::Controller(refusal.clone())
    }
}

impl Session {
    fn start_travel(
        &mut self,
        target_mm: f64,
        speed_mm_s: f64,
        now: Instant,
    ) -> Result<(AcceptedMove, Option<u64>), StageError> {
        let from_steps = self.seen.ok_or(StageError::NotHomed)?.steps;
        let fastest = self.machine.as_ref().map_or(f64::INFINITY, |machine| machine.capabilities.max_speed_mm_s);
        let speed_mm_s = speed_mm_s.min(fastest);
        let target_steps = self.steps_from_mm(target_mm);
        let target_mm = self.mm_from_steps(target_steps);
        self.activity = Activity::Travel(Travel {
            target_mm,
            target_steps,
            speed_mm_s,
            sent_steps: from_steps,
            last_steps: from_steps,
            last_progress_at: now,
            settled_at: None,
        });
        self.send_next(now);
        Ok((AcceptedMove { target_mm, speed_mm_s }, None))
    }

    /// Checks that there is no fault and nothing in progress.
    fn ready_to_move(&self) -> Result<(), StageError> {
        self.sound()?;
        if self.activity != Activity::Rest { Err(StageError::Moving) } else { Ok(()) }
    }

    /// The current pieces run out: no piece follows, and the firmware reports when nothing moves.
    pub(super) fn begin_stop(&mut self, then: Option<Travel>, now: Instant) {
        match self.activity {
            Activity::Travel(travel) => {
                let until = now + self.run_out(travel.speed_mm_s);
                self.activity = Activity::Stopping(Stopping { until, settled_at: None, then, cut_short: false });
                self.want("M400".to_owned(), LineKind::Settle);
                self.send_next(now);
            }
            Activity::Held(_) => self.activity = Activity::Rest,
            Activity::Stopping(stopping) if then.is_none() => {
                self.activity = Activity::Stopping(Stopping { then: None, ..stopping });
            }
            // Ended by its own limit or by `M112`.
            Activity::Homing { .. } | Activity::Rest | Activity::Stopping(_) => {}
        }
    }

    /// `M5`, before anything else that waits; it comes after the motion, so that a move is stopped.
    pub(super) fn turn_laser_off(&mut self, now: Instant) {
        let Some(_) = self.lit.filter(|_| self.dark_by.is_none()) else { return };
        let mut limit = MARLIN_DARK_LIMIT;
        if let Activity::Travel(travel) = self.activity {
            limit += self.run_out(travel.speed_mm_s);
            self.begin_stop(None, now);
        }
        self.dark_by = Some(now + limit);
        // A light that was not sent yet is no longer sent.
        self.wanted.retain(|wanted| wanted.kind != LineKind::LaserOn);
        self.want("M5".to_owned(), LineKind::LaserOff);
        self.wanted.rotate_right(1);
        self.send_next(now);
    }

    fn laser_sound(&self) -> Result<(), LaserError> {
        self.fault_of(Device::Laser).map_or(Ok(()), |fault| Err(for_laser(fault)))
    }
}
