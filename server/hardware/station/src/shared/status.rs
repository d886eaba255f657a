//! The status of the station, as everyone may read it at any time.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};

use devices::{CameraCapabilities, CameraSettings, DeviceIdentity, LaserCapabilities, StageCapabilities};

/// The states of OPC 40100-1 (machine vision).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MachineState {
    /// Devices are being opened, or were never reached.
    Preoperational,
    /// Stopped by a person: motion and laser stay off until a reset.
    Halted,
    /// A fault must be acknowledged.
    Error,
    /// Operational.
    Operational(OperationalState),
}

/// The states within Operational.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OperationalState {
    /// Devices answer; something is missing for a scan (homing, a calibration).
    Initialized,
    /// A scan could begin now.
    Ready,
    /// A job has the station.
    SingleExecution,
    /// The live view runs.
    ContinuousExecution,
}

impl MachineState {
    /// The name of OPC 40100-1.
    pub fn name(self) -> &'static str {
        match self {
            Self::Preoperational => "Preoperational",
            Self::Halted => "Halted",
            Self::Error => "Error",
            Self::Operational(OperationalState::Initialized) => "Operational.Initialized",
            Self::Operational(OperationalState::Ready) => "Operational.Ready",
            Self::Operational(OperationalState::SingleExecution) => "Operational.SingleExecution",
            Self::Operational(OperationalState::ContinuousExecution) => "Operational.ContinuousExecution",
        }
    }
}

/// Whether there is laser light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LaserLight {
    /// This program does not switch it: it shines as long as it has power, and no promise of darkness holds.
    NotControlled,
    /// Dark.
    Off,
    /// A job or a person may switch it on at any moment.
    Armed,
    /// Shining.
    On,
    /// It cannot be reached: treat it as shining.
    Unknown,
}

/// A fault that has not been acknowledged.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// `camera`, `stage`, `laser`.
    pub device: &'static str,
    /// A stable word: `gone`, `stalled`, `alarm`, `no_reply`, …
    pub kind: &'static str,
    /// What happened.
    pub detail: String,
    /// What to do.
    pub remedy: String,
    /// When, wall clock.
    pub since_ms: i64,
}

/// A device as last seen.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceStatus<C> {
    /// Whether it answers.
    pub connected: bool,
    /// Which one it is.
    pub identity: DeviceIdentity,
    /// What it can do.
    pub capabilities: C,
}

/// The latest changes of state, numbered without gaps from 1, so that whoever sees the status only now and then
/// misses none.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StateHistory {
    n_changes: u64,
    latest: VecDeque<MachineState>,
}

impl StateHistory {
    /// Changes kept: more than a station makes in the seconds after which a silent viewer is given up.
    const KEPT: usize = 256;

    /// Notes the state that was entered; the same state again is no change.
    pub fn enter(&mut self, state: MachineState) {
        if self.latest.back() == Some(&state) {
            return;
        }
        if self.latest.len() == Self::KEPT {
            self.latest.pop_front();
        }
        self.latest.push_back(state);
        self.n_changes += 1;
    }

    /// Number of the newest change; 0 before the first.
    pub fn newest(&self) -> u64 {
        self.n_changes
    }

    /// The changes after number `seen`, as far as they are kept, oldest first.
    pub fn after(&self, seen: u64) -> impl Iterator<Item = (u64, MachineState)> + '_ {
        let first = self.n_changes - self.latest.len() as u64 + 1;
        (first..).zip(self.latest.iter().copied()).filter(move |(number, _)| *number > seen)
    }
}

