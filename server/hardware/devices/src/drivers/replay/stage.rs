//! The stage of a replay.

use parking_lot::Mutex;
use std::sync::Arc;

use super::playback::{Playback, lock};
use super::sequence::Recording;
use crate::drivers::stage_checks::{check_numbers, check_travel};
use crate::params::{REPLAY_MAX_SPEED_MM_S, REPLAY_RESOLUTION_DIGITS_PER_MM};
use crate::{
    AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageKind, StageState, StopHandle,
};

/// A stage that is at the position of the last delivered frame, and moves to recorded positions only.
pub struct ReplayStage {
    name: String,
    kind: StageKind,
    /// Recorded positions, in ascending order.
    positions_mm: Vec<f64>,
    playback: Arc<Mutex<Playback>>,
}

impl ReplayStage {
    pub(super) fn new(recording: &Recording, playback: Arc<Mutex<Playback>>) -> Self {
        let mut positions_mm = recording.positions_mm();
        positions_mm.sort_by(f64::total_cmp);
        positions_mm.dedup();
        Self { name: recording.name(), kind: recording.stage(), positions_mm, playback }
    }

    /// Lowest and highest position; both 0 if none is recorded.
    fn travel_mm(&self) -> (f64, f64) {
        match self.positions_mm.as_slice() {
            [low, .., high] => (*low, *high),
            [only] => (*only, *only),
            [] => (0.0, 0.0),
        }
    }

    /// Mean distance of the recorded positions: smaller steps show the same frame twice.
    fn resolution_mm(&self) -> f64 {
        let (low_mm, high_mm) = self.travel_mm();
        let n_steps = self.positions_mm.len().saturating_sub(1).max(1);
        ((high_mm - low_mm) / n_steps as f64 * REPLAY_RESOLUTION_DIGITS_PER_MM).round()
            / REPLAY_RESOLUTION_DIGITS_PER_MM
    }

    /// The recorded position nearest to `target_mm`.
    fn nearest_mm(&self, target_mm: f64) -> f64 {
        let off_mm = |at: &f64| (at - target_mm).abs();
        let nearest = self.positions_mm.iter().copied().min_by(|a, b| off_mm(a).total_cmp(&off_mm(b)));
        nearest.unwrap_or(target_mm)
    }

    fn start(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        let target_mm = self.nearest_mm(target_mm);
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
        DeviceIdentity { model: self.name.clone(), ..DeviceIdentity::unknown("replay") }
    }

    fn capabilities(&self) -> StageCapabilities {
        StageCapabilities {
            kind: self.kind,
            travel_mm: self.travel_mm(),
            max_speed_mm_s: REPLAY_MAX_SPEED_MM_S,
            acceleration_mm_s2: None,
            homing: Homing::Absent,
            resolution_mm: self.resolution_mm(),
            follows_frames: true,
            frame_pitch_mm: None,
        }
    }

    /// Does nothing: the recorded zero is valid.
    fn start_home(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        check_numbers("target_mm", target_mm, speed_mm_s)?;
        check_travel(target_mm, self.travel_mm())?;
        self.start(target_mm, speed_mm_s)
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        check_numbers("distance_mm", distance_mm, speed_mm_s)?;
        let (low_mm, high_mm) = self.travel_mm();
        let from_mm = lock(&self.playback).playback_state().position_mm.unwrap_or(low_mm);
        self.start((from_mm + distance_mm).clamp(low_mm, high_mm), speed_mm_s)
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        let now = lock(&self.playback).playback_state();
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

    fn stop_handle(&self) -> Arc<dyn StopHandle> {
        self.playback.clone()
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        self.stop()
    }
}
