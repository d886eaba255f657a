//! A stage that is one axis of a controller.

use std::sync::Arc;
use std::time::Instant;

use crate::lines::serial_controller::{Controller, Dialogue};
use crate::traits::stop_handle::StopHandle;
use crate::{AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageKind, StageState};

/// The stage's interface to the state of a protocol. Methods that start a motion return the ticket of the line that
/// does so, if the caller must wait for its acknowledgement.
pub trait StageDialogue: Dialogue {
    /// Identity stated by the controller.
    fn identity(&self) -> DeviceIdentity;
    /// Capabilities of the axis, once the controller has been ready.
    fn stage_capabilities(&self) -> Option<StageCapabilities>;
    /// See [`Stage::start_home`].
    ///
    /// # Errors
    /// As there.
    fn start_home(&mut self, now: Instant) -> Result<Option<u64>, StageError>;
    /// See [`Stage::start_move`].
    ///
    /// # Errors
    /// As there.
    fn start_move(
        &mut self,
        target_mm: f64,
        speed_mm_s: f64,
        now: Instant,
    ) -> Result<(AcceptedMove, Option<u64>), StageError>;
    /// See [`Stage::start_jog`].
    ///
    /// # Errors
    /// As there.
    fn start_jog(
        &mut self,
        distance_mm: f64,
        speed_mm_s: f64,
        now: Instant,
    ) -> Result<(AcceptedMove, Option<u64>), StageError>;
    /// The stage as last reported.
    fn stage_state(&self, now: Instant) -> StageState;
    /// See [`Stage::hold`].
    ///
    /// # Errors
    /// A fault of the stage.
    fn hold(&mut self, now: Instant) -> Result<(), StageError>;
    /// See [`Stage::resume`].
    ///
    /// # Errors
    /// A fault of the stage.
    fn resume(&mut self, now: Instant) -> Result<(), StageError>;
    /// Clears a fault that can be cleared.
    ///
    /// # Errors
    /// A fault that requires the line to be reopened.
    fn clear_fault(&mut self, now: Instant) -> Result<(), StageError>;
    /// Reopens the line, unless that is in progress; if the controller works, it is stopped instead, and its laser
    /// turned off.
    fn reconnect(&mut self, now: Instant);
    /// Converts a refusal to the stage's error.
    fn stage_error(refusal: &Self::Fault) -> StageError;
}

/// One axis of a controller. Dropping it stops its motion.
pub struct ControllerStage<D: StageDialogue>(Arc<Controller<D>>);

impl<D: StageDialogue> ControllerStage<D> {
    pub(in crate::drivers) fn new(controller: &Arc<Controller<D>>) -> Self {
        Self(Arc::clone(controller))
    }
}

impl<D: StageDialogue> Stage for ControllerStage<D> {
    fn identity(&self) -> DeviceIdentity {
        self.0.act(|session, _| session.identity())
    }

    fn capabilities(&self) -> StageCapabilities {
        // A controller is returned only after it has been ready once.
        self.0.act(|session, _| session.stage_capabilities()).unwrap_or(StageCapabilities {
            kind: StageKind::Linear,
            travel_mm: (0.0, 0.0),
            max_speed_mm_s: 0.0,
            acceleration_mm_s2: None,
            homing: Homing::Required,
            resolution_mm: 0.0,
            follows_frames: false,
            frame_pitch_mm: None,
        })
    }

    fn start_home(&mut self) -> Result<(), StageError> {
        self.0.request(|session, now| session.start_home(now).map(|ticket| ((), ticket)), D::stage_error)
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.0.request(|session, now| session.start_move(target_mm, speed_mm_s, now), D::stage_error)
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.0.request(|session, now| session.start_jog(distance_mm, speed_mm_s, now), D::stage_error)
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        self.0.act(|session, now| session.check_fault().map(|()| session.stage_state(now)))
    }

    fn hold(&mut self) -> Result<(), StageError> {
        self.0.act(|session, now| session.hold(now))
    }

    fn resume(&mut self) -> Result<(), StageError> {
        self.0.act(|session, now| session.resume(now))
    }

    /// The protocol's stop, which bypasses every lock; its effect is documented per protocol.
    fn stop(&mut self) -> Result<(), StageError> {
        self.0.stop();
        Ok(())
    }

    fn stop_handle(&self) -> Arc<dyn StopHandle> {
        self.0.clone()
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        self.0.act(|session, now| session.clear_fault(now))
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        self.0.act(|session, now| session.reconnect(now));
        Ok(())
    }
}

impl<D: StageDialogue> Drop for ControllerStage<D> {
    fn drop(&mut self) {
        if self.0.act(|session, now| session.stage_state(now).moving) {
            self.0.stop();
        }
    }
}
