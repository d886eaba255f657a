//! Activation of calibrations.

use metrology::PartVerdict;
use store::ActivationRecord;

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::resources::measurements::parts::newest_verification;

/// A request to activate a calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Activate {
    /// Its id.
    pub calibration_id: String,
    /// Refused unless this one is currently active; inner `None`: none is.
    pub expected: Option<Option<String>>,
    /// Activate even if its latest verification is not OK.
    pub despite_verification: bool,
}

/// Activates a calibration.
///
/// # Errors
/// The latest verification is not OK, the calibration cannot be used for scanning, or another one was activated meanwhile.
pub async fn activate(app: &App, by: &Principal, input: Activate) -> Result<ActivationRecord, AppError> {
    let Activate { calibration_id: id, expected, despite_verification } = input;
    let verified = newest_verification(&app.catalogue, &id).await?.and_then(|part| part.verdict);
    if let Some(verdict) = verified.filter(|verdict| *verdict != PartVerdict::Ok)
        && !despite_verification
    {
        let detail = format!("the latest verification of calibration {id} is {}", verdict.label());
        return Err(AppError::new(ErrorKind::Conflict, detail)
            .at("/despite_verification")
            .remedy("verify it again, or send \"despite_verification\": true to activate it anyway"));
    }
    app.calibrations.activate(&id, expected, &by.actor, verified).await
}

/// Rolls back the last activation.
///
/// # Errors
/// If there is none, or the previous calibration cannot be used for scanning.
pub async fn roll_back(app: &App, by: &Principal) -> Result<ActivationRecord, AppError> {
    app.calibrations.roll_back(&by.actor).await
}
