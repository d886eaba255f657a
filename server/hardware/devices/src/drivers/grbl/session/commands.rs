//! Commands of stage and laser.

use std::time::{Duration, Instant};

use super::{
    Activity, LaserLease, LineKind, Link, MotionPath, Session, Stopping, Travel, being_opened, stop_bytes,
};
use crate::drivers::controller::{LaserDialogue, StageDialogue};
use crate::drivers::grbl::LaserMode;
use crate::drivers::grbl::fault::{Device, Fault};
use crate::drivers::grbl::identity::{machine_from_stage, stage_from_machine};
use crate::drivers::grbl::protocol::{HOLD, MachineState, RESET, RESUME};
use crate::drivers::progress::Progress;
use crate::drivers::stage_checks::{check_numbers, check_travel};
use crate::lines::serial_controller::Dialogue;
use crate::params::{GRBL_ANSWER_LIMIT, GRBL_BRAKING_S, GRBL_BRAKING_SLACK, GRBL_LASER_ON_BRAKING};
use crate::{
    AcceptedMove, DeviceIdentity, Homing, LASER_LEASE_LIMIT, LaserError, LaserState, StageCapabilities,
    StageError, StageState,
};

/// Feed rate of the `G1` of a laser command, mm/min. Without it GRBL refuses the line (error 22); it causes no motion.
const LASER_FEED_MM_MIN: u32 = 600;

/// Statement for a controller that was never reached.
const UNKNOWN_END: &str = "the laser may stay on: its controller could not be reached";

impl StageDialogue for Session {
    fn identity(&self) -> DeviceIdentity {
        self.machine().map_or_else(|| DeviceIdentity::unknown("grbl"), |machine| machine.identity.clone())
    }

    fn stage_capabilities(&self) -> Option<StageCapabilities> {
        self.machine().map(|machine| machine.capabilities.clone())
    }

    /// `$H`; without homing switches the current position becomes zero.
    fn start_home(&mut self, now: Instant) -> Result<Option<u64>, StageError> {
        self.ready_to_move()?;
        if self.homing() == Homing::Absent {
            self.zero_at_machine_mm =
                self.last_report.map(|last_report| last_report.machine_mm).ok_or(StageError::NotHomed)?;
            self.homed = true;
            return Ok(None);
        }
        self.turn_laser_off(now);
        self.homed = false;
        self.activity = Activity::Homing { done_at: None };
        let ticket = self.send_line("$H".to_owned(), LineKind::Home, now, now + self.config.homing_limit);
        Ok(Some(ticket))
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
        let machine_mm =
            self.on_a_step(machine_from_stage(target_mm, self.zero_at_machine_mm, self.config.reversed));
        let speed_mm_s = self.limited_speed(speed_mm_s);
        let axis = self.config.axis.letter();
        let line = format!("G21G90G94G53G1{axis}{machine_mm:.4}F{:.1}", speed_mm_s * 60.0);
        Ok(self.start_travel(line, machine_mm, speed_mm_s, false, now))
    }

    fn start_jog(
        &mut self,
        distance_mm: f64,
        speed_mm_s: f64,
        now: Instant,
    ) -> Result<(AcceptedMove, Option<u64>), StageError> {
        check_numbers("distance_mm", distance_mm, speed_mm_s)?;
        self.ready_to_move()?;
        if !self.homed && self.homing() == Homing::Required {
            return Err(StageError::NotHomed);
        }
        let from_mm = self.position_mm().ok_or(StageError::NotHomed)?;
        let (low_mm, high_mm) = self.config.travel_mm;
        let wanted_mm = from_mm + distance_mm;
        let target_mm = if self.homed { wanted_mm.clamp(low_mm, high_mm) } else { wanted_mm };
        let machine_mm =
            self.on_a_step(machine_from_stage(target_mm, self.zero_at_machine_mm, self.config.reversed));
        let speed_mm_s = self.limited_speed(speed_mm_s);
        let axis = self.config.axis.letter();
        let line = format!("$J=G21G90G53{axis}{machine_mm:.4}F{:.1}", speed_mm_s * 60.0);
        Ok(self.start_travel(line, machine_mm, speed_mm_s, true, now))
    }

