//! The stage: one axis of a controller.

use std::sync::Arc;

use super::fault::Fault;
use super::session::Session;
use crate::lines::serial_controller::Controller;
use crate::{AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageState};

/// One axis of a GRBL controller. Dropping it stops what moves.
pub struct GrblStage {
    controller: Arc<Controller<Session>>,
}

impl GrblStage {
    pub(super) fn new(controller: &Arc<Controller<Session>>) -> Self {
        Self { controller: Arc::clone(controller) }
    }
}

impl Stage for GrblStage {
    fn identity(&self) -> DeviceIdentity {
        self.controller.act(|session, _| super::laser::identity_of(session))
    }

    fn capabilities(&self) -> StageCapabilities {
        let unknown = StageCapabilities {
            kind: crate::StageKind::Linear,
            travel_mm: (0.0, 0.0),
            max_speed_mm_s: 0.0,
            acceleration_mm_s2: None,
            homing: Homing::Required,
            resolution_mm: 0.0,
            follows_frames: false,
        };
        // A controller is handed out only after it was up once.
        self.controller.act(|session, _| session.machine().map_or(unknown, |machine| machine.capabilities.clone()))
    }

    /// `$H`; without homing switches the zero is here.
    fn start_home(&mut self) -> Result<(), StageError> {
        self.controller.ask(|session, now| session.start_home(now).map(|ticket| ((), ticket)), Fault::for_stage)
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        let start = |session: &mut Session, now| {
            session.start_move(target_mm, speed_mm_s, now).map(|(accepted, ticket)| (accepted, Some(ticket)))
        };
        self.controller.ask(start, Fault::for_stage)
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        let start = |session: &mut Session, now| {
            session.start_jog(distance_mm, speed_mm_s, now).map(|(accepted, ticket)| (accepted, Some(ticket)))
        };
        self.controller.ask(start, Fault::for_stage)
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        self.controller.act(|session, now| session.sound().map(|()| session.stage_state(now)))
    }

    /// Holds a move; ends a jog, as the firmware does.
    fn hold(&mut self) -> Result<(), StageError> {
        self.controller.act(|session, now| session.hold(now))
    }

    fn resume(&mut self) -> Result<(), StageError> {
        self.controller.act(|session, _| session.resume())
    }

    /// Feed hold and jog cancel at once, and a soft reset as soon as it rests, which is left out where there was
    /// nothing but a jog: the position is kept and the laser dark. Homing is reset at once.
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

impl Drop for GrblStage {
    fn drop(&mut self) {
        if self.controller.act(|session, now| session.stage_state(now).moving) {
            self.controller.stop();
        }
    }
}
