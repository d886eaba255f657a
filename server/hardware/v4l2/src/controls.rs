//! The controls that determine the pixel values: automatic functions off, exposure and gain manual, all read back.

use std::io;

use devices::ValueRange;

use crate::device::{Control, ControlId, VideoDevice};

/// `V4L2_CID_EXPOSURE_AUTO`: 1 is manual.
pub const EXPOSURE_AUTO: ControlId = ControlId(0x009A_0901);

/// `V4L2_CID_EXPOSURE_ABSOLUTE`, in [`EXPOSURE_UNIT_US`].
pub const EXPOSURE: ControlId = ControlId(0x009A_0902);

/// `V4L2_CID_GAIN`, in the camera's own unit.
pub const GAIN: ControlId = ControlId(0x0098_0913);

/// Unit of [`EXPOSURE`], µs: fixed by the kernel's interface.
pub const EXPOSURE_UNIT_US: f64 = 100.0;

/// `V4L2_EXPOSURE_MANUAL`.
const EXPOSURE_MANUAL: i32 = 1;

/// Automatic functions, with the value that turns them off, in the order in which they are set: some cameras accept the
/// later ones only after the earlier.
const AUTOMATIC_FUNCTIONS: [(&str, ControlId, i32); 8] = [
    ("automatic exposure", EXPOSURE_AUTO, EXPOSURE_MANUAL),
    // V4L2_CID_EXPOSURE_AUTO_PRIORITY: a longer exposure may lower the frame rate.
    ("dynamic frame rate", ControlId(0x009A_0903), 0),
    // V4L2_CID_AUTOGAIN
    ("automatic gain", ControlId(0x0098_0912), 0),
    // V4L2_CID_AUTO_WHITE_BALANCE: it changes the luma, too.
    ("automatic white balance", ControlId(0x0098_090C), 0),
    // V4L2_CID_BACKLIGHT_COMPENSATION: it changes the exposure.
    ("backlight compensation", ControlId(0x0098_091C), 0),
    // V4L2_CID_POWER_LINE_FREQUENCY: it rounds the exposure to that of the mains.
    ("power line frequency filter", ControlId(0x0098_0918), 0),
    // V4L2_CID_FOCUS_AUTO: it moves the lens, and with it the calibration.
    ("automatic focus", ControlId(0x009A_090C), 0),
    // V4L2_CID_IMAGE_STABILIZATION: it moves the image.
    ("image stabilisation", ControlId(0x009A_0916), 0),
];

/// Why a camera cannot be set manually.
#[derive(Debug)]
pub enum NotManual {
    /// This function stays automatic.
    StaysAutomatic(&'static str),
    /// The kernel refused.
    Refused(&'static str, io::Error),
}

/// Turns off all automatic functions of the camera, and reads back that they are off.
pub fn turn_off_automatic_functions(device: &mut dyn VideoDevice) -> Result<(), NotManual> {
    for (name, id, off) in AUTOMATIC_FUNCTIONS {
        let refused = |error| NotManual::Refused(name, error);
        let Some(control) = device.control(id).map_err(refused)? else { continue };
        if control.value == off {
            continue;
        }
        device.set_control(id, off).map_err(refused)?;
        if device.control(id).map_err(refused)?.is_none_or(|control| control.value != off) {
            return Err(NotManual::StaysAutomatic(name));
        }
    }
    Ok(())
}

/// Range of exposure times, µs; `None` if it cannot be set.
pub fn exposure_range(device: &dyn VideoDevice) -> io::Result<Option<ValueRange>> {
    let in_us = |value: i32| f64::from(value) * EXPOSURE_UNIT_US;
    Ok(device.control(EXPOSURE)?.map(|control| ValueRange { min: in_us(control.min), max: in_us(control.max) }))
}

/// The current exposure time, µs; 0 if the camera does not report it.
pub fn exposure_us(device: &dyn VideoDevice) -> io::Result<f64> {
    Ok(device.control(EXPOSURE)?.map_or(0.0, |control| f64::from(control.value) * EXPOSURE_UNIT_US))
}

/// Sets the nearest exposure time that the camera supports.
pub fn set_exposure(device: &mut dyn VideoDevice, exposure_us: f64) -> io::Result<()> {
    match device.control(EXPOSURE)? {
        Some(control) => device.set_control(EXPOSURE, nearest(control, exposure_us / EXPOSURE_UNIT_US)),
        None => Ok(()),
    }
}

/// Sets the gain, clamped to its range, and reads it back; a camera without gain is left unchanged.
pub fn set_gain(device: &mut dyn VideoDevice, gain: i32) -> Result<(), NotManual> {
    let refused = |error| NotManual::Refused("gain", error);
    let Some(control) = device.control(GAIN).map_err(refused)? else { return Ok(()) };
    let wanted = nearest(control, f64::from(gain));
    device.set_control(GAIN, wanted).map_err(refused)?;
    let is_set = device.control(GAIN).map_err(refused)?.is_some_and(|control| control.value == wanted);
    if is_set { Ok(()) } else { Err(NotManual::StaysAutomatic("gain")) }
}

/// The value nearest to `wanted` on the control's steps and in its range.
fn nearest(control: Control, wanted: f64) -> i32 {
    let step = f64::from(control.step.max(1));
    let (min, max) = (f64::from(control.min), f64::from(control.max));
    let n_steps = ((wanted.clamp(min, max) - min) / step).round().min(((max - min) / step).floor());
    (min + n_steps * step) as i32
}

/// All controls used here, by their names in the kernel's header.
#[cfg(all(test, feature = "kernel"))]
pub fn ids() -> Vec<(&'static str, ControlId)> {
    let automatics = [
        "V4L2_CID_EXPOSURE_AUTO",
        "V4L2_CID_EXPOSURE_AUTO_PRIORITY",
        "V4L2_CID_AUTOGAIN",
        "V4L2_CID_AUTO_WHITE_BALANCE",
        "V4L2_CID_BACKLIGHT_COMPENSATION",
        "V4L2_CID_POWER_LINE_FREQUENCY",
        "V4L2_CID_FOCUS_AUTO",
        "V4L2_CID_IMAGE_STABILIZATION",
    ];
    let manual = [("V4L2_CID_EXPOSURE_ABSOLUTE", EXPOSURE), ("V4L2_CID_GAIN", GAIN)];
    automatics.into_iter().zip(AUTOMATIC_FUNCTIONS.map(|(_, id, _)| id)).chain(manual).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_clamped_to_its_range_and_rounded_to_its_step() {
        let control = Control { min: 3, max: 20, step: 5, value: 3 };
        for (wanted, set) in [(-7.0, 3), (3.0, 3), (5.4, 3), (5.6, 8), (14.0, 13), (1e9, 18)] {
            assert_eq!(nearest(control, wanted), set, "{wanted}");
        }
        let fine = Control { min: 1, max: 5000, step: 1, value: 1 };
        assert_eq!(nearest(fine, 156.4), 156);
    }
}
