//! The simulated stage: a carriage, a controller with its own position, and the driver.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::stage_checks::{check_numbers, check_travel};
use devices::{
    AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageState, StopHandle,
};

use crate::live::fault::TwinFault;
use crate::live::motion::Motion;
use crate::live::options::{Timing, TwinOptions};
use crate::live::params::{
    HOMING_PULL_OFF_MM, HOMING_SPEED_MM_S, INSTANT_SPEED_MM_S, REALISTIC_ACCELERATION_MM_S2, REALISTIC_SPEED_MM_S,
    RESOLUTION_MM, RING_AMPLITUDE_MM, RING_DECAY_S, RING_FREQUENCY_HZ, SILENCE_MS, STALL_GAP_MM,
};
use crate::live::world::{SharedWorld, World};

/// Carriage position from outside the twin.
pub(super) type PositionSource = Arc<dyn Fn(Instant) -> f64 + Send + Sync>;

/// A fault detected by the driver.
#[derive(Debug, Clone, Copy, PartialEq)]
enum DetectedFault {
    Stalled { target_mm: f64, actual_mm: f64 },
    Silent { since: Instant },
    Disconnected,
}

/// Activity of the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Activity {
    Idle,
    Moving { target_mm: f64, speed_mm_s: f64 },
    Homing,
    Held { target_mm: f64, speed_mm_s: f64 },
}

/// Carriage and controller.
pub(super) struct StageWorld {
    timing: Timing,
    homing: Homing,
    travel_mm: (f64, f64),
    motion: Motion,
    activity: Activity,
    homed: bool,
    detected_fault: Option<DetectedFault>,
    /// Distance by which the true position lags behind the controller's.
    pub lost_mm: f64,
    pub follows: Option<PositionSource>,
}

impl StageWorld {
    pub(super) fn new(options: &TwinOptions, now: Instant) -> Self {
        let required = options.homing_required || options.timing == Timing::Realistic;
        Self {
            timing: options.timing,
            homing: if required { Homing::Required } else { Homing::Absent },
            travel_mm: options.travel_mm,
            motion: Motion::rest(now, 0.0),
            activity: Activity::Idle,
            homed: !required,
            detected_fault: None,
            lost_mm: 0.0,
            follows: None,
        }
    }

    pub(super) fn true_position_mm(&self, stall_mm: Option<f64>, at: Instant) -> f64 {
        if let Some(source) = &self.follows {
            return source(at);
        }
        self.blocked_mm(stall_mm, at) - self.lost_mm + self.ringing_mm(at)
    }

    /// Position of the motion, limited by an obstacle.
    fn blocked_mm(&self, stall_mm: Option<f64>, at: Instant) -> f64 {
        let position_mm = self.motion.state_at(at).position_mm;
        match stall_mm {
            Some(stall_mm) if self.motion.begin_mm() < stall_mm && stall_mm <= position_mm => {
                stall_mm - STALL_GAP_MM
            }
            Some(stall_mm) if self.motion.begin_mm() > stall_mm && stall_mm >= position_mm => {
                stall_mm + STALL_GAP_MM
            }
            _ => position_mm,
        }
    }

    /// Ringing of frame and carriage after a stop.
    fn ringing_mm(&self, at: Instant) -> f64 {
        if self.timing == Timing::Instant || !self.motion.ramped() {
            return 0.0;
        }
        let Some(since) = at.checked_duration_since(self.motion.end()) else { return 0.0 };
        let since_s = since.as_secs_f64();
        RING_AMPLITUDE_MM * (-since_s / RING_DECAY_S).exp() * (TAU * RING_FREQUENCY_HZ * since_s).sin()
    }

    fn acceleration_mm_s2(&self) -> Option<f64> {
        (self.timing == Timing::Realistic).then_some(REALISTIC_ACCELERATION_MM_S2)
    }

    fn max_speed_mm_s(&self) -> f64 {
        if self.timing == Timing::Realistic { REALISTIC_SPEED_MM_S } else { INSTANT_SPEED_MM_S }
    }

    /// Advances to a time: ends motions and stops at obstacles.
    fn advance(&mut self, stall_mm: Option<f64>, now: Instant) {
        let position_mm = self.blocked_mm(stall_mm, now);
        let blocked = position_mm != self.motion.state_at(now).position_mm;
        match self.activity {
            Activity::Moving { .. } | Activity::Homing if blocked => {
                let target_mm = self.motion.to_mm();
                self.detected_fault.get_or_insert(DetectedFault::Stalled { target_mm, actual_mm: position_mm });
                self.rest(now, position_mm);
                self.homed = false;
            }
            Activity::Moving { .. } if !self.motion.moving(now) => self.activity = Activity::Idle,
            Activity::Homing if !self.motion.moving(now) => {
                self.activity = Activity::Idle;
                self.homed = true;
            }
            _ => {}
        }
    }

    fn rest(&mut self, now: Instant, position_mm: f64) {
        self.motion = Motion::rest(now, position_mm);
        self.activity = Activity::Idle;
    }

