//! Control of the simulated station: what is on the stage and which faults are active. Simulated stations only.
//!
//! These actions need no control lease: at a real station, placing a part needs none either, and nothing records it.

use std::sync::Arc;

use twin::{SceneKind, TwinControl, TwinFault, read_stl};

use crate::App;
use crate::access::principal::Principal;
use crate::control::{Request, admit};
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, SimulatedFault, event};
use crate::sessions::VirtualBoard;

/// The control of the simulated station.
///
/// # Errors
/// If the station is not simulated.
pub fn simulation(app: &App) -> Result<TwinControl, AppError> {
    app.station.simulation().ok_or_else(|| {
        AppError::new(ErrorKind::NotFound, "the station is not simulated")
            .remedy("start the service with station.camera.kind = \"twin\"")
    })
}

/// The same, only while no job uses the station: the scene must not change during a scan.
///
/// # Errors
/// If the station is not simulated, or a job uses it.
pub fn idle_simulation(app: &App, by: &Principal) -> Result<TwinControl, AppError> {
    let twin = simulation(app)?;
    admit(app, by, Request::ChangeScene)?;
    Ok(twin)
}

/// Sets where the virtual operator holds the board.
///
/// # Errors
/// If the station is not simulated, or there is no such pose.
pub fn place_board(app: &App, place: VirtualBoard) -> Result<(), AppError> {
    app.sessions.place_virtual_board(place)
}

/// Places a scene on the stage.
///
/// # Errors
/// If the station is not simulated, or a job uses it.
pub fn place_scene(app: &App, by: &Principal, part: &SceneKind) -> Result<(), AppError> {
    idle_simulation(app, by)?.place_part(part);
    Ok(())
}

/// Places a part from the bytes of an STL file (binary or ASCII, mm) on the plate of the stage.
///
/// # Errors
/// If the station is not simulated, a job uses it, or the bytes are not a valid STL file.
pub async fn place_part(app: &App, by: &Principal, stl: Vec<u8>) -> Result<(), AppError> {
    let twin = idle_simulation(app, by)?;
    let read = tokio::task::spawn_blocking(move || read_stl(&stl)).await;
    let solid = read.map_err(|cause| {
        AppError::new(ErrorKind::Internal, "reading the part failed with an internal error")
            .because(cause.to_string())
    })??;
    twin.place_solid(Arc::new(solid));
    Ok(())
}

/// Activates a simulated fault by name.
///
/// # Errors
/// If the station is not simulated, or the fault or value is unknown.
pub async fn enable_fault(app: &App, by: &Principal, name: &str, value: Option<f64>) -> Result<(), AppError> {
    let twin = simulation(app)?;
    let fault = TwinFault::named(name, value).map_err(|error| AppError::from(error).at("/name"))?;
    twin.set_fault(fault);
    let body = SimulatedFault { initiator: by.initiator(), value: fault.value() };
    app.catalogue.commit(vec![event(fault.name(), Event::SimulationFaultOn(body))]).await?;
    Ok(())
}

/// Deactivates a simulated fault by name; the station may need a reset afterwards.
///
/// # Errors
/// If the station is not simulated, or the fault is not active.
pub async fn disable_fault(app: &App, by: &Principal, name: &str) -> Result<(), AppError> {
    if !simulation(app)?.clear_fault(name) {
        return Err(AppError::new(ErrorKind::NotFound, format!("fault \"{name}\" is not active"))
            .remedy("GET /api/v1/simulation/faults lists the active ones"));
    }
    app.catalogue.commit(vec![event(name, Event::SimulationFaultOff(by.initiator()))]).await?;
    Ok(())
}
