//! The devices by hand: camera, stage, laser, live view.

use std::time::Instant;

use devices::{AcceptedMove, CameraRequest};
use station::{LiveRequest, Manual};

use crate::App;
use crate::access::principal::Principal;
use crate::camera::auto_exposure::auto_exposure;
use crate::camera::memory;
use crate::control::{Ask, admit};
use crate::error::AppError;
use crate::events::{CameraConfigured, Event, LaserSwitched, LiveView, Motion, event};

/// What only turns something off is refused to nobody in control, whatever the station does.
fn in_control(app: &App, by: &Principal) -> Result<(), AppError> {
    app.control.command(by.control_id.as_deref(), Instant::now()).map(drop)
}

/// Sets the camera if `may` agrees, once it is known that who asks is in control.
///
/// # Errors
/// Who is not in control, what `may` says, a camera that refuses.
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

/// Sets the exposure so that the lines are bright and not flattened; needs a live view with light.
///
/// # Errors
/// Who may not command the station; no live view with light; a camera that refuses.
pub async fn auto_expose(app: &App, by: &Principal) -> Result<(), AppError> {
    let may_go_on = || admit(app, by, Ask::Command).map(drop);
    may_go_on()?;
    auto_exposure(app, may_go_on).await?;
    let exposure_us = app.station.status().camera_settings.exposure_us;
    let wanted = CameraRequest { exposure_us: Some(exposure_us), ..CameraRequest::default() };
    configured(app, by, &wanted).await
}

/// Stores and publishes the settings a person gave the camera.
async fn configured(app: &App, by: &Principal, wanted: &CameraRequest) -> Result<(), AppError> {
    memory::remember(&app.ledger, wanted, &app.station.status().camera_settings).await?;
    let kept = memory::KeptSettings::all(&app.station.status().camera_settings);
    let body = CameraConfigured { act: by.act(), settings: kept };
    app.ledger.commit(vec![event("camera", Event::CameraConfigured(body))]).await?;
    Ok(())
}

/// Homes, moves or jogs the stage; goes on after the answer, which says what the stage accepted.
///
/// # Errors
/// Who may not command the station, a stage that refuses.
pub async fn move_stage(app: &App, by: &Principal, command: Manual) -> Result<Option<AcceptedMove>, AppError> {
    admit(app, by, Ask::Command)?;
    let (told, jog) = (motion_event(&command), matches!(command, Manual::Jog { .. }));
    let accepted = app.station.manual(command).await?;
    // A jog is repeated many times a second: its beginning is what happened.
    if accepted.is_some() || !jog {
        let (target_mm, speed_mm_s) = (accepted.map(|to| to.target_mm), accepted.map(|to| to.speed_mm_s));
        let body = Motion { act: by.act(), target_mm, speed_mm_s };
        app.ledger.commit(vec![event("stage", told(body))]).await?;
    }
    Ok(accepted)
}

fn motion_event(command: &Manual) -> fn(Motion) -> Event {
    match command {
        Manual::Home => Event::StageHomed,
        Manual::Jog { .. } => Event::StageJogged,
        _ => Event::StageMoved,
    }
}

/// Shines with a share of full power while frames arrive; 0 goes dark.
///
/// # Errors
/// Who may not command the station, a laser that refuses.
pub async fn switch_laser(app: &App, by: &Principal, power: f64) -> Result<(), AppError> {
    if power > 0.0 {
        admit(app, by, Ask::Command)?;
    } else {
        in_control(app, by)?;
    }
    app.station.manual(Manual::Laser { power }).await?;
    let body = LaserSwitched { act: by.act(), power };
    app.ledger.commit(vec![event("laser", Event::LaserSwitched(body))]).await?;
    Ok(())
}

/// Starts or ends the live view.
///
/// # Errors
/// Who may not command the station, a device that refuses.
pub async fn set_live_view(app: &App, by: &Principal, wanted: LiveRequest) -> Result<(), AppError> {
    let LiveRequest { running, laser_power } = wanted;
    if running {
        admit(app, by, Ask::Command)?;
    } else {
        in_control(app, by)?;
    }
    app.station.live(wanted).await?;
    let body = LiveView { act: by.act(), laser_power };
    let told = if running { Event::LiveStarted(body) } else { Event::LiveEnded(body) };
    app.ledger.commit(vec![event("station", told)]).await?;
    Ok(())
}
