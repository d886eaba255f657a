//! A slow stage and one without new reports are distinguished from a stalled one.

use std::time::{Duration, Instant};

use devices::{AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageState};

use super::Motion;
use crate::params::{NO_PROGRESS_LIMIT, REST_LIMIT};

/// Reports a fixed state.
struct Fake {
    acceleration_mm_s2: Option<f64>,
    /// Returned by every reading.
    state: fn() -> StageState,
}

fn at_rest() -> StageState {
    StageState { position_mm: Some(0.0), measured_at: Instant::now(), moving: false, held: false, homed: true }
}

fn moving() -> StageState {
    StageState { moving: true, ..at_rest() }
}

impl Stage for Fake {
    fn identity(&self) -> DeviceIdentity {
        unreachable!("never called")
    }

    fn capabilities(&self) -> StageCapabilities {
        StageCapabilities {
            kind: devices::StageKind::Linear,
            travel_mm: (-50.0, 50.0),
            max_speed_mm_s: 40.0,
            acceleration_mm_s2: self.acceleration_mm_s2,
            homing: Homing::Required,
            resolution_mm: 0.01,
            follows_frames: false,
            frame_pitch_mm: None,
        }
    }

    fn start_home(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        Ok(AcceptedMove { target_mm, speed_mm_s })
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.start_move(distance_mm, speed_mm_s)
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        Ok((self.state)())
    }

    fn hold(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn resume(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn stop(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn stop_handle(&self) -> std::sync::Arc<dyn devices::StopHandle> {
        unreachable!("nothing blocks")
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        Ok(())
    }
}

#[test]
fn a_stage_without_new_reports_is_not_stalled_before_its_move_is_late() {
    let mut motion = Motion::new(Box::new(Fake { acceleration_mm_s2: None, state: at_rest }));
    motion.check().unwrap();
    motion.start_move(40.0, 10.0).unwrap();
    let begun_at = Instant::now();
    // One reading of the moving stage, at its start.
    let reading = moving();
    assert!(motion.monitor(&reading, begun_at).unwrap().is_none());
    let silent_for = NO_PROGRESS_LIMIT + Duration::from_millis(50);
    assert!(motion.monitor(&reading, begun_at + silent_for).unwrap().is_none(), "silence was reported as a stall");
    let at_rest = StageState { measured_at: begun_at + silent_for, ..reading };
    let result = motion.monitor(&at_rest, begun_at + silent_for);
    assert!(matches!(result, Err(StageError::Stalled { .. })), "{result:?}");
}

#[test]
fn a_stage_is_not_homed_while_its_homing_has_not_ended() {
    let homed_and_moving = || StageState { position_mm: None, ..moving() };
    let mut motion = Motion::new(Box::new(Fake { acceleration_mm_s2: None, state: homed_and_moving }));
    motion.start_home().unwrap();
    assert_eq!(motion.update(Instant::now()), Ok(None));
    assert!(!motion.homed(), "the driver reports homed, but the position is not known yet");
    motion.device = Box::new(Fake { acceleration_mm_s2: None, state: at_rest });
    let later = Instant::now() + Duration::from_secs(1);
    assert_eq!(motion.update(later), Ok(Some(super::CompletedMotion::Homed)));
    assert!(motion.homed());
    assert_eq!(motion.position_mm(), Some(0.0));
}

#[test]
fn a_stop_may_take_as_long_as_a_slow_stage_brakes() {
    let stopping = |acceleration_mm_s2| {
        let mut motion = Motion::new(Box::new(Fake { acceleration_mm_s2, state: moving }));
        motion.check().unwrap();
        motion.stop().unwrap();
        motion.update(Instant::now() + REST_LIMIT + Duration::from_secs(4))
    };
    // 40 mm/s at 10 mm/s².
    assert!(stopping(Some(10.0)).unwrap().is_none(), "it is still braking");
    assert!(matches!(stopping(None), Err(StageError::NoResponse { .. })));
}

#[test]
fn the_time_of_a_move_counts_its_ramps() {
    let travel_s = |acceleration_mm_s2, target_mm| {
        let mut motion = Motion::new(Box::new(Fake { acceleration_mm_s2, state: at_rest }));
        motion.check().unwrap();
        motion.travel_s(target_mm, 40.0)
    };
    // Without ramps; too short for full speed at 10 mm/s²; and long enough.
    assert!((travel_s(None, -16.0) - 0.4).abs() < 1e-9);
    assert!((travel_s(Some(10.0), 0.4) - 0.4).abs() < 1e-9);
    assert!((travel_s(Some(10.0), -200.0) - 9.0).abs() < 1e-9);
}
