//! Conversion of device errors to faults or refusals.

use devices::{CameraError, LaserError, StageError};
use remedy::Remedy as _;

use crate::shared::refusal::StationRefusal;
use crate::shared::status::Fault;
use crate::shared::wall_clock::now_ms;

/// Remedy for a device failure without further information.
pub const UNKNOWN_REMEDY: &str = "check the device";

/// The fault behind a refusal; `None` if the device works and only the request was impossible.
pub fn fault_of(refusal: &StationRefusal) -> Option<Fault> {
    let (device, kind) = match refusal {
        StationRefusal::Camera(error) => ("camera", camera_kind(error)?),
        StationRefusal::Stage(error) => ("stage", stage_kind(error)?),
        StationRefusal::Laser(error) => ("laser", laser_kind(error)?),
        StationRefusal::NoFrame { .. } => ("camera", "silent"),
        _ => return None,
    };
    Some(fault(device, kind, refusal.to_string(), refusal.remedy().as_deref().unwrap_or(UNKNOWN_REMEDY)))
}

/// A fault that occurs now, with its detail and remedy.
pub fn fault(device: &'static str, kind: &'static str, detail: impl Into<String>, remedy: &str) -> Fault {
    Fault { device, kind, detail: detail.into(), remedy: remedy.to_owned(), since_ms: now_ms() }
}

fn camera_kind(error: &CameraError) -> Option<&'static str> {
    match error {
        CameraError::Disconnected { .. } => Some("disconnected"),
        CameraError::WrongFrame { .. } => Some("wrong_frame"),
        CameraError::Unreadable { .. } => Some("unreadable"),
        CameraError::Unsupported { .. } | CameraError::NotTriggerable { .. } | CameraError::EndOfRecording => None,
    }
}

fn stage_kind(error: &StageError) -> Option<&'static str> {
    match error {
        StageError::NotHomed
        | StageError::NotCommanded { .. }
        | StageError::OutOfTravel { .. }
        | StageError::BadNumber { .. }
        | StageError::Moving => None,
        StageError::Refused { .. } | StageError::Rejected { .. } => Some("refused"),
        StageError::Stalled { .. } => Some("stalled"),
        StageError::Alarm { .. } | StageError::Warned { .. } => Some("alarm"),
        StageError::Restarted => Some("restarted"),
        StageError::NoResponse { .. } => Some("no_response"),
        StageError::Unreadable { .. } => Some("unreadable"),
        StageError::Disconnected { .. } => Some("disconnected"),
        StageError::WrongDevice { .. } => Some("wrong_device"),
    }
}

fn laser_kind(error: &LaserError) -> Option<&'static str> {
    match error {
        LaserError::InterlockOpen => Some("interlock_open"),
        LaserError::Fault { .. } | LaserError::Controller(_) => Some("fault"),
        LaserError::Disconnected { .. } => Some("disconnected"),
        LaserError::BadPower { .. } | LaserError::NotYet { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_separates_detail_and_remedy() {
        let refusal = StationRefusal::Stage(StageError::Stalled { target_mm: 5.0, actual_mm: 2.5 });
        let fault = fault_of(&refusal).unwrap();
        assert_eq!((fault.device, fault.kind), ("stage", "stalled"));
        assert_eq!(fault.detail, "the stage stopped at 2.5 mm on the way to 5 mm");
        assert_eq!(fault.remedy, "check for an obstacle, then home the stage");
    }

    #[test]
    fn an_impossible_request_is_not_a_fault() {
        let refusal = StationRefusal::Stage(StageError::OutOfTravel { target_mm: 9.0, min_mm: 0.0, max_mm: 1.0 });
        assert_eq!(fault_of(&refusal), None);
    }
}
