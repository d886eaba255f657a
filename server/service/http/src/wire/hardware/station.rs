//! The station on the wire.

use serde::{Deserialize, Serialize};
use station::{Fault, MachineState, OperationalState, StationStatus};
use utoipa::ToSchema;

use crate::wire::hardware::control::ControlDto;
use crate::wire::hardware::devices::{CameraDto, LaserDto, StageDto};
use app::control::StopOutcome;

/// State of the station by OPC 40100-1; the substates of Operational with its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub enum MachineStateDto {
    /// Devices are being opened, or were never connected.
    Preoperational,
    /// Stopped by a person: motion and laser stay off until a reset.
    Halted,
    /// A fault must be acknowledged.
    Error,
    /// Devices respond; a scan is not possible yet (homing or calibration is missing).
    #[serde(rename = "Operational.Initialized")]
    Initialized,
    /// A scan can start.
    #[serde(rename = "Operational.Ready")]
    Ready,
    /// A job uses the station.
    #[serde(rename = "Operational.SingleExecution")]
    SingleExecution,
    /// The live view runs.
    #[serde(rename = "Operational.ContinuousExecution")]
    ContinuousExecution,
}

/// The latest state of the station.
#[derive(Debug, Serialize, ToSchema)]
pub struct StationDto {
    /// Its state.
    pub state: MachineStateDto,
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
    /// State after the Stop.
    pub state: MachineStateDto,
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
            state: state.into(),
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

/// A state in plain words.
pub fn state_label(state: MachineState) -> &'static str {
    match state {
        MachineState::Preoperational => "starting, or devices missing",
        MachineState::Halted => "stopped",
        MachineState::Error => "fault: action required",
        MachineState::Operational(OperationalState::Initialized) => "not ready to scan",
        MachineState::Operational(OperationalState::Ready) => "ready",
        MachineState::Operational(OperationalState::SingleExecution) => "running",
        MachineState::Operational(OperationalState::ContinuousExecution) => "live view",
    }
}

impl From<MachineState> for MachineStateDto {
    fn from(state: MachineState) -> Self {
        match state {
            MachineState::Preoperational => Self::Preoperational,
            MachineState::Halted => Self::Halted,
            MachineState::Error => Self::Error,
            MachineState::Operational(OperationalState::Initialized) => Self::Initialized,
            MachineState::Operational(OperationalState::Ready) => Self::Ready,
            MachineState::Operational(OperationalState::SingleExecution) => Self::SingleExecution,
            MachineState::Operational(OperationalState::ContinuousExecution) => Self::ContinuousExecution,
        }
    }
}

impl StationDto {
    /// The station with the holder of control.
    pub fn new(status: &StationStatus, control: Option<ControlDto>) -> Self {
        Self {
            state: status.state.into(),
            state_label: state_label(status.state),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_have_the_names_that_every_interface_uses() {
        for state in MachineState::ALL {
            assert_eq!(serde_json::to_value(MachineStateDto::from(state)).unwrap(), state.name());
        }
    }
}