/// The station as last seen.
#[derive(Debug, Clone, PartialEq)]
pub struct StationStatus {
    /// Its state.
    pub state: MachineState,
    /// How it came to be in it: the station calls [`StateHistory::enter`] whenever it sets `state`.
    pub state_history: StateHistory,
    /// In the operator's words: "scanning, row 12 of 200".
    pub activity: String,
    /// Whether the devices are simulated or a recording: `twin`, `replay`, or `None` for real ones.
    pub simulated: Option<&'static str>,
    /// The camera.
    pub camera: DeviceStatus<CameraCapabilities>,
    /// How it is set.
    pub camera_settings: CameraSettings,
    /// Frames per second over the last second.
    pub frame_rate_hz: f64,
    /// The stage.
    pub stage: DeviceStatus<StageCapabilities>,
    /// `None`: unknown.
    pub position_mm: Option<f64>,
    /// Whether it moves.
    pub moving: bool,
    /// Whether its zero is established.
    pub homed: bool,
    /// The laser.
    pub laser: DeviceStatus<LaserCapabilities>,
    /// What becomes of its light if this program is killed, see [`devices::Laser::lost_host`]; `None`: no laser.
    pub laser_lost_host: Option<&'static str>,
    /// Whether it is on.
    pub laser_light: LaserLight,
    /// Share of full power.
    pub laser_power: f64,
    /// `Some(true)`: closed; `None`: not read back.
    pub interlock_closed: Option<bool>,
    /// Which job has the station.
    pub job_id: Option<String>,
    /// Faults that wait for a person.
    pub faults: Vec<Fault>,
    /// Frames that arrived since the start.
    pub frames_arrived: u64,
    /// Frames lost since the start, by reason.
    pub frames_dropped: Vec<(&'static str, u64)>,
}

/// Frames lost, by reason; every reason is visible in the API and in the metrics.
#[derive(Debug, Default)]
pub struct DropCounts {
    /// Lost between sensor and driver.
    pub camera: AtomicU64,
    /// Packets of the frame were missing: it is not processed.
    pub incomplete: AtomicU64,
    /// No free buffer: everyone still held the earlier frames.
    pub no_buffer: AtomicU64,
    /// The recorder of a job was too slow.
    pub recorder: AtomicU64,
    /// The frame came with another size or format.
    pub malformed: AtomicU64,
}

impl DropCounts {
    /// Reasons and counts.
    pub fn by_reason(&self) -> Vec<(&'static str, u64)> {
        [
            ("camera", &self.camera),
            ("incomplete", &self.incomplete),
            ("no_buffer", &self.no_buffer),
            ("recorder", &self.recorder),
            ("malformed", &self.malformed),
        ]
        .map(|(reason, count)| (reason, count.load(Ordering::Relaxed)))
        .to_vec()
    }

    /// All together.
    pub fn total(&self) -> u64 {
        self.by_reason().iter().map(|(_, count)| count).sum()
    }
}

/// Exposures lost, by reason.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Lost {
    /// Between sensor and driver.
    pub camera: u64,
    /// Packets of them were missing.
    pub incomplete: u64,
    /// For want of a buffer.
    pub no_buffer: u64,
    /// Of another size or format than agreed.
    pub malformed: u64,
}

impl Lost {
    /// All together.
    pub fn total(&self) -> u64 {
        self.camera + self.incomplete + self.no_buffer + self.malformed
    }

    /// Adds others.
    pub fn add(&mut self, other: Self) {
        self.camera += other.camera;
        self.incomplete += other.incomplete;
        self.no_buffer += other.no_buffer;
        self.malformed += other.malformed;
    }

    /// Adds them to shared counts.
    pub fn count_into(&self, counts: &DropCounts) {
        counts.camera.fetch_add(self.camera, Ordering::Relaxed);
        counts.incomplete.fetch_add(self.incomplete, Ordering::Relaxed);
        counts.no_buffer.fetch_add(self.no_buffer, Ordering::Relaxed);
        counts.malformed.fetch_add(self.malformed, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_reader_sees_every_change_in_order() {
        let ready = MachineState::Operational(OperationalState::Ready);
        let mut history = StateHistory::default();
        for state in [MachineState::Preoperational, ready, ready, MachineState::Halted, ready] {
            history.enter(state);
        }
        assert_eq!(history.after(2).collect::<Vec<_>>(), [(3, MachineState::Halted), (4, ready)]);
        assert_eq!(history.newest(), 4);
        (0..1000).for_each(|_| [MachineState::Halted, ready].into_iter().for_each(|state| history.enter(state)));
        assert_eq!(history.after(0).count(), StateHistory::KEPT);
        assert_eq!(history.after(0).last(), Some((2004, ready)));
    }
}
