//! The status of the station, which can be read at any time.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::shared::dark_frame::DarkFrameUse;
use devices::{CameraCapabilities, CameraSettings, DeviceIdentity, LaserCapabilities, StageCapabilities};

/// The states of OPC 40100-1 (machine vision).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MachineState {
    /// Devices are being opened, or were never connected.
    Preoperational,
    /// Stopped by a person: motion and laser stay off until a reset.
    Halted,
    /// A fault must be acknowledged.
    Error,
    /// Operational.
    Operational(OperationalState),
}

/// The substates of Operational.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OperationalState {
    /// Devices respond; a scan is not possible yet (homing or calibration is missing).
    Initialized,
    /// A scan can start.
    Ready,
    /// A job uses the station.
    SingleExecution,
    /// The live view runs.
    ContinuousExecution,
}

impl MachineState {
    /// All states, in the order of their numbers.
    pub const ALL: [Self; 7] = [
        Self::Preoperational,
        Self::Halted,
        Self::Error,
        Self::Operational(OperationalState::Initialized),
        Self::Operational(OperationalState::Ready),
        Self::Operational(OperationalState::SingleExecution),
        Self::Operational(OperationalState::ContinuousExecution),
    ];

    /// StateNumber of Operational, the state that contains the substates.
    pub const OPERATIONAL_NUMBER: u16 = 4;

    /// StateNumber according to OPC 40100-1; of a substate of Operational its own.
    pub fn number(self) -> u16 {
        match self {
            Self::Preoperational => 1,
            Self::Halted => 2,
            Self::Error => 3,
            Self::Operational(OperationalState::Initialized) => 5,
            Self::Operational(OperationalState::Ready) => 6,
            Self::Operational(OperationalState::SingleExecution) => 7,
            Self::Operational(OperationalState::ContinuousExecution) => 8,
        }
    }

    /// Name according to OPC 40100-1.
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

/// State of the laser light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LaserLight {
    /// This program does not switch it: it is on as long as it has power, and no statement that it is off applies.
    NotControlled,
    /// Off.
    Off,
    /// Off, but a job or a person may switch it on at any moment.
    Armed,
    /// On.
    On,
    /// It does not respond: treat it as on.
    Unknown,
}

/// A fault that has not been acknowledged.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// `camera`, `stage`, `laser`.
    pub device: &'static str,
    /// Stable identifier: `disconnected`, `stalled`, `alarm`, `no_response`, …
    pub kind: &'static str,
    /// What happened.
    pub detail: String,
    /// What to do.
    pub remedy: String,
    /// When it occurred, wall clock.
    pub since_ms: i64,
}

/// Last known state of a device.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceStatus<C> {
    /// Whether it responds.
    pub connected: bool,
    /// Its identity.
    pub identity: DeviceIdentity,
    /// Its capabilities.
    pub capabilities: C,
}

/// The latest state changes, numbered without gaps from 1, so that a client that reads the status only occasionally
/// misses none.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StateHistory {
    n_changes: u64,
    latest: VecDeque<MachineState>,
}

impl StateHistory {
    /// Changes kept: more than occur within the time after which a silent viewer is disconnected.
    const KEPT: usize = 256;

    /// Adds an entered state; the same state again is not a change.
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

    /// The changes after number `seen` that are still kept, oldest first.
    pub fn after(&self, seen: u64) -> impl Iterator<Item = (u64, MachineState)> + '_ {
        let first = self.n_changes - self.latest.len() as u64 + 1;
        (first..).zip(self.latest.iter().copied()).filter(move |(number, _)| *number > seen)
    }
}

/// Last known state of the station.
#[derive(Debug, Clone, PartialEq)]
pub struct StationStatus {
    /// State of the station.
    pub state: MachineState,
    /// History of `state`: the station calls [`StateHistory::enter`] whenever it sets `state`.
    pub state_history: StateHistory,
    /// Activity in the operator's words: "scanning, row 12 of 200".
    pub activity: String,
    /// Whether the devices are simulated or a recording: `twin`, `replay`, or `None` for real ones.
    pub simulated: Option<&'static str>,
    /// The camera.
    pub camera: DeviceStatus<CameraCapabilities>,
    /// Its settings.
    pub camera_settings: CameraSettings,
    /// How its frames are corrected for the dark signal of its sensor.
    pub dark_frame_use: DarkFrameUse,
    /// Frames per second over the last second.
    pub frame_rate_hz: f64,
    /// The stage.
    pub stage: DeviceStatus<StageCapabilities>,
    /// Position; `None` if unknown.
    pub position_mm: Option<f64>,
    /// Whether it moves.
    pub moving: bool,
    /// Whether it is homed.
    pub homed: bool,
    /// The laser.
    pub laser: DeviceStatus<LaserCapabilities>,
    /// What happens to its light if this program is killed, see [`devices::Laser::lost_host`]; `None` without a laser.
    pub laser_lost_host: Option<&'static str>,
    /// State of its light.
    pub laser_light: LaserLight,
    /// Fraction of full power.
    pub laser_power: f64,
    /// `Some(true)`: closed; `None`: not read back.
    pub interlock_closed: Option<bool>,
    /// The job that uses the station.
    pub job_id: Option<String>,
    /// Faults waiting for acknowledgement.
    pub faults: Vec<Fault>,
    /// Frames received since the start.
    pub frames_arrived: u64,
    /// Frames lost since the start, by reason.
    pub frames_dropped: Vec<(&'static str, u64)>,
}

/// Frames lost, by reason; every reason appears in the API and in the metrics.
#[derive(Debug, Default)]
pub struct DropCounts {
    /// Lost between sensor and driver.
    pub camera: AtomicU64,
    /// Packets of the frame were missing; it is not processed.
    pub incomplete: AtomicU64,
    /// No free buffer: all earlier frames were still in use.
    pub no_buffer: AtomicU64,
    /// The recorder of a job was too slow.
    pub recorder: AtomicU64,
    /// The frame had another size or format than configured.
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

    /// Sum over all reasons.
    pub fn total(&self) -> u64 {
        self.by_reason().iter().map(|(_, count)| count).sum()
    }
}

/// Exposures lost, by reason.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Lost {
    /// Between sensor and driver.
    pub camera: u64,
    /// With missing packets.
    pub incomplete: u64,
    /// Without a free buffer.
    pub no_buffer: u64,
    /// With another size or format than configured.
    pub malformed: u64,
}

impl Lost {
    /// Sum over all reasons.
    pub fn total(&self) -> u64 {
        self.camera + self.incomplete + self.no_buffer + self.malformed
    }

    /// Adds other losses.
    pub fn add(&mut self, other: Self) {
        self.camera += other.camera;
        self.incomplete += other.incomplete;
        self.no_buffer += other.no_buffer;
        self.malformed += other.malformed;
    }

    /// Adds the losses to shared counts.
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
    fn states_have_the_numbers_of_the_standard() {
        let numbers = MachineState::ALL.map(MachineState::number);
        assert_eq!(numbers, [1, 2, 3, 5, 6, 7, 8]);
        for state in MachineState::ALL {
            let is_within = state.name().starts_with("Operational.");
            assert_eq!(is_within, state.number() > MachineState::OPERATIONAL_NUMBER, "{state:?}");
        }
    }

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
