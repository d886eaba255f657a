//! Reset: faults are acknowledged and devices reconnected. They are ready afterwards, never active.

use std::time::Instant;

use devices::AcceptedMove;

use crate::params::RESET_LIMIT;
use crate::parts::faults::fault_of;
use crate::parts::machine::Event;
use crate::shared::refusal::StationRefusal;
use crate::shared::status::Fault;
use crate::station_thread::command::Reply;
use crate::station_thread::station::{Revoked, Station};

/// The answer to a job that a reset ended.
const RESET: &str = "a reset";

/// A reset in progress.
pub struct Resetting {
    until: Instant,
    replies: Vec<Reply<Option<AcceptedMove>>>,
    /// Faults that remain, as last checked.
    open: Vec<Fault>,
}

impl Station {
    /// Acknowledges all faults and begins to reconnect failed devices. Accepted in every state: current work ends, with
    /// the laser off and the stage at rest. Requests during a reset get the same answer.
    pub(crate) fn begin_reset(&mut self, reply: Reply<Option<AcceptedMove>>) {
        if let Some(resetting) = &mut self.resetting {
            resetting.replies.push(reply);
            return;
        }
        self.end_live();
        if self.holder.is_some() || self.task.is_some() {
            let by_reset = || StationRefusal::Stopped { actor: RESET.to_owned() };
            self.end_work(|_| by_reset());
            self.turn_laser_off();
            self.come_to_rest();
            self.revoke_lease(Some(Revoked::Stopped { actor: RESET.to_owned() }));
        }
        self.transition(Event::Reset);
        let open = std::mem::take(&mut self.faults);
        for fault in &open {
            self.start_recovery(fault);
        }
        self.begin_opening();
        self.resetting = Some(Resetting { until: Instant::now() + RESET_LIMIT, replies: vec![reply], open });
    }

    /// Starts the recovery from a fault; whether it succeeded is checked later.
    fn start_recovery(&mut self, fault: &Fault) {
        let lost = matches!(
            fault.kind,
            "disconnected" | "no_response" | "unreadable" | "wrong_device" | "silent" | "fault"
        );
        let all = fault.device == "station";
        if let Some(camera) = self.camera.as_mut().filter(|_| all || fault.device == "camera") {
            let _ = if lost { camera.device().reconnect() } else { camera.stop() };
        }
        if let Some(stage) = self.stage.as_mut().filter(|_| all || fault.device == "stage") {
            let cleared = if lost { Err(()) } else { stage.device().clear_fault().map_err(drop) };
            let _ = cleared.or_else(|()| stage.device().reconnect());
        }
        if let Some(laser) = self.laser.as_mut().filter(|_| all || fault.device == "laser") {
            let _ = if lost { laser.device().reconnect() } else { laser.off() };
        }
    }

    /// Checks whether all devices work again.
    pub(crate) fn update_reset(&mut self) {
        if self.resetting.is_none() || self.is_opening() {
            return;
        }
        let open = self.remaining_faults();
        let missing = self.camera.is_none() || self.stage.is_none() || self.laser.is_none();
        let Some(mut resetting) = self.resetting.take() else { return };
        // Waits for rest: otherwise the next motion would be refused if a reset directly follows a Stop.
        let rests = self.stage_rests() || Instant::now() >= resetting.until;
        if open.is_empty() && !missing && rests {
            self.faults.clear();
            self.restore_devices();
            self.publisher.stop_latch.release();
            self.transition(Event::DevicesConnected);
            return resetting.replies.into_iter().for_each(|reply| self.answer(reply, Ok(None)));
        }
        if !open.is_empty() {
            resetting.open = open;
        }
        if !missing && Instant::now() < resetting.until {
            self.resetting = Some(resetting);
            return;
        }
        for fault in resetting.open {
            self.note(fault);
        }
        self.transition(if missing { Event::DeviceMissing } else { Event::Fault });
        for reply in resetting.replies {
            let refusal = self.in_error();
            self.answer(reply, Err(refusal));
        }
    }

    /// Ends a reset early; faults that remain stay.
    pub(crate) fn end_reset(&mut self, why: impl Fn() -> StationRefusal) {
        let Some(resetting) = self.resetting.take() else { return };
        resetting.open.into_iter().for_each(|fault| self.note(fault));
        resetting.replies.into_iter().for_each(|reply| self.answer(reply, Err(why())));
    }

    fn remaining_faults(&mut self) -> Vec<Fault> {
        let now = Instant::now();
        let camera =
            self.camera.as_mut().map_or(Ok(()), |camera| camera.probe_now(now).map_err(StationRefusal::from));
        let stage = self.stage.as_mut().map_or(Ok(()), |stage| stage.check().map_err(StationRefusal::from));
        let laser = self.laser.as_mut().map_or(Ok(()), |laser| laser.check_off().map_err(StationRefusal::from));
        [camera, stage, laser].iter().filter_map(|found| fault_of(found.as_ref().err()?)).collect()
    }

    /// Prepares reconnected devices: laser off, stage at rest, settings as before the fault.
    fn restore_devices(&mut self) {
        self.turn_laser_off();
        let before = self.camera_before_fault.take();
        if before.is_some() {
            self.restore_camera(before);
        } else if let Some(camera) = &mut self.camera {
            // It answered just now; a later failure is noticed when it is used.
            let _ = camera.stop();
        }
    }
}
