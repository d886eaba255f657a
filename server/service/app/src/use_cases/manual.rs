//! Manual control of the devices: camera, stage, laser, live view.

use std::time::Instant;

use devices::{AcceptedMove, CameraRequest};
use station::{LiveRequest, Manual};

use crate::App;
use crate::access::principal::Principal;
use crate::camera::auto_exposure::auto_exposure;
use crate::camera::memory;
use crate::control::{Request, admit};
use crate::error::AppError;
use crate::events::{CameraConfigured, Event, LaserSwitched, LiveView, StageMotion, by_kind, event};

/// The holder of control may turn devices off in every state of the station.
fn in_control(app: &App, by: &Principal) -> Result<(), AppError> {
    app.control.command(by.control_id.as_deref(), Instant::now()).map(drop)
}

/// Changes camera settings if the caller is in control and `may` agrees.
///
/// # Errors
/// The caller is not in control, `may` refuses, or the camera refuses.
pub async fn configure_camera<E: From<AppError>>(
    app: &App,
    by: &Principal,
    wanted: CameraRequest,
    may: impl FnOnce() -> Result<(), E>,
) -> Result<(), E> {
    in_control(app, by)?;
    may()?;
    app.station.manual(Manual::Configure(wanted)).await.map_err(AppError::from)?;
    Ok(configured(app, by, &wanted).await?)
}

/// Adjusts the exposure so that the laser lines are bright but not saturated; needs a live view with the laser on.
///
/// # Errors
/// The caller may not use the station, there is no live view with the laser on, or the camera refuses.
pub async fn auto_expose(app: &App, by: &Principal) -> Result<(), AppError> {
    let may_go_on = || admit(app, by, Request::Command).map(drop);
    may_go_on()?;
    auto_exposure(app, may_go_on).await?;
    let exposure_us = app.station.status().camera_settings.exposure_us;
    let wanted = CameraRequest { exposure_us: Some(exposure_us), ..CameraRequest::default() };
    configured(app, by, &wanted).await
}

/// Stores and publishes the user's camera settings.
async fn configured(app: &App, by: &Principal, wanted: &CameraRequest) -> Result<(), AppError> {
    memory::remember(&app.catalogue, wanted, &app.station.status().camera_settings).await?;
    let kept = memory::StoredCameraSettings::all(&app.station.status().camera_settings);
    let body = CameraConfigured { initiator: by.initiator(), settings: kept };
    app.catalogue.commit(vec![event("camera", Event::CameraConfigured(body))]).await?;
    Ok(())
}

/// Homes, moves or jogs the stage; returns what the stage accepted before the motion ends.
///
/// # Errors
/// The caller may not use the station, or the stage refuses.
pub async fn move_stage(app: &App, by: &Principal, command: Manual) -> Result<Option<AcceptedMove>, AppError> {
    admit(app, by, Request::Command)?;
    let (variant, jog) = (motion_event(&command), matches!(command, Manual::Jog { .. }));
    let accepted = app.station.manual(command).await?;
    // A jog is repeated many times a second: only its start is an event.
    if accepted.is_some() || !jog {
        let kind = app.station.status().stage.capabilities.kind;
        let (target_mm, target_deg) = by_kind(kind, accepted.map(|to| to.target_mm));
        let (speed_mm_s, speed_deg_s) = by_kind(kind, accepted.map(|to| to.speed_mm_s));
        let body = StageMotion { initiator: by.initiator(), target_mm, target_deg, speed_mm_s, speed_deg_s };
        app.catalogue.commit(vec![event("stage", variant(body))]).await?;
    }
    Ok(accepted)
}

fn motion_event(command: &Manual) -> fn(StageMotion) -> Event {
    match command {
        Manual::Home => Event::StageHomed,
        Manual::Jog { .. } => Event::StageJogged,
        _ => Event::StageMoved,
    }
}

/// Sets the laser power as a fraction of full power; 0 turns it off. The laser is on only while frames arrive.
///
/// # Errors
/// The caller may not use the station, or the laser refuses.
pub async fn switch_laser(app: &App, by: &Principal, power: f64) -> Result<(), AppError> {
    if power > 0.0 {
        admit(app, by, Request::Command)?;
    } else {
        in_control(app, by)?;
    }
    app.station.manual(Manual::Laser { power }).await?;
    let body = LaserSwitched { initiator: by.initiator(), power };
    app.catalogue.commit(vec![event("laser", Event::LaserSwitched(body))]).await?;
    Ok(())
}

/// Starts or ends the live view.
///
/// # Errors
/// The caller may not use the station, or a device refuses.
pub async fn set_live_view(app: &App, by: &Principal, wanted: LiveRequest) -> Result<(), AppError> {
    let LiveRequest { running, laser_power } = wanted;
    if running {
        admit(app, by, Request::Command)?;
    } else {
        in_control(app, by)?;
    }
    app.station.live(wanted).await?;
    let body = LiveView { initiator: by.initiator(), laser_power };
    let change = if running { Event::LiveStarted(body) } else { Event::LiveEnded(body) };
    app.catalogue.commit(vec![event("station", change)]).await?;
    Ok(())
}
