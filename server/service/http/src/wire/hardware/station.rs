//! The station on the wire.

use serde::{Deserialize, Serialize};
use station::{Fault, MachineState, OperationalState, StationStatus};
use utoipa::ToSchema;

use crate::wire::hardware::control::ControlDto;
use crate::wire::hardware::devices::{CameraDto, LaserDto, StageDto};
use app::control::StopOutcome;

/// The station as last seen.
#[derive(Debug, Serialize, ToSchema)]
pub struct StationDto {
    /// Name of the state by OPC 40100-1.
    #[schema(example = "Operational.Ready")]
    pub state: &'static str,
    /// The state in words.
    #[schema(example = "ready")]
    pub words: &'static str,
    /// What it does.
    pub activity: String,
    /// `twin` or `replay` if the devices are not real; then nothing measured here is a real part.
    pub simulated: Option<&'static str>,
    /// The camera.
    pub camera: CameraDto,
    /// The stage.
    pub stage: StageDto,
    /// The laser.
    pub laser: LaserDto,
    /// The job that has the station.
    pub job_id: Option<String>,
    /// Who commands; missing if nobody does.
    pub control: Option<ControlDto>,
    /// Faults that wait for a person.
    pub faults: Vec<FaultDto>,
    /// Frames since the service began.
    pub frames: FramesDto,
}

/// A fault that waits for a person.
#[derive(Debug, Serialize, ToSchema)]
pub struct FaultDto {
    /// `camera`, `stage`, `laser`.
    pub device: &'static str,
    /// A stable word.
    #[schema(example = "gone")]
    pub kind: &'static str,
    /// What happened.
    pub detail: String,
    /// What to do.
    pub remedy: String,
    /// When, wall clock, ms since 1970.
    pub since_ms: i64,
}

/// Frames since the service began: exposed = arrived + dropped.
#[derive(Debug, Serialize, ToSchema)]
pub struct FramesDto {
    /// Frames that arrived.
    pub arrived: u64,
    /// Frames lost, by reason.
    pub dropped: std::collections::BTreeMap<&'static str, u64>,
}

/// What Stop did.
#[derive(Debug, Serialize, ToSchema)]
pub struct StoppedDto {
    /// Whether the devices received it; `false`: the station thread has ended, which leaves the laser off and
    /// at rest.
    pub acknowledged: bool,
    /// Name of the state after it.
    pub state: &'static str,
    /// What kept the Stop from the devices or from being stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detail: Option<String>,
}

impl StoppedDto {
    /// What became of a Stop, with the state after it.
    pub fn new(outcome: StopOutcome, state: MachineState) -> Self {
        let unrecorded =
            (!outcome.recorded).then(|| "the Stop could not be stored: it will not outlast a restart".to_owned());
        Self {
            acknowledged: outcome.acknowledged.is_ok(),
            state: state_names(state).0,
            detail: outcome.acknowledged.err().map(|refusal| refusal.to_string()).or(unrecorded),
        }
    }
}

/// What the live view shall do.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetLiveDto {
    /// Whether it shall run.
    pub running: bool,
    /// Share of full laser power; 0 is dark.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 1.0)]
    pub laser_power: f64,
}

/// Name by OPC 40100-1 and words of a state.
pub fn state_names(state: MachineState) -> (&'static str, &'static str) {
    match state {
        MachineState::Preoperational => ("Preoperational", "starting, or without its devices"),
        MachineState::Halted => ("Halted", "stopped"),
        MachineState::Error => ("Error", "in error: a fault waits for a person"),
        MachineState::Operational(OperationalState::Initialized) => {
            ("Operational.Initialized", "able to work, not yet to scan")
        }
        MachineState::Operational(OperationalState::Ready) => ("Operational.Ready", "ready"),
        MachineState::Operational(OperationalState::SingleExecution) => ("Operational.SingleExecution", "at work"),
        MachineState::Operational(OperationalState::ContinuousExecution) => {
            ("Operational.ContinuousExecution", "live view")
        }
    }
}

impl StationDto {
    /// The station with who commands it.
    pub fn new(status: &StationStatus, control: Option<ControlDto>) -> Self {
        let (state, words) = state_names(status.state);
        Self {
            state,
            words,
            activity: status.activity.clone(),
            simulated: status.simulated,
            camera: status.into(),
            stage: status.into(),
            laser: status.into(),
            job_id: status.job_id.clone(),
            control,
            faults: status.faults.iter().map(FaultDto::from).collect(),
            frames: FramesDto {
                arrived: status.frames_arrived,
                dropped: status.frames_dropped.iter().copied().collect(),
            },
        }
    }
}

impl From<&Fault> for FaultDto {
    fn from(fault: &Fault) -> Self {
        Self {
            device: fault.device,
            kind: fault.kind,
            detail: fault.detail.clone(),
            remedy: fault.remedy.clone(),
            since_ms: fault.since_ms,
        }
    }
}
