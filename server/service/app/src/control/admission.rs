//! Whether a request may use the station: applies the table of uses to the caller's lease.

use std::time::Instant;

use station::{StationRefusal, StationStatus};

use crate::App;
use crate::access::lease::{Authority, Caller};
use crate::access::principal::Principal;
use crate::control::{Decision, Refusal, Request, StationUse, rule};
use crate::error::{AppError, ErrorKind};

/// Checks the table for a caller; a command of the holder renews the lease.
///
/// # Errors
/// The refusal; [`Decision::Waits`] is not an error.
pub fn admit(app: &App, by: &Principal, request: Request) -> Result<Authority, AppError> {
    let id = by.control_id.as_deref();
    let now = Instant::now();
    let epoch = app.station.stop_epoch();
    let status = app.station.status();
    let caller = app.control.caller(id, now);
    if let Decision::Refused(refusal) = rule(request, caller, station_use(app, &status)) {
        return Err(match refusal {
            // Also reports whether the lease sent along has expired.
            Refusal::ControlRequired => app.control.command(id, now).err().unwrap_or_else(not_in_control),
            Refusal::Halted => StationRefusal::Halted.into(),
            Refusal::Busy => StationRefusal::Busy { activity: status.activity.clone() }.into(),
            Refusal::Fault => fault(&status),
        });
    }
    if caller == Caller::Holder {
        app.control.command(id, now)?;
    }
    Ok(app.control.authority(id, epoch, now))
}

/// A station whose Stop latch is set counts as halted, even if its thread has not reported it yet or is being reset.
fn station_use(app: &App, status: &StationStatus) -> StationUse {
    if app.station.is_halted() { StationUse::Halted } else { StationUse::from(status) }
}

fn not_in_control() -> AppError {
    AppError::new(ErrorKind::ControlRequired, "control has just been taken by someone else").remedy("try again")
}

fn fault(status: &StationStatus) -> AppError {
    let (detail, remedy) = match status.faults.first() {
        Some(fault) => (fault.detail.clone(), fault.remedy.clone()),
        None => ("a device failed".to_owned(), "check the devices".to_owned()),
    };
    StationRefusal::InError { detail, remedy }.into()
}
