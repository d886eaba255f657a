//! What a person's hands do at the simulated station: what lies on the stage, which faults it has. Only there.
//!
//! They need no control: at a real station nobody asks the service before laying down a part.

use std::sync::Arc;

use twin::{SceneKind, TwinControl, TwinFault, read_stl};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, NoBody, SimulatedFault, event};
use crate::sessions::VirtualBoard;

/// The hands at the simulated station.
///
/// # Errors
/// If the station is not simulated.
pub fn simulation(app: &App) -> Result<TwinControl, AppError> {
    app.station.simulation().ok_or_else(|| {
        AppError::new(ErrorKind::NotFound, "the station is not simulated")
            .remedy("start the service with station.camera.kind = \"twin\"")
    })
}

/// The hands while no job has the station: what it scans must not change under it.
///
/// # Errors
/// If the station is not simulated, or a job has it.
pub fn idle_simulation(app: &App) -> Result<TwinControl, AppError> {
    let hands = simulation(app)?;
    let status = app.station.status();
    if status.job_id.is_none() {
        return Ok(hands);
    }
    Err(AppError::new(ErrorKind::StationBusy, format!("the station is busy: {}", status.activity))
        .remedy("wait for the job, or cancel it")
        .retry_after_s(1))
}

/// Lets the virtual operator hold the board somewhere.
///
/// # Errors
/// If the station is not simulated, or there is no such pose.
pub fn place_board(app: &App, _by: &Principal, place: VirtualBoard) -> Result<(), AppError> {
    app.sessions.place_virtual_board(place)
}

/// Puts a known part on the stage.
///
/// # Errors
/// If the station is not simulated, or a job has it.
pub fn place_part(app: &App, _by: &Principal, part: &SceneKind) -> Result<(), AppError> {
    idle_simulation(app)?.place_part(part);
    Ok(())
}

/// Puts a part from the bytes of an STL file (binary or text, mm) on the stage's plate.
///
/// # Errors
/// If the station is not simulated, a job has it, or the bytes are no part.
pub async fn place_solid(app: &App, _by: &Principal, stl: Vec<u8>) -> Result<(), AppError> {
    let hands = idle_simulation(app)?;
    let read = tokio::task::spawn_blocking(move || read_stl(&stl)).await;
    let solid = read.map_err(|cause| {
        AppError::new(ErrorKind::Internal, "reading the part ended by a defect").because(cause.to_string())
    })??;
    hands.place_solid(Arc::new(solid));
    Ok(())
}

/// Switches the fault of that name on.
///
/// # Errors
/// If the station is not simulated, or there is no such fault or value.
pub async fn switch_fault_on(app: &App, _by: &Principal, name: &str, value: Option<f64>) -> Result<(), AppError> {
    let hands = simulation(app)?;
    let fault = TwinFault::named(name, value).map_err(|error| AppError::from(error).at("/name"))?;
    hands.set_fault(fault);
    let body = SimulatedFault { value: fault.value() };
    app.ledger.commit(vec![event(fault.name(), Event::SimulationFaultOn(body))]).await?;
    Ok(())
}

/// Switches the fault of that name off; what it did to a device may need a reset of the station.
///
/// # Errors
/// If the station is not simulated, or no such fault is on.
pub async fn switch_fault_off(app: &App, _by: &Principal, name: &str) -> Result<(), AppError> {
    if !simulation(app)?.clear_fault(name) {
        return Err(AppError::new(ErrorKind::NotFound, format!("no fault \"{name}\" is switched on"))
            .remedy("GET /api/v1/simulation/faults lists those that are"));
    }
    app.ledger.commit(vec![event(name, Event::SimulationFaultOff(NoBody {}))]).await?;
    Ok(())
}