    /// The stage as last reported.
    fn stage_state(&self, now: Instant) -> StageState {
        let held = self
            .last_report
            .is_some_and(|last_report| matches!(last_report.state, MachineState::Held | MachineState::Door));
        let unrequested_motion = self.last_report.is_some_and(|last_report| last_report.state.in_motion());
        let moving = match self.activity {
            Activity::Rest => unrequested_motion || self.reset_awaited() || !self.is_confirmed,
            Activity::Travel(_) => !held,
            Activity::Homing { .. } | Activity::Stopping(_) => true,
        };
        let stopping = matches!(self.activity, Activity::Stopping(_));
        let is_position_known = self.is_confirmed || self.activity != Activity::Rest;
        StageState {
            position_mm: self.position_mm().filter(|_| self.homed && is_position_known),
            measured_at: self.last_report.map_or(now, |last_report| last_report.at),
            moving,
            held: held && !stopping,
            homed: self.homed,
        }
    }

    /// A jog is ended; a move can be continued by [`Session::resume`].
    fn hold(&mut self, now: Instant) -> Result<(), StageError> {
        self.check_fault()?;
        match self.activity {
            Activity::Travel(travel) => {
                if travel.jog {
                    self.send_stop(HOLD, now);
                } else {
                    self.outgoing.push(HOLD);
                }
            }
            Activity::Rest | Activity::Homing { .. } | Activity::Stopping(_) => {}
        }
        Ok(())
    }

    fn resume(&mut self, _now: Instant) -> Result<(), StageError> {
        self.check_fault()?;
        if let Activity::Travel(_) = self.activity {
            self.outgoing.push(RESUME);
        }
        Ok(())
    }

