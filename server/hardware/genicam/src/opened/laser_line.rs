//! The output line that switches a laser.

use crate::aravis::{AravisError, Device};
use crate::settings::GenicamSettings;

/// Prefix of the names of user outputs (SFNC `UserOutputSelector`).
pub const USER_OUTPUT: &str = "UserOutput";

/// Whether the line outputs the laser's signal, or is off, as read from the camera.
pub fn is_set(device: &Device, settings: &GenicamSettings, on: bool) -> bool {
    device.text("LineSelector").is_ok_and(|line| line == settings.laser_line)
        && device.text("LineSource").is_ok_and(|shown| shown == source(device, settings, on))
}

fn source(device: &Device, settings: &GenicamSettings, on: bool) -> String {
    if on { settings.laser_source.clone() } else { off_source(device, settings) }
}

/// Source of the line when the laser is off.
fn off_source(device: &Device, settings: &GenicamSettings) -> String {
    let sources = device.entries("LineSource");
    let off = sources.iter().find(|source| *source == "Off");
    let unused_output =
        || sources.iter().rfind(|source| source.starts_with(USER_OUTPUT) && **source != settings.laser_source);
    off.or_else(unused_output).unwrap_or(&settings.laser_source).clone()
}

/// Sets the line to the laser's signal, or to off.
///
/// # Errors
/// A feature that the camera lacks or refuses.
pub fn set_line(device: &Device, settings: &GenicamSettings, on: bool) -> Result<(), AravisError> {
    let source = source(device, settings, on);
    if !on && source == settings.laser_source && !source.starts_with(USER_OUTPUT) {
        return Err(AravisError(format!(
            "{} cannot be turned off: its only source is {source}",
            settings.laser_line
        )));
    }
    device.set_text("LineSelector", &settings.laser_line)?;
    if device.has("LineMode") && device.text("LineMode")? != "Output" {
        device.set_text("LineMode", "Output")?;
    }
    if device.has("LineInverter") {
        device.set_flag("LineInverter", settings.laser_inverted)?;
    } else if settings.laser_inverted {
        return Err(AravisError("it has no LineInverter".to_owned()));
    }
    if source.starts_with(USER_OUTPUT) {
        device.set_text("UserOutputSelector", &source)?;
        device.set_flag("UserOutputValue", on)?;
    }
    device.set_text("LineSource", &source)?;
    let shown = device.text("LineSource")?;
    match shown == source {
        true => Ok(()),
        false => Err(AravisError(format!("LineSource is {shown} instead of {source}"))),
    }
}