    fn brake(&mut self, now: Instant) {
        self.homed &= self.activity != Activity::Homing;
        self.motion = self.motion.braked(now, self.acceleration_mm_s2());
        self.activity = Activity::Idle;
    }

    fn error(&self, command: &str, now: Instant) -> Option<StageError> {
        match self.detected_fault? {
            DetectedFault::Stalled { target_mm, actual_mm } => Some(StageError::Stalled { target_mm, actual_mm }),
            DetectedFault::Disconnected => {
                Some(StageError::Disconnected { reason: "its cable was unplugged".to_owned() })
            }
            DetectedFault::Silent { since } => (now.saturating_duration_since(since)
                >= Duration::from_millis(SILENCE_MS))
            .then(|| StageError::NoResponse { command: command.to_owned(), waited_ms: SILENCE_MS }),
        }
    }

    fn start(&mut self, target_mm: f64, speed_mm_s: f64, now: Instant) {
        let from_mm = self.motion.state_at(now).position_mm;
        self.motion = Motion::travel(now, (from_mm, target_mm), speed_mm_s, self.acceleration_mm_s2());
        self.activity = Activity::Moving { target_mm, speed_mm_s };
    }

    fn start_home(&mut self, now: Instant) {
        let at_mm = self.motion.state_at(now).position_mm - self.lost_mm;
        (self.lost_mm, self.homed) = (0.0, false);
        if self.homing == Homing::Absent {
            self.rest(now, at_mm);
            self.homed = true;
            return;
        }
        let speed = if self.timing == Timing::Realistic { HOMING_SPEED_MM_S } else { INSTANT_SPEED_MM_S };
        let (switch_mm, ramp) = (self.travel_mm.0, self.acceleration_mm_s2());
        self.motion =
            Motion::travel(now, (at_mm, switch_mm), speed, ramp).then(switch_mm + HOMING_PULL_OFF_MM, speed, ramp);
        self.activity = Activity::Homing;
    }

    fn state(&self, now: Instant) -> StageState {
        let reported_at = match self.detected_fault {
            Some(DetectedFault::Silent { since }) => since,
            _ => now,
        };
        StageState {
            position_mm: self.homed.then(|| self.motion.state_at(reported_at).position_mm),
            measured_at: reported_at,
            moving: self.motion.moving(reported_at),
            held: matches!(self.activity, Activity::Held { .. }),
            homed: self.homed,
        }
    }
}

impl World {
    /// Starts a fault of the stage.
    pub(super) fn start_stage_fault(&mut self, fault: TwinFault, now: Instant) {
        self.stage.advance(self.stall_mm(), now);
        match fault {
            TwinFault::StageUnplugged => {
                self.stage.brake(now);
                self.stage.homed = false;
                self.stage.detected_fault = Some(DetectedFault::Disconnected);
            }
            TwinFault::StageSilent => self.stage.detected_fault = Some(DetectedFault::Silent { since: now }),
            TwinFault::LostSteps { lost_mm } => self.stage.lost_mm = lost_mm,
            _ => {}
        }
    }

    /// Ends a fault of the stage; an error detected by the driver stays until it is acknowledged.
    pub(super) fn end_stage_fault(&mut self, fault: TwinFault) {
        if matches!(fault, TwinFault::LostSteps { .. }) {
            self.stage.lost_mm = 0.0;
        }
    }
}

/// The stage of a [`crate::live::TwinStation`].
///
/// Commanded positions are reached exactly. A stage that needs no homing has an absolute scale with the station's zero;
/// homing only reports its position.
pub struct TwinStage {
    world: SharedWorld,
}

impl TwinStage {
    pub(super) fn open(world: SharedWorld, options: &TwinOptions) -> Self {
        let now = Instant::now();
        {
            let mut guard = world.lock();
            let position_mm = guard.stage.motion.state_at(now).position_mm;
            let (lost_mm, follows) = (guard.stage.lost_mm, guard.stage.follows.take());
            guard.stage = StageWorld { lost_mm, follows, ..StageWorld::new(options, now) };
            guard.stage.rest(now, position_mm);
            for fault in [TwinFault::StageUnplugged, TwinFault::StageSilent] {
                if guard.has(fault) {
                    guard.start_stage_fault(fault, now);
                }
            }
        }
        Self { world }
    }

    /// Runs `command` on the state of the stage, unless a fault prevents it.
    fn with_stage<T>(
        &self,
        command: &str,
        act: impl FnOnce(&mut StageWorld, Instant) -> Result<T, StageError>,
    ) -> Result<T, StageError> {
        let mut world = self.world.lock();
        let now = Instant::now();
        let stall_mm = world.stall_mm();
        world.stage.advance(stall_mm, now);
        match world.stage.error(command, now) {
            Some(error) => Err(error),
            None => act(&mut world.stage, now),
        }
    }

