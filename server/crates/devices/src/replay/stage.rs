//! The stage of a replay.

use std::sync::{Arc, Mutex};

use super::playback::{Playback, lock};
use crate::params::REPLAY_MAX_SPEED_MM_S;
use crate::stage_checks::{check_numbers, check_travel};
use crate::{AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageState};

/// Is where the frame last delivered was taken.
pub struct ReplayStage {
    name: String,
    travel_mm: (f64, f64),
    playback: Arc<Mutex<Playback>>,
}

impl ReplayStage {
    pub(super) fn new(name: String, travel_mm: (f64, f64), playback: Arc<Mutex<Playback>>) -> Self {
        Self { name, travel_mm, playback }
    }

    fn start(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        let mut playback = lock(&self.playback);
        if playback.under_way() {
            return Err(StageError::Moving);
        }
        playback.start_move(target_mm);
        Ok(AcceptedMove { target_mm, speed_mm_s: speed_mm_s.min(REPLAY_MAX_SPEED_MM_S) })
    }
}

impl Stage for ReplayStage {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            driver: "replay",
            vendor: String::new(),
            model: self.name.clone(),
            serial: String::new(),
            firmware: String::new(),
        }
    }

    fn capabilities(&self) -> StageCapabilities {
        StageCapabilities {
            travel_mm: self.travel_mm,
            max_speed_mm_s: REPLAY_MAX_SPEED_MM_S,
            acceleration_mm_s2: None,
            homing: Homing::Absent,
            resolution_mm: 0.0,
        }
    }

    /// Does nothing: the recording knows its zero.
    fn start_home(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        check_numbers("target_mm", target_mm, speed_mm_s)?;
        check_travel(target_mm, self.travel_mm)?;
        self.start(target_mm, speed_mm_s)
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        check_numbers("distance_mm", distance_mm, speed_mm_s)?;
        let from_mm = lock(&self.playback).whereabouts().position_mm.unwrap_or(self.travel_mm.0);
        self.start((from_mm + distance_mm).clamp(self.travel_mm.0, self.travel_mm.1), speed_mm_s)
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        let now = lock(&self.playback).whereabouts();
        Ok(StageState {
            position_mm: now.position_mm,
            measured_at: now.measured_at,
            moving: now.moving,
            held: now.held,
            homed: true,
        })
    }

    fn hold(&mut self) -> Result<(), StageError> {
        lock(&self.playback).hold();
        Ok(())
    }

    fn resume(&mut self) -> Result<(), StageError> {
        lock(&self.playback).resume();
        Ok(())
    }

    fn stop(&mut self) -> Result<(), StageError> {
        lock(&self.playback).stop();
        Ok(())
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        self.stop()
    }
}
