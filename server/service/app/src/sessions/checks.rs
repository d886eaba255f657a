//! Checks of a session's settings before they are stored, and of a request before an image is captured.

use capture::Projector;
use optics::{StageKind, StagePosition};
use remedy::Remedy as _;
use station::StationStatus;

use crate::error::{AppError, ErrorKind};
use crate::resources::scan_run::stage_kind;
use crate::sessions::image_capture::Exposures;
use crate::sessions::{PICTURE_LIMIT, SessionBody};

/// Basic checks of target and projector, reported at once; the rules of the manifest apply when the session is solved.
pub(super) fn check_new(body: &SessionBody) -> Result<(), AppError> {
    let impossible = |what: &str, remedy: &str, place: &str| {
        Err(AppError::new(ErrorKind::Impossible, what.to_owned()).remedy(remedy).at(place))
    };
    body.target.check().map_err(|error| {
        let place = format!("/target/{}", error.entry());
        AppError::from(error).at(place)
    })?;
    body.projector.check().map_err(|error| {
        let place = format!("/projector/{}", error.entry);
        AppError::new(ErrorKind::Impossible, error.to_string())
            .remedy(error.remedy().unwrap_or_default())
            .at(place)
    })?;
    if body.projector.switched_lines().is_some() || matches!(body.projector, Projector::Cross(_)) {
        return impossible(
            "a station searches its images for lines along one direction that are on together",
            "calibrate lines that cross, or that are switched on one by one, from a capture",
            "/projector/kind",
        );
    }
    check_exposures(&body.exposures, "/exposures")
}

/// Checks exposure settings at a place of the input.
pub(super) fn check_exposures(exposures: &Exposures, place: &str) -> Result<(), AppError> {
    let Exposures { board_exposure_us, laser_exposure_us, laser_power, background_above_levels } = *exposures;
    let entry = if !(board_exposure_us > 0.0 && board_exposure_us.is_finite()) {
        "board_exposure_us"
    } else if !(laser_exposure_us > 0.0 && laser_exposure_us.is_finite()) {
        "laser_exposure_us"
    } else if !(laser_power > 0.0 && laser_power <= 1.0) {
        "laser_power"
    } else if background_above_levels.is_some_and(|levels| !(0.0..=255.0).contains(&levels)) {
        "background_above_levels"
    } else {
        return Ok(());
    };
    let remedy = match entry {
        "laser_power" => "give a fraction above 0 and at most 1",
        "background_above_levels" => "give 0 to 255 grey levels, or null to subtract no ambient light",
        _ => "give microseconds above 0",
    };
    Err(AppError::new(ErrorKind::Impossible, format!("{entry} is out of range"))
        .remedy(remedy)
        .at(format!("{place}/{entry}")))
}

/// Checks that the position matches the station's kind of stage.
pub(super) fn check_kind(position: StagePosition, status: &StationStatus) -> Result<(), AppError> {
    let (is, wanted) = match (stage_kind(status), position) {
        (StageKind::Linear, StagePosition::RotaryDeg(_)) => ("travels", "position_mm"),
        (StageKind::Rotary, StagePosition::LinearMm(_)) => ("turns", "angle_deg"),
        _ => return Ok(()),
    };
    Err(AppError::new(ErrorKind::Impossible, format!("{position} is given, but the station's stage {is}"))
        .remedy(format!("give {wanted}")))
}

pub(super) fn check_room(body: &SessionBody) -> Result<(), AppError> {
    if body.poses.len() * 2 + body.stage_views.len() < PICTURE_LIMIT {
        return Ok(());
    }
    Err(AppError::new(ErrorKind::Impossible, format!("a session can have at most {PICTURE_LIMIT} images"))
        .remedy("delete some, or solve it"))
}
