//! The station on the wire.

use serde::{Deserialize, Serialize};
use station::{Fault, MachineState, OperationalState, StationStatus};
use utoipa::ToSchema;

use crate::wire::hardware::control::ControlDto;
use crate::wire::hardware::devices::{CameraDto, LaserDto, StageDto};
use app::control::StopOutcome;

/// The latest state of the station.
#[derive(Debug, Serialize, ToSchema)]
pub struct StationDto {
    /// State name of OPC 40100-1.
    #[schema(example = "Operational.Ready")]
    pub state: &'static str,
    /// The state in plain words.
    #[schema(example = "ready")]
    pub state_label: &'static str,
    /// Current activity.
    pub activity: String,
    /// `twin` or `replay` if the data are simulated or replayed.
    pub simulated: Option<&'static str>,
    /// The camera.
    pub camera: CameraDto,
    /// The stage.
    pub stage: StageDto,
    /// The laser.
    pub laser: LaserDto,
    /// The job that uses the station.
    pub job_id: Option<String>,
    /// Who is in control; absent if no one is.
    pub control: Option<ControlDto>,
    /// Active faults.
    pub faults: Vec<FaultDto>,
    /// Frame counts since the service started.
    pub frames: FrameCountsDto,
}

/// A fault that must be acknowledged.
#[derive(Debug, Serialize, ToSchema)]
pub struct FaultDto {
    /// `camera`, `stage`, `laser`.
    pub device: &'static str,
    /// A stable code.
    #[schema(example = "disconnected")]
    pub kind: &'static str,
    /// What happened.
    pub detail: String,
    /// What to do.
    pub remedy: String,
    /// Time of the fault, ms since 1970 (UTC).
    pub since_ms: i64,
}

/// Frame counts since the service started: exposed = arrived + dropped.
#[derive(Debug, Serialize, ToSchema)]
pub struct FrameCountsDto {
    /// Frames that arrived.
    pub arrived: u64,
    /// Lost frames by reason.
    pub dropped: std::collections::BTreeMap<&'static str, u64>,
}

/// Result of a Stop.
#[derive(Debug, Serialize, ToSchema)]
pub struct StopResultDto {
    /// Whether the devices received the Stop; `false`: the station thread has ended, with the laser off and the
    /// stage at rest.
    pub acknowledged: bool,
    /// State after the Stop (OPC 40100-1).
    pub state: &'static str,
    /// Why the Stop did not reach the devices or could not be stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detail: Option<String>,
}

impl StopResultDto {
    /// The result of a Stop, with the state after it.
    pub fn new(outcome: StopOutcome, state: MachineState) -> Self {
        let unrecorded = (!outcome.recorded)
            .then(|| "the Stop could not be stored: it will not persist across a restart".to_owned());
        Self {
            acknowledged: outcome.acknowledged.is_ok(),
            state: state_names(state).0,
            detail: outcome.acknowledged.err().map(|refusal| refusal.to_string()).or(unrecorded),
        }
    }
}

/// Request to start or end the live view.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetLiveDto {
    /// Whether the live view runs.
    pub running: bool,
    /// Fraction of full laser power; 0 is off.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 1.0)]
    pub laser_power: f64,
}

/// OPC 40100-1 name and plain-word label of a state.
pub fn state_names(state: MachineState) -> (&'static str, &'static str) {
    match state {
        MachineState::Preoperational => ("Preoperational", "starting, or devices missing"),
        MachineState::Halted => ("Halted", "stopped"),
        MachineState::Error => ("Error", "fault: action required"),
        MachineState::Operational(OperationalState::Initialized) => {
            ("Operational.Initialized", "not ready to scan")
        }
        MachineState::Operational(OperationalState::Ready) => ("Operational.Ready", "ready"),
        MachineState::Operational(OperationalState::SingleExecution) => ("Operational.SingleExecution", "running"),
        MachineState::Operational(OperationalState::ContinuousExecution) => {
            ("Operational.ContinuousExecution", "live view")
        }
    }
}

impl StationDto {
    /// The station with the holder of control.
    pub fn new(status: &StationStatus, control: Option<ControlDto>) -> Self {
        let (state, state_label) = state_names(status.state);
        Self {
            state,
            state_label,
            activity: status.activity.clone(),
            simulated: status.simulated,
            camera: status.into(),
            stage: status.into(),
            laser: status.into(),
            job_id: status.job_id.clone(),
            control,
            faults: status.faults.iter().map(FaultDto::from).collect(),
            frames: FrameCountsDto {
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
