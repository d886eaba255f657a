//! Control of the station, Stop and reset.

use std::time::Instant;

use crate::App;
use crate::access::lease::Lease;
use crate::access::principal::Principal;
use crate::control::{self, Request, StopOutcome, admit};
use crate::error::AppError;
use crate::events::{ControlTakenOver, Event, Initiator, event};
use crate::resources::labels::label;

/// A request to take control.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TakeControl {
    /// Their name.
    pub holder: String,
    /// Also take over from another holder.
    pub take_over: bool,
}

/// Takes control for five seconds.
///
/// # Errors
/// `control-required` while someone else is in control and `take_over` is not set; an invalid name.
pub async fn take_control(app: &App, by: &Principal, input: TakeControl) -> Result<Lease, AppError> {
    let TakeControl { holder, take_over } = input;
    label(&holder, "/holder")?;
    let taken = app.control.take(&holder, take_over, Instant::now())?;
    let initiator = Initiator { actor: holder.clone(), ..by.initiator() };
    let entry = match taken.from {
        Some(from) => Event::ControlTakenOver(ControlTakenOver { initiator, from, to: holder.clone() }),
        None => Event::ControlTaken(initiator),
    };
    app.catalogue.commit(vec![event(&holder, entry)]).await?;
    Ok(taken.lease)
}

/// Renews control for five seconds.
///
/// # Errors
/// `control-required` or `control-expired` if the caller does not hold it.
pub fn renew_control(app: &App, by: &Principal) -> Result<Lease, AppError> {
    app.control.renew(by.control_id.as_deref(), Instant::now())
}

/// Releases control; releasing a lease that is not held is not an error.
///
/// # Errors
/// If the log cannot be written.
pub async fn release_control(app: &App, by: &Principal) -> Result<(), AppError> {
    if let Some(lease) = app.control.give_back(by.control_id.as_deref()) {
        let initiator = Initiator { actor: lease.holder.clone(), ..by.initiator() };
        app.catalogue.commit(vec![event(&lease.holder, Event::ControlReleased(initiator))]).await?;
    }
    Ok(())
}

/// Stops the station for anyone at any time; see [`control::stop`].
pub fn stop(app: &App, by: &Principal) -> impl Future<Output = StopOutcome> + Send + use<> {
    control::stop(app, by)
}

/// Resets the station; motion and laser stay off.
///
/// # Errors
/// The reset is refused, or a device cannot be reached.
pub async fn reset(app: &App, by: &Principal) -> Result<(), AppError> {
    admit(app, by, Request::Reset)?;
    control::reset(app, by).await
}
