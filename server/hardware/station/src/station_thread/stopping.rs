//! Stop and faults: motion and light end, pending calls are refused with the reason, nothing restarts automatically.

use crate::params::FAULTS_SHOWN;
use crate::parts::faults::fault_of;
use crate::parts::machine::Event;
use crate::shared::refusal::StationRefusal;
use crate::shared::status::Fault;
use crate::station_thread::run::Run;
use crate::station_thread::station::{Revoked, Station};

impl Station {
    /// Carries out all pending Stops.
    pub(crate) fn stop_everything(&mut self) {
        let actor = self.publisher.stop_latch.begin_stop();
        self.stopped_by.clone_from(&actor);
        let result = self.stop_all_devices();
        let requests = self.publisher.stop_latch.finish_stop();
        self.end_reset(|| StationRefusal::Stopped { actor: actor.clone() });
        self.end_work(|_| StationRefusal::Stopped { actor: actor.clone() });
        self.live = None;
        self.revoke_lease(Some(Revoked::Stopped { actor }));
        self.transition(Event::Stop);
        if let Err(error) = &result
            && let Some(fault) = fault_of(error)
        {
            self.raise(fault);
        }
        let mut failed = result.err();
        for request in requests {
            let answer = failed.take().map_or(Ok(()), Err);
            self.answers.push(Box::new(move || request.answer(answer)));
        }
        self.publish_and_reply();
    }

    /// Stops all devices, the stage first; the error names a device that did not accept the command.
    pub(crate) fn stop_all_devices(&mut self) -> Result<(), StationRefusal> {
        let is_faulted = self.is_faulted("stage");
        let stage = match &mut self.stage {
            Some(stage) if is_faulted => stage.device().stop(),
            Some(stage) => stage.stop(),
            None => Ok(()),
        };
        let laser = self.laser.as_mut().map_or(Ok(()), |laser| laser.off());
        let camera = self.camera.as_mut().map_or(Ok(()), |camera| camera.stop());
        self.discard_waiting_frames();
        laser?;
        stage?;
        // A camera neither moves nor emits light; its state is read when it is next used.
        drop(camera);
        Ok(())
    }

    /// Handles a failed device or an impossible request: pending calls get the device's own message.
    pub(crate) fn fail(&mut self, refusal: StationRefusal) {
        if self.publisher.stop_latch.is_pending() {
            // The devices may have been stopped by the guard and report that; any other fault is reported again.
            return;
        }
        let fault = fault_of(&refusal);
        let mut first_refusal = Some(refusal);
        self.end_work(|station| first_refusal.take().unwrap_or_else(|| station.in_error()));
        if let Some(fault) = fault {
            self.raise(fault);
        }
    }

    /// Publishes a fault and makes the station safe.
    pub(crate) fn raise(&mut self, fault: Fault) {
        let (device, known) = (fault.device, self.is_faulted(fault.device));
        self.note(fault);
        if known {
            return;
        }
        self.turn_laser_off();
        self.come_to_rest();
        if matches!(device, "stage" | "station")
            && let Some(stage) = &mut self.stage
        {
            // It may still move: every possible stop is sent; its own watchdog is the last resort.
            let _ = stage.device().stop();
            stage.invalidate_position();
        }
        self.end_work(|station| station.in_error());
        self.live = None;
        self.revoke_lease(Some(Revoked::Fault));
        if !self.is_opening() {
            self.transition(Event::Fault);
        }
    }

    /// Turns the laser off; a laser that does not accept the command is an additional fault.
    pub(crate) fn turn_laser_off(&mut self) {
        if let Some(laser) = &mut self.laser
            && let Err(error) = laser.off()
            && let Some(fault) = fault_of(&error.into())
        {
            self.note(fault);
        }
    }

    /// Stops the stage if it moves.
    pub(crate) fn come_to_rest(&mut self) {
        let is_faulted = self.is_faulted("stage");
        if let Some(stage) = &mut self.stage
            && !is_faulted
            && stage.is_moving()
            && let Err(error) = stage.stop()
            && let Some(fault) = fault_of(&error.into())
        {
            self.note(fault);
            self.invalidate_stage_position();
        }
    }

    fn invalidate_stage_position(&mut self) {
        if let Some(stage) = &mut self.stage {
            stage.invalidate_position();
        }
    }

    /// Ends task and run; `why` is called once for each caller that waits.
    pub(crate) fn end_work(&mut self, mut why: impl FnMut(&Self) -> StationRefusal) {
        if let Some(task) = self.task.take() {
            let refusal = why(self);
            self.give_up_task(task, refusal);
        }
        if let Some(run) = self.run.take() {
            let refusal = why(self);
            self.abort(run, refusal);
        }
    }

    fn abort(&mut self, run: Run, refusal: StationRefusal) {
        if let Some((reply, refusal)) = run.abort(refusal) {
            self.answer(reply, Err(refusal));
        }
    }

    /// Adds a fault to those shown, unless it is shown already.
    pub(crate) fn note(&mut self, fault: Fault) {
        let known = |shown: &Fault| (shown.device, shown.kind) == (fault.device, fault.kind);
        if self.faults.len() < FAULTS_SHOWN && !self.faults.iter().any(known) {
            tracing::warn!(device = fault.device, kind = fault.kind, detail = %fault.detail, "station fault");
            self.faults.push(fault);
        }
    }

    /// Whether a device is not used: until a person has acknowledged its fault, and while a reset reconnects it.
    pub(crate) fn is_faulted(&self, device: &str) -> bool {
        // An open interlock is still monitored: it is not a defect.
        self.resetting.is_some()
            || self.faults.iter().any(|fault| {
                fault.kind != "interlock_open" && (fault.device == device || fault.device == "station")
            })
    }

    /// Whether a device does not respond.
    pub(crate) fn is_unreachable(&self, device: &str) -> bool {
        let silent = ["disconnected", "no_response", "wrong_device", "silent"];
        self.faults.iter().any(|fault| fault.device == device && silent.contains(&fault.kind))
    }
}
