//! The stage: one axis of a device.

use std::sync::Arc;

use super::session::Session;
use crate::lines::serial_controller::{Controller, Dialogue};
use crate::{AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageKind, StageState};

/// One axis of a Zaber device. Dropping it stops what moves.
pub struct ZaberStage {
    controller: Arc<Controller<Session>>,
}

impl ZaberStage {
    pub(super) fn new(controller: Arc<Controller<Session>>) -> Self {
        Self { controller }
    }
}

impl Stage for ZaberStage {
    fn identity(&self) -> DeviceIdentity {
        let unknown = || DeviceIdentity {
            driver: "zaber",
            vendor: "Zaber".to_owned(),
            model: String::new(),
            serial: String::new(),
            firmware: String::new(),
        };
        self.controller
            .act(|session, _| session.machine().map_or_else(unknown, |machine| machine.identity.clone()))
    }

    fn capabilities(&self) -> StageCapabilities {
        // A device is handed out only after it was up once.
        let unknown = StageCapabilities {
            kind: StageKind::Linear,
            travel_mm: (0.0, 0.0),
            max_speed_mm_s: 0.0,
            acceleration_mm_s2: None,
            homing: Homing::Required,
            resolution_mm: 0.0,
            follows_frames: false,
        };
        self.controller.act(|session, _| session.machine().map_or(unknown, |machine| machine.capabilities.clone()))
    }

    fn start_home(&mut self) -> Result<(), StageError> {
        self.controller.ask(|session, now| session.start_home(now).map(|ticket| ((), Some(ticket))), Clone::clone)
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        let start = |session: &mut Session, now| {
            session.start_move(target_mm, speed_mm_s, now).map(|(accepted, ticket)| (accepted, Some(ticket)))
        };
        self.controller.ask(start, Clone::clone)
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        let start = |session: &mut Session, now| {
            session.start_jog(distance_mm, speed_mm_s, now).map(|(accepted, ticket)| (accepted, Some(ticket)))
        };
        self.controller.ask(start, Clone::clone)
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        self.controller.act(|session, now| session.sound().map(|()| session.stage_state(now)))
    }

    /// Stops; [`Stage::resume`] sends the same move again.
    fn hold(&mut self) -> Result<(), StageError> {
        self.controller.act(|session, now| session.hold(now))
    }

    fn resume(&mut self) -> Result<(), StageError> {
        self.controller.act(|session, now| session.resume(now))
    }

    /// `stop`: it brakes by its own ramp, and nothing is queued in the device that could go on. The position is kept.
    fn stop(&mut self) -> Result<(), StageError> {
        self.controller.stop();
        Ok(())
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        self.controller.act(|session, now| session.clear_fault(now))
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        self.controller.act(|session, now| session.reconnect(now));
        Ok(())
    }
}

impl Drop for ZaberStage {
    fn drop(&mut self) {
        if self.controller.act(|session, now| session.stage_state(now).moving) {
            self.controller.stop();
        }
    }
}
