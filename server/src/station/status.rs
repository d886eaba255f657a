//! What everyone may know about the station at any time.

use std::sync::atomic::{AtomicU64, Ordering};

use devices::{CameraCapabilities, CameraSettings, DeviceIdentity, LaserCapabilities, StageCapabilities};

/// The states of OPC 40100-1 (machine vision).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MachineState {
    /// Devices are being opened, or were never reached.
    Preoperational,
    /// Stopped by a person: nothing moves, nothing shines; the next authorised job or a reset goes on.
    Halted,
    /// A fault must be acknowledged.
    Error,
    /// Able to work.
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

/// Whether there is laser light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LaserLight {
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

/// The station as last seen.
#[derive(Debug, Clone, PartialEq)]
pub struct StationStatus {
    /// Its state.
    pub state: MachineState,
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
    /// Whether it shines.
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
