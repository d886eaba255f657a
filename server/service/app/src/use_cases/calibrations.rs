//! Which calibration is active.

use metrology::PartVerdict;
use store::ActivationRecord;

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::resources::measurements::parts::newest_verification;

/// Which calibration shall be active.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Activate {
    /// Its id.
    pub calibration_id: String,
    /// Refused unless this one is active by now; the inner `None`: none is.
    pub expected: Option<Option<String>>,
    /// Although its newest verification is not OK.
    pub despite_verification: bool,
}

/// Makes a calibration the active one.
///
/// # Errors
/// A newest verification that is not OK, a calibration that cannot scan, another one that was activated meanwhile.
pub async fn activate(app: &App, by: &Principal, input: Activate) -> Result<ActivationRecord, AppError> {
    let Activate { calibration_id: id, expected, despite_verification } = input;
    let verified = newest_verification(&app.ledger, &id).await?.and_then(|part| part.verdict);
    if let Some(verdict) = verified.filter(|verdict| *verdict != PartVerdict::Ok)
        && !despite_verification
    {
        let detail = format!("the newest verification of calibration {id} is {}", verdict.label());
        return Err(AppError::new(ErrorKind::Conflict, detail)
            .at("/despite_verification")
            .remedy("verify it again, or send \"despite_verification\": true to activate it nevertheless"));
    }
    app.calibrations.activate(&id, expected, &by.actor, verified).await
}

/// Takes the last activation back.
///
/// # Errors
/// If there is none, or the one before cannot scan.
pub async fn roll_back(app: &App, by: &Principal) -> Result<ActivationRecord, AppError> {
    app.calibrations.roll_back(&by.actor).await
}
