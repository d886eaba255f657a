//! The output line that switches a laser.

use crate::aravis::{AravisError, Device};
use crate::settings::GenicamSettings;

/// Prefix of the names of user outputs.
pub const USER_OUTPUT: &str = "UserOutput";

/// Whether the line outputs the laser's signal, or is off, as read from the camera.
pub fn is_shown(device: &Device, settings: &GenicamSettings, lit: bool) -> bool {
    device.text("LineSelector").is_ok_and(|line| line == settings.laser_line)
        && device.text("LineSource").is_ok_and(|shown| shown == source(device, settings, lit))
}

fn source(device: &Device, settings: &GenicamSettings, lit: bool) -> String {
    if lit { settings.laser_source.clone() } else { dark_source(device, settings) }
}

/// Source of the line when the laser is off.
fn dark_source(device: &Device, settings: &GenicamSettings) -> String {
    let sources = device.entries("LineSource");
    let off = sources.iter().find(|source| *source == "Off");
    let at_rest =
        || sources.iter().rfind(|source| source.starts_with(USER_OUTPUT) && **source != settings.laser_source);
    off.or_else(at_rest).unwrap_or(&settings.laser_source).clone()
}

/// Sets the line to the laser's signal, or to off.
///
/// # Errors
/// A feature that the camera lacks or refuses.
pub fn show(device: &Device, settings: &GenicamSettings, lit: bool) -> Result<(), AravisError> {
    let source = source(device, settings, lit);
    if !lit && source == settings.laser_source && !source.starts_with(USER_OUTPUT) {
        return Err(AravisError(format!("{} cannot be turned off: it shows {source} only", settings.laser_line)));
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
        device.set_flag("UserOutputValue", lit)?;
    }
    device.set_text("LineSource", &source)?;
    let shown = device.text("LineSource")?;
    if shown == source { Ok(()) } else { Err(AravisError(format!("it shows {shown} where {source} was wanted"))) }
}
