//! Commands of stage and laser.

use std::time::{Duration, Instant};

use super::{Activity, Device, LaserLease, LineKind, Link, Session, Stopping, Travel, being_opened, for_laser};
use crate::drivers::controller::{LaserDialogue, StageDialogue};
use crate::drivers::progress::Progress;
use crate::drivers::stage_checks::{check_numbers, check_travel};
use crate::lines::serial_controller::Dialogue;
use crate::params::MARLIN_LASER_OFF_LIMIT;
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
        Ok(Some(self.enqueue(format!("G28 {letter}"), LineKind::Home)))
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
            measured_at: self.last_report.map_or(now, |last_report| last_report.at),
            moving: !matches!(self.activity, Activity::Rest | Activity::Held(_)),
            held: matches!(self.activity, Activity::Held(_)),
            homed: self.homed,
        }
    }

    /// No more pieces are sent; [`Session::resume`] sends the rest.
    fn hold(&mut self, now: Instant) -> Result<(), StageError> {
        self.check_fault()?;
        if let Activity::Travel(travel) = self.activity {
            self.begin_stop(Some(travel), now);
        }
        Ok(())
    }

    fn resume(&mut self, now: Instant) -> Result<(), StageError> {
        self.check_fault()?;
        if let (Activity::Held(travel), Some(last_report)) = (self.activity, self.last_report) {
            let (sent_steps, last_steps) = (last_report.steps, last_report.steps);
            self.activity = Activity::Travel(Travel {
                sent_steps,
                last_steps,
                progress: Progress::begun(now),
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
                self.position_queried_at = None;
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
        self.check_laser()?;
        if self.activity == Activity::Rest && self.laser_off_deadline.is_some() {
            return Err(LaserError::NotYet { reason: "the controller has not confirmed M5" });
        }
        if self.activity != Activity::Rest {
            let reason =
                "the stage is moving or being stopped, and the controller would execute the command only afterwards".to_owned();
            return Err(LaserError::Fault { reason, remedy: "wait until the stage is at rest" });
        }
        self.laser_lease = Some(LaserLease { power, until: now + lease.min(LASER_LEASE_LIMIT) });
        self.light_kept_at = Some(now);
        Ok(self.enqueue(format!("M3 S{:.0}", power * self.config.full_power), LineKind::LaserOn))
    }

    fn renew(&mut self, lease: Duration, now: Instant) -> Result<(), LaserError> {
        self.check_laser()?;
        if let Some(laser_lease) = self
            .laser_lease
            .as_mut()
            .filter(|laser_lease| now < laser_lease.until && self.laser_off_deadline.is_none())
        {
            laser_lease.until = now + lease.min(LASER_LEASE_LIMIT);
        }
        Ok(())
    }

    /// Switches the laser off; returns the ticket of the line that does so.
    fn switch_off(&mut self, now: Instant) -> Option<u64> {
        self.turn_laser_off(now);
        let off = self.queued.iter().chain(self.pending.as_ref().map(|pending| &pending.queued));
        off.filter(|queued| queued.kind == LineKind::LaserOff).map(|queued| queued.ticket).max()
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
            emitting: self.laser_lease.is_some(),
            power: self.laser_lease.map_or(0.0, |laser_lease| laser_lease.power),
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
        let from_steps = self.last_report.ok_or(StageError::NotHomed)?.steps;
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
            progress: Progress::begun(now),
            settled_at: None,
        });
        self.send_next(now);
        Ok((AcceptedMove { target_mm, speed_mm_s }, None))
    }

    /// Checks that there is no fault and nothing in progress.
    fn ready_to_move(&self) -> Result<(), StageError> {
        self.check_fault()?;
        if self.activity != Activity::Rest { Err(StageError::Moving) } else { Ok(()) }
    }

    /// The current pieces run out: no piece follows, and the firmware reports when nothing moves.
    pub(super) fn begin_stop(&mut self, then: Option<Travel>, now: Instant) {
        match self.activity {
            Activity::Travel(travel) => {
                let until = now + self.run_out(travel.speed_mm_s);
                self.activity =
                    Activity::Stopping(Stopping { until, settled_at: None, then, is_quick_stop: false });
                self.enqueue("M400".to_owned(), LineKind::Settle);
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
        let Some(_) = self.laser_lease.filter(|_| self.laser_off_deadline.is_none()) else { return };
        let mut limit = MARLIN_LASER_OFF_LIMIT;
        if let Activity::Travel(travel) = self.activity {
            limit += self.run_out(travel.speed_mm_s);
            self.begin_stop(None, now);
        }
        self.laser_off_deadline = Some(now + limit);
        // A light that was not sent yet is no longer sent.
        self.queued.retain(|queued| queued.kind != LineKind::LaserOn);
        self.enqueue("M5".to_owned(), LineKind::LaserOff);
        self.queued.rotate_right(1);
        self.send_next(now);
    }

    fn check_laser(&self) -> Result<(), LaserError> {
        self.fault_of(Device::Laser).map_or(Ok(()), |fault| Err(for_laser(fault)))
    }
}