    fn begin(
        stage: &mut StageWorld,
        target_mm: f64,
        speed_mm_s: f64,
        now: Instant,
    ) -> Result<AcceptedMove, StageError> {
        if stage.motion.moving(now) || stage.activity != Activity::Idle {
            return Err(StageError::Moving);
        }
        let accepted = AcceptedMove { target_mm, speed_mm_s: speed_mm_s.min(stage.max_speed_mm_s()) };
        stage.start(accepted.target_mm, accepted.speed_mm_s, now);
        Ok(accepted)
    }
}

impl Stage for TwinStage {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            driver: "twin",
            vendor: "Sheaf".to_owned(),
            model: "simulated stage".to_owned(),
            serial: self.world.lock().model.seed.to_string(),
            firmware: String::new(),
        }
    }

    fn capabilities(&self) -> StageCapabilities {
        let world = self.world.lock();
        let stage = &world.stage;
        StageCapabilities {
            kind: match world.model.stage.kind() {
                optics::StageKind::Linear => devices::StageKind::Linear,
                optics::StageKind::Rotary => devices::StageKind::Rotary,
            },
            travel_mm: stage.travel_mm,
            max_speed_mm_s: stage.max_speed_mm_s(),
            acceleration_mm_s2: stage.acceleration_mm_s2(),
            homing: stage.homing,
            resolution_mm: RESOLUTION_MM,
            follows_frames: false,
            frame_pitch_mm: None,
        }
    }

    fn start_home(&mut self) -> Result<(), StageError> {
        let mut homed_now = false;
        let outcome = self.with_stage("home", |stage, now| {
            if stage.motion.moving(now) || stage.activity != Activity::Idle {
                return Err(StageError::Moving);
            }
            stage.start_home(now);
            homed_now = true;
            Ok(())
        });
        if homed_now {
            // Homing corrects lost steps.
            self.world.lock().faults.retain(|fault| !matches!(fault, TwinFault::LostSteps { .. }));
        }
        outcome
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.with_stage("move", |stage, now| {
            check_numbers("target_mm", target_mm, speed_mm_s)?;
            if !stage.homed {
                return Err(StageError::NotHomed);
            }
            check_travel(target_mm, stage.travel_mm)?;
            Self::begin(stage, target_mm, speed_mm_s, now)
        })
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.with_stage("jog", |stage, now| {
            check_numbers("distance_mm", distance_mm, speed_mm_s)?;
            if !stage.homed && stage.homing == Homing::Required {
                return Err(StageError::NotHomed);
            }
            let (min_mm, max_mm) = stage.travel_mm;
            let target_mm = (stage.motion.state_at(now).position_mm + distance_mm).clamp(min_mm, max_mm);
            Self::begin(stage, target_mm, speed_mm_s, now)
        })
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        self.with_stage("?", |stage, now| Ok(stage.state(now)))
    }

    fn hold(&mut self) -> Result<(), StageError> {
        self.with_stage("hold", |stage, now| {
            if let Activity::Moving { target_mm, speed_mm_s } = stage.activity {
                stage.brake(now);
                stage.activity = Activity::Held { target_mm, speed_mm_s };
            }
            Ok(())
        })
    }

    fn resume(&mut self) -> Result<(), StageError> {
        self.with_stage("resume", |stage, now| {
            if let Activity::Held { target_mm, speed_mm_s } = stage.activity {
                // The remaining braking is cut short.
                stage.start(target_mm, speed_mm_s, now);
            }
            Ok(())
        })
    }

    fn stop(&mut self) -> Result<(), StageError> {
        stop(&self.world)
    }

    fn stop_handle(&self) -> Arc<dyn StopHandle> {
        Arc::new(StageStop(self.world.clone()))
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        let mut world = self.world.lock();
        match world.stage.detected_fault {
            Some(DetectedFault::Stalled { .. }) => {
                world.stage.detected_fault = None;
                Ok(())
            }
            _ => world.stage.error("clear fault", Instant::now()).map_or(Ok(()), Err),
        }
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        let mut world = self.world.lock();
        if world.has(TwinFault::StageUnplugged) || world.has(TwinFault::StageSilent) {
            return Ok(());
        }
        world.stage.brake(Instant::now());
        world.stage.homed = false;
        world.stage.detected_fault = None;
        Ok(())
    }
}

/// Stops the stage, independently of its owner.
struct StageStop(SharedWorld);

impl StopHandle for StageStop {
    fn stop_now(&self) {
        // The driver's own calls report a stage that cannot be reached.
        stop(&self.0).ok();
    }
}

fn stop(world: &SharedWorld) -> Result<(), StageError> {
    let mut world = world.lock();
    let now = Instant::now();
    let stall_mm = world.stall_mm();
    world.stage.advance(stall_mm, now);
    match world.stage.detected_fault {
        Some(DetectedFault::Silent { .. } | DetectedFault::Disconnected) => {
            world.stage.error("stop", now).map_or(Ok(()), Err)
        }
        _ => {
            world.stage.brake(now);
            Ok(())
        }
    }
}
