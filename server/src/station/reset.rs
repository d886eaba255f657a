//! Reset: faults are acknowledged, devices reached again. They come back ready, never active.

use std::time::Instant;

use devices::AcceptedMove;

use crate::station::command::Reply;
use crate::station::faults::fault_of;
use crate::station::machine::Event;
use crate::station::owner::Station;
use crate::station::params::RESET_LIMIT;
use crate::station::refusal::StationRefusal;
use crate::station::status::Fault;

/// A reset under way.
pub struct Resetting {
    until: Instant,
    pub(super) reply: Reply<Option<AcceptedMove>>,
    /// Faults not yet overcome, as last seen.
    open: Vec<Fault>,
}

impl Station {
    /// Acknowledges all faults and begins to reach what failed.
    pub(super) fn begin_reset(&mut self, reply: Reply<Option<AcceptedMove>>) {
        self.end_live();
        if self.resetting.is_some() || !self.happen(Event::Reset) {
            return self.answer(reply, Err(StationRefusal::Busy { activity: self.activity().to_owned() }));
        }
        let open = std::mem::take(&mut self.faults);
        for fault in &open {
            self.reach_again(fault);
        }
        self.begin_opening();
        self.resetting = Some(Resetting { until: Instant::now() + RESET_LIMIT, reply, open });
    }

    /// Starts what may overcome a fault. Whether it did is asked afterwards.
    fn reach_again(&mut self, fault: &Fault) {
        let lost = matches!(fault.kind, "gone" | "no_reply" | "garbage" | "wrong_device" | "silent" | "fault");
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

    /// Asks all devices whether they are well again.
    pub(super) fn tend_reset(&mut self) {
        if self.resetting.is_none() || self.opening.is_some() {
            return;
        }
        let open = self.faults_found();
        let missing = self.camera.is_none() || self.stage.is_none() || self.laser.is_none();
        let Some(mut resetting) = self.resetting.take() else { return };
        if open.is_empty() && !missing {
            self.faults.clear();
            self.come_back();
            self.happen(Event::Reached);
            return self.answer(resetting.reply, Ok(None));
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
        self.happen(if missing { Event::Missing } else { Event::Fault });
        let refusal = self.in_error();
        self.answer(resetting.reply, Err(refusal));
    }

    fn faults_found(&mut self) -> Vec<Fault> {
        let now = Instant::now();
        let camera = self
            .camera
            .as_mut()
            .map_or(Ok(()), |camera| camera.ask_whether_there(now).map_err(StationRefusal::from));
        let stage = self.stage.as_mut().map_or(Ok(()), |stage| stage.check().map_err(StationRefusal::from));
        let laser = self.laser.as_mut().map_or(Ok(()), |laser| laser.check_dark().map_err(StationRefusal::from));
        [camera, stage, laser].iter().filter_map(|found| fault_of(found.as_ref().err()?)).collect()
    }

    /// Devices that are reached again: dark, at rest, set as before the fault.
    fn come_back(&mut self) {
        self.go_dark();
        let before = self.camera_before_fault.take();
        if before.is_some() {
            self.restore_camera(before);
        } else if let Some(camera) = &mut self.camera {
            // It answered just now; what it says next is noticed when it is used.
            let _ = camera.stop();
        }
    }
}
