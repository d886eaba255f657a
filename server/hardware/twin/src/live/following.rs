//! A simulated world that follows the devices of other drivers: the images show the position reported by their
//! controller, and laser light while it reports the laser on.
//!
//! After a reading of a moving stage the position is extrapolated with the speed between the last two readings; the
//! error is the change of speed within one reading. That suffices to try a controller, but not to measure.

use parking_lot::Mutex;
use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::{
    AcceptedMove, DeviceIdentity, Laser, LaserCapabilities, LaserError, LaserState, Stage, StageCapabilities,
    StageError, StageState, StopHandle,
};

use crate::live::control::TwinControl;

/// Latest readings of the devices.
#[derive(Default)]
struct LastReadings {
    /// The last two readings of the stage, the newer one first.
    stage: Option<(StageState, Option<StageState>)>,
    power: f64,
}

/// Latest readings of the devices, shared with the world that follows them.
#[derive(Clone, Default)]
pub(super) struct Mirror(Arc<Mutex<LastReadings>>);

impl Mirror {
    /// Makes the world of `control` follow another driver's stage.
    pub(super) fn stage(&self, stage: Box<dyn Stage>, control: &TwinControl) -> Box<dyn Stage> {
        if let Some(pitch_mm) = stage.capabilities().frame_pitch_mm {
            control.run_belt(pitch_mm);
            return stage;
        }
        let mirror = self.clone();
        control.follow_stage(move |at| mirror.position_mm(at));
        Box::new(MirroredStage { stage, mirror: self.clone() })
    }

    /// Makes the world of `control` follow another driver's laser.
    pub(super) fn laser(&self, laser: Box<dyn Laser>, control: &TwinControl) -> Box<dyn Laser> {
        let mirror = self.clone();
        control.follow_laser(move |_| mirror.with_readings(|readings| readings.power));
        Box::new(MirroredLaser { laser, mirror: self.clone() })
    }

    fn with_readings<T>(&self, with_readings: impl FnOnce(&mut LastReadings) -> T) -> T {
        with_readings(&mut self.0.lock())
    }

    fn take_stage(&self, state: StageState) {
        self.with_readings(|readings| match &mut readings.stage {
            Some((newest, _)) if newest.measured_at >= state.measured_at => *newest = state,
            stage => *stage = Some((state, stage.map(|(newest, _)| newest))),
        });
    }

    fn take_laser(&self, state: LaserState) -> LaserState {
        self.with_readings(|readings| readings.power = if state.emitting { state.power } else { 0.0 });
        state
    }

    fn position_mm(&self, at: Instant) -> f64 {
        self.with_readings(|readings| {
            let Some((newest, before)) = &readings.stage else { return 0.0 };
            let position_mm = newest.position_mm.unwrap_or(0.0);
            let rest = !newest.moving || at <= newest.measured_at;
            let Some(before) = before.filter(|_| !rest) else { return position_mm };
            let Some(before_mm) = before.position_mm else { return position_mm };
            let gap = newest.measured_at - before.measured_at;
            if gap == Duration::ZERO {
                return position_mm;
            }
            let ahead = (at - newest.measured_at).min(gap);
            position_mm + (position_mm - before_mm) * ahead.as_secs_f64() / gap.as_secs_f64()
        })
    }
}

/// A stage followed by the world.
struct MirroredStage {
    stage: Box<dyn Stage>,
    mirror: Mirror,
}

impl Stage for MirroredStage {
    fn identity(&self) -> DeviceIdentity {
        self.stage.identity()
    }

    fn capabilities(&self) -> StageCapabilities {
        self.stage.capabilities()
    }

    fn start_home(&mut self) -> Result<(), StageError> {
        self.stage.start_home()
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.stage.start_move(target_mm, speed_mm_s)
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.stage.start_jog(distance_mm, speed_mm_s)
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        let state = self.stage.poll()?;
        self.mirror.take_stage(state);
        Ok(state)
    }

    fn hold(&mut self) -> Result<(), StageError> {
        self.stage.hold()
    }

    fn resume(&mut self) -> Result<(), StageError> {
        self.stage.resume()
    }

    fn stop(&mut self) -> Result<(), StageError> {
        self.stage.stop()
    }

    fn stop_handle(&self) -> Arc<dyn StopHandle> {
        self.stage.stop_handle()
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        self.stage.clear_fault()
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        self.stage.reconnect()
    }
}

/// A laser followed by the world.
struct MirroredLaser {
    laser: Box<dyn Laser>,
    mirror: Mirror,
}

impl MirroredLaser {
    fn mirrored(&self, state: Result<LaserState, LaserError>) -> Result<LaserState, LaserError> {
        if state.is_err() {
            // An unreachable laser is shown as off; the status reports it as unknown.
            self.mirror.with_readings(|readings| readings.power = 0.0);
        }
        state.map(|state| self.mirror.take_laser(state))
    }
}

impl Laser for MirroredLaser {
    fn identity(&self) -> DeviceIdentity {
        self.laser.identity()
    }

    fn capabilities(&self) -> LaserCapabilities {
        self.laser.capabilities()
    }

    fn lost_host(&self) -> &'static str {
        self.laser.lost_host()
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        let state = self.laser.switch_on(power, lease);
        self.mirrored(state)
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        let state = self.laser.renew(lease);
        self.mirrored(state)
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        self.mirror.with_readings(|readings| readings.power = 0.0);
        self.laser.switch_off()
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        self.laser.stop_handle()
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        let state = self.laser.poll();
        self.mirrored(state)
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.laser.reconnect()
    }
}
