//! A conveyor whose encoder triggers the camera: a linear stage that cannot be commanded.
//!
//! The belt belongs to the plant. Its position follows from the frames: the encoder triggers one exposure every
//! `pitch_mm`, so that a position is a number of exposures, those that were lost included. It counts from the first
//! exposure of a scan; while the camera does not run, its motion is not counted.

use std::sync::Arc;
use std::time::Instant;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::traits::driver::{DeviceSet, Driver, OpenError, Opened};
use crate::{
    AcceptedMove, DeviceIdentity, Homing, Stage, StageCapabilities, StageError, StageKind, StageState, StopHandle,
};

/// `[station.conveyor]`: a belt whose encoder triggers the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConveyorSettings {
    /// travel of the belt from one trigger to the next, mm
    #[schemars(range(min = 0.001, max = 100.0))]
    pub pitch_mm: f64,
    /// longest scan, mm
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub longest_mm: f64,
}

impl Default for ConveyorSettings {
    fn default() -> Self {
        Self { pitch_mm: 0.1, longest_mm: 2000.0 }
    }
}

/// Makes a belt: `[station.stage] kind = "conveyor"`.
#[derive(Debug, Clone, Default)]
pub struct ConveyorDriver(pub ConveyorSettings);

impl Driver for ConveyorDriver {
    fn kind(&self) -> &'static str {
        "conveyor"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet { stage: true, ..DeviceSet::default() }
    }

    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let ConveyorSettings { pitch_mm, longest_mm } = self.0;
        if !(pitch_mm > 0.0 && longest_mm > pitch_mm && longest_mm.is_finite()) {
            return Err(OpenError::Settings {
                what: format!("a belt cannot cover {longest_mm} mm in steps of {pitch_mm} mm"),
                remedy: "set station.conveyor.pitch_mm above 0, and station.conveyor.longest_mm beyond it"
                    .to_owned(),
            });
        }
        let stage = wanted.stage.then(|| Box::new(Conveyor::new(self.0.clone())) as Box<dyn Stage>);
        Ok(Opened { stage, ..Opened::default() })
    }
}

/// See the module.
#[derive(Debug)]
pub struct Conveyor {
    settings: ConveyorSettings,
    n_exposures: u64,
    /// When the last of them was counted.
    counted_at: Instant,
}

impl Conveyor {
    /// A belt with no exposure counted.
    pub fn new(settings: ConveyorSettings) -> Self {
        Self { settings, n_exposures: 0, counted_at: crate::time::now() }
    }

    fn refused<T>(command: &'static str) -> Result<T, StageError> {
        Err(StageError::NotCommanded { command })
    }
}

/// The belt is not stopped from here.
struct NoStopHandle;

impl StopHandle for NoStopHandle {
    fn stop_now(&self) {}
}

impl Stage for Conveyor {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity { model: "not controlled here".to_owned(), ..DeviceIdentity::unknown("conveyor") }
    }

    fn capabilities(&self) -> StageCapabilities {
        let ConveyorSettings { pitch_mm, longest_mm } = self.settings;
        StageCapabilities {
            kind: StageKind::Linear,
            travel_mm: (0.0, longest_mm),
            max_speed_mm_s: FASTEST_MM_S,
            acceleration_mm_s2: None,
            homing: Homing::Absent,
            resolution_mm: pitch_mm,
            follows_frames: true,
            frame_pitch_mm: Some(pitch_mm),
        }
    }

    fn start_home(&mut self) -> Result<(), StageError> {
        Self::refused("homed")
    }

    fn start_move(&mut self, _target_mm: f64, _speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        Self::refused("moved")
    }

    fn start_jog(&mut self, _distance_mm: f64, _speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        Self::refused("jogged")
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        // The first exposure is at 0.
        let steps = self.n_exposures.saturating_sub(1) as f64;
        Ok(StageState {
            position_mm: Some(steps * self.settings.pitch_mm),
            measured_at: crate::time::now(),
            moving: false,
            held: false,
            homed: true,
        })
    }

    fn count_exposures(&mut self, n_exposures: u64) -> Option<f64> {
        self.n_exposures += n_exposures;
        self.counted_at = crate::time::now();
        Some((self.n_exposures - 1) as f64 * self.settings.pitch_mm)
    }

    fn begin_count(&mut self) {
        self.n_exposures = 0;
    }

    fn hold(&mut self) -> Result<(), StageError> {
        Self::refused("held")
    }

    fn resume(&mut self) -> Result<(), StageError> {
        Self::refused("resumed")
    }

    /// Nothing to stop: the belt belongs to the plant. This is not a failure, so that the laser goes off as after any
    /// Stop.
    fn stop(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn stop_handle(&self) -> Arc<dyn StopHandle> {
        Arc::new(NoStopHandle)
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        Ok(())
    }
}

/// Speed above which no belt with a laser scanner runs.
const FASTEST_MM_S: f64 = 10_000.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract;
    use remedy::Remedy as _;

    fn belt() -> Conveyor {
        Conveyor::new(ConveyorSettings { pitch_mm: 0.25, longest_mm: 100.0 })
    }

    #[test]
    fn a_belt_passes_the_suite_of_stages_that_cannot_be_commanded() {
        contract::uncommanded_stage(&mut || Box::new(belt()));
    }

    #[test]
    fn a_position_counts_exposures_including_lost_ones() {
        let mut belt = belt();
        belt.begin_count();
        assert_eq!(belt.count_exposures(1), Some(0.0));
        assert_eq!(belt.count_exposures(1), Some(0.25));
        // Two were lost before this one.
        assert_eq!(belt.count_exposures(3), Some(1.0));
        assert_eq!(belt.poll().unwrap().position_mm, Some(1.0));
        belt.begin_count();
        assert_eq!(belt.count_exposures(1), Some(0.0));
    }

    #[test]
    fn commands_are_refused_by_name_with_a_remedy() {
        let error = belt().start_home().unwrap_err();
        assert!(error.to_string().contains("cannot be homed from here"), "{error}");
        assert!(error.remedy().unwrap().contains("continuous"), "{:?}", error.remedy());
    }

    #[test]
    fn a_pitch_of_zero_is_refused() {
        let driver = ConveyorDriver(ConveyorSettings { pitch_mm: 0.0, ..ConveyorSettings::default() });
        let wanted = DeviceSet { stage: true, ..DeviceSet::default() };
        assert!(matches!(driver.open(wanted), Err(OpenError::Settings { .. })));
    }
}