    /// Clears a fault that can be cleared; an alarm is unlocked as soon as possible.
    fn clear_fault(&mut self, now: Instant) -> Result<(), StageError> {
        match &self.fault {
            None => Ok(()),
            Some(fault) if fault.needs_reconnect() => Err(fault.for_stage()),
            Some(fault) => {
                // A reset without effect, as with the emergency stop pressed, is tried again.
                if matches!(fault, Fault::Alarm { .. }) && self.reset.is_none() {
                    self.soft_reset(now);
                }
                self.clearing = true;
                self.tick(now);
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
        if let Some(Fault::Refused { by: Device::Laser, .. }) = self.fault {
            // The line works: the refusal is acknowledged.
            self.fault = None;
        }
        if self.fault.is_none() {
            if self.activity != Activity::Rest || self.laser_lease.is_some() {
                self.send_stop(self.stop_byte(), now);
            }
            return;
        }
        self.down(being_opened());
        self.should_be_open = true;
    }

    fn stage_error(refusal: &Fault) -> StageError {
        refusal.for_stage()
    }
}

impl LaserDialogue for Session {
    fn lost_host(&self) -> &'static str {
        self.machine().map_or(UNKNOWN_END, |machine| machine.lost_host)
    }

    fn switch_on(&mut self, power: f64, lease: Duration, now: Instant) -> Result<u64, LaserError> {
        self.check_laser()?;
        if self.must_home {
            let reason = "the controller is locked until the stage is homed".to_owned();
            return Err(LaserError::Fault { reason, remedy: "home the stage" });
        }
        if self.activity == Activity::Rest && (self.reset_awaited() || self.laser_off_deadline.is_some()) {
            return Err(LaserError::NotYet { reason: "the controller is being reset, or has not confirmed M5" });
        }
        if self.activity != Activity::Rest {
            let reason =
                "the stage is moving or being stopped, and the controller would execute the command only afterwards".to_owned();
            return Err(LaserError::Fault { reason, remedy: "wait until the stage is at rest" });
        }
        let full = self.machine.as_ref().map_or(0.0, |machine| machine.full_power);
        let word = match self.config.laser_mode {
            LaserMode::Constant => "M3",
            LaserMode::Dynamic => "M4",
        };
        self.laser_lease = Some(LaserLease { power, until: now + lease.min(LASER_LEASE_LIMIT) });
        // The laser is on in G1 only (`laser_mode.md`); no axis is given, so that nothing moves.
        let line = format!("G1F{LASER_FEED_MM_MIN}{word}S{:.1}", power * full);
        Ok(self.send_line(line, LineKind::LaserOn, now, now + GRBL_ANSWER_LIMIT))
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
        self.pending.iter().rev().find(|pending| pending.kind == LineKind::LaserOff).map(|pending| pending.ticket)
    }

    /// Checks that the laser's state is known.
    fn laser_known(&self) -> Result<(), LaserError> {
        match &self.fault {
            Some(fault) if fault.needs_reconnect() || *fault == Fault::StrayLight => Err(fault.for_laser()),
            Some(fault @ Fault::Refused { by: Device::Laser, .. }) => Err(fault.for_laser()),
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

    fn laser_error(refusal: &Fault) -> LaserError {
        refusal.for_laser()
    }
}

impl Session {
    fn start_travel(
        &mut self,
        line: String,
        machine_mm: f64,
        speed_mm_s: f64,
        jog: bool,
        now: Instant,
    ) -> (AcceptedMove, Option<u64>) {
        let target_mm = stage_from_machine(machine_mm, self.zero_at_machine_mm, self.config.reversed);
        let ticket = self.send_line(line, LineKind::Travel, now, now + GRBL_ANSWER_LIMIT);
        let last_mm = self.last_report.map_or(machine_mm, |last_report| last_report.machine_mm);
        let path = MotionPath { from_mm: last_mm, to_mm: machine_mm, speed_mm_s, since: now };
        self.path = Some(path);
        self.activity = Activity::Travel(Travel {
            target_mm,
            path,
            jog,
            accepted_at: None,
            last_mm,
            progress: Progress::begun(now),
        });
        (AcceptedMove { target_mm, speed_mm_s }, Some(ticket))
    }

    /// Checks that there is no fault and nothing in progress.
    fn ready_to_move(&self) -> Result<(), StageError> {
        self.check_fault()?;
        let idle = self
            .last_report
            .is_some_and(|last_report| matches!(last_report.state, MachineState::Idle | MachineState::Alarm));
        if self.activity != Activity::Rest || self.reset_awaited() || !idle || !self.is_confirmed {
            return Err(StageError::Moving);
        }
        Ok(())
    }

    /// Stops with this byte and those that belong to it.
    pub(super) fn send_stop(&mut self, byte: u8, now: Instant) {
        self.outgoing.extend_from_slice(stop_bytes(byte));
        self.stop_sent(byte, now);
    }

    /// Continues after the stop's bytes were written.
    pub fn stop_sent(&mut self, byte: u8, now: Instant) {
        if !matches!(self.link, Link::Up) {
            return;
        }
        if self.fault.is_some() {
            return self.reset_sent(now);
        }
        let braking = if self.laser_lease.is_some() { GRBL_LASER_ON_BRAKING } else { self.braking_limit() };
        let until = match self.activity {
            // Stopped again: it is already braking.
            Activity::Stopping(stopping) => stopping.until,
            _ => now + braking,
        };
        let only_jog = match self.activity {
            Activity::Travel(travel) => travel.jog && self.pending.is_empty() && self.laser_lease.is_none(),
            _ => false,
        };
        let after_reset = byte == HOLD && self.reset_awaited();
        self.activity = Activity::Stopping(Stopping { until, only_jog, after_reset, idle_once: false });
        if byte == RESET {
            self.reset_sent(now);
        } else {
            self.query(now);
        }
    }

    /// Twice the braking time from the fastest move, plus the time of the report of rest.
    fn braking_limit(&self) -> Duration {
        let Some(machine) = &self.machine else { return GRBL_BRAKING_SLACK };
        let acceleration_mm_s2 = machine.capabilities.acceleration_mm_s2.unwrap_or(f64::INFINITY).max(1.0);
        let braking_s = (machine.capabilities.max_speed_mm_s / acceleration_mm_s2).clamp(0.0, GRBL_BRAKING_S);
        2 * Duration::from_secs_f64(braking_s) + GRBL_BRAKING_SLACK
    }

    /// Faults of the stage do not concern a laser that is known to be off, except that it cannot be
    /// switched on.
    fn check_laser(&self) -> Result<(), LaserError> {
        match self.fault_of(Device::Laser) {
            Some(fault) => Err(fault.for_laser()),
            None => Ok(()),
        }
    }

    fn on_a_step(&self, machine_mm: f64) -> f64 {
        (machine_mm * self.config.steps_per_mm).round() / self.config.steps_per_mm
    }

    fn limited_speed(&self, speed_mm_s: f64) -> f64 {
        self.machine.as_ref().map_or(speed_mm_s, |machine| speed_mm_s.min(machine.capabilities.max_speed_mm_s))
    }
}
