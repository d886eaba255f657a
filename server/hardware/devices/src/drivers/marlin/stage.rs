//! The stage: one axis of a controller.

use std::sync::Arc;

use super::session::Session;
use crate::lines::serial_controller::{Controller, Dialogue};
use crate::{AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageKind, StageState};

/// One axis of a Marlin controller. Dropping it stops what moves.
pub struct MarlinStage {
    controller: Arc<Controller<Session>>,
}

impl MarlinStage {
    pub(super) fn new(controller: &Arc<Controller<Session>>) -> Self {
        Self { controller: Arc::clone(controller) }
    }
}

impl Stage for MarlinStage {
    fn identity(&self) -> DeviceIdentity {
        self.controller.act(|session, _| super::laser::identity_of(session))
    }

    fn capabilities(&self) -> StageCapabilities {
        // A controller is handed out only after it was up once.
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
        self.controller.ask(|session, now| session.start_home(now).map(|ticket| ((), ticket)), Clone::clone)
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.controller.act(|session, now| session.start_move(target_mm, speed_mm_s, now))
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.controller.act(|session, now| session.start_jog(distance_mm, speed_mm_s, now))
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        self.controller.act(|session, now| session.sound().map(|()| session.stage_state(now)))
    }

    /// Sends no more; [`Stage::resume`] sends the rest.
    fn hold(&mut self) -> Result<(), StageError> {
        self.controller.act(|session, now| session.hold(now))
    }

    fn resume(&mut self) -> Result<(), StageError> {
        self.controller.act(|session, now| session.resume(now))
    }

    /// Sends no more, so that it brakes at the end of what was sent, and asks when it rests; the position is kept. What
    /// has not run out in time is dropped (`M410`), at the price of the position. Homing is halted for good (`M112`).
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

impl Drop for MarlinStage {
    fn drop(&mut self) {
        if self.controller.act(|session, now| session.stage_state(now).moving) {
            self.controller.stop();
        }
    }
}
