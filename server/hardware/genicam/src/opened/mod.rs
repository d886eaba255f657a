//! An open camera: discovery, preparation, description and settings.

pub mod laser_line;

use std::thread;
use std::time::{Duration, Instant};

use devices::{
    CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, OpenError, PixelFormat, Roi,
    Trigger, ValueRange,
};

use crate::aravis::{AravisError, Device, Listed, list};
use crate::gvcp::{self, Control};
use crate::names;
use crate::pixels::SourceFormat;
use crate::settings::GenicamSettings;

/// Time after which a camera releases a silent program: the default heartbeat of the standard, plus a margin.
const HEARTBEAT_TIMEOUT: Duration = Duration::from_millis(3200);

/// Interval of queries for the controlling program.
const CONTROL_POLL_PERIOD: Duration = Duration::from_millis(200);

/// A camera controlled by this program.
pub struct OpenedCamera {
    pub device: Device,
    /// Where it was found.
    pub listed: Listed,
    /// Packet size; 0 without packets.
    pub packet_size_bytes: u32,
}

impl OpenedCamera {
    /// Opens the camera with the configured serial number and brings it to a known state: stopped, without triggers or
    /// automatic functions.
    ///
    /// `known`: where it was last found, which avoids the search.
    ///
    /// # Errors
    /// [`OpenError::Absent`] if it is absent or used by another program, [`OpenError::Settings`] if it cannot be
    /// prepared as configured.
    pub fn open(settings: &GenicamSettings, known: Option<&Listed>) -> Result<Self, OpenError> {
        let serial = &settings.serial;
        let absent = |(what, remedy): (String, &str)| OpenError::Absent {
            what: format!("the camera with serial number `{serial}` {what}"),
            remedy: remedy.to_owned(),
        };
        let (listed, device) = match known.map(|known| (known, Device::open(&known.address))) {
            Some((known, Ok(device))) if device.serial() == *serial => (known.clone(), device),
            _ => {
                let found = list();
                let Some(listed) = found.iter().find(|camera| camera.serial == *serial) else {
                    return Err(absent(not_found(&found)));
                };
                if let Some(Control::Held(controller)) = control_after_timeout(listed) {
                    return Err(absent(in_use(controller.map(|controller| controller.to_string()))));
                }
                let opened = Device::open(&listed.id).map_err(|error| {
                    let remedy = "check its address and that no other program uses it";
                    absent((format!("cannot be opened: {error}"), remedy))
                })?;
                (listed.clone(), opened)
            }
        };
        if !device.is_controlled() {
            return Err(absent(in_use(None)));
        }
        let packet_size_bytes =
            prepare(&device, settings, is_loopback(&listed.address)).map_err(|error| OpenError::Settings {
                what: format!("the camera with serial number `{serial}` cannot be prepared: {error}"),
                remedy: "check station.genicam".to_owned(),
            })?;
        Ok(Self { device, listed, packet_size_bytes })
    }

    /// Its identity.
    pub fn identity(&self) -> DeviceIdentity {
        let firmware = self.device.first(&names::FIRMWARE).and_then(|name| self.device.text(name).ok());
        DeviceIdentity {
            driver: "genicam",
            vendor: self.listed.vendor.clone(),
            model: self.listed.model.clone(),
            serial: self.listed.serial.clone(),
            firmware: firmware.unwrap_or_default(),
        }
    }

    /// Its capabilities after preparation.
    pub fn capabilities(&self) -> CameraCapabilities {
        let device = &self.device;
        let range = |feature: &[&'static str]| {
            let number = device.number(device.first(feature)?).ok()?;
            (number.min < number.max).then_some(ValueRange { min: number.min, max: number.max })
        };
        let side = |feature: &[&'static str], set: &str| {
            let whole = device.first(feature).unwrap_or(set);
            device.number(whole).map_or(0, |number| number.value as usize)
        };
        let (sources, lines) = (device.entries("TriggerSource"), self.lines());
        let mut triggers = vec![Trigger::Free];
        if sources.iter().any(|source| source == "Software") && device.has("TriggerSoftware") {
            triggers.push(Trigger::Software);
        }
        if !lines.is_empty() {
            triggers.push(Trigger::Hardware);
        }
        let offered = device.entries("PixelFormat");
        let format = |is_deep, format| SourceFormat::choose(&offered, is_deep, "").map(|_| format);
        CameraCapabilities {
            sensor_px: (side(&names::SENSOR_WIDTH, "Width"), side(&names::SENSOR_HEIGHT, "Height")),
            exposure_us: range(&names::EXPOSURE),
            gain_db: range(&names::GAIN),
            frame_rate_hz: range(&names::FRAME_RATE),
            triggers,
            pixel_formats: [format(false, PixelFormat::Mono8), format(true, PixelFormat::Mono16)]
                .into_iter()
                .flatten()
                .collect(),
            roi: device.has("OffsetX") && device.has("OffsetY"),
        }
    }

    /// Its settings as read back; `trigger` is the mode last set.
    pub fn settings(&self, trigger: Trigger) -> Result<CameraSettings, AravisError> {
        let device = &self.device;
        let value = |feature: &[&'static str]| match device.first(feature) {
            Some(name) => device.value(name),
            None => Ok(0.0),
        };
        let pixels = |feature: &str| device.value(feature).map(|value| value as usize);
        let offset = |feature: &str| if device.has(feature) { pixels(feature) } else { Ok(0) };
        Ok(CameraSettings {
            exposure_us: value(&names::EXPOSURE)?,
            gain_db: value(&names::GAIN)?,
            frame_rate_hz: value(&names::FRAME_RATE)?,
            trigger,
            pixel_format: match self.source_format()?.is_deep() {
                true => PixelFormat::Mono16,
                false => PixelFormat::Mono8,
            },
            roi: Roi {
                left_px: offset("OffsetX")?,
                top_px: offset("OffsetY")?,
                width_px: pixels("Width")?,
                height_px: pixels("Height")?,
            },
        })
    }

    /// Its current pixel format.
    pub fn source_format(&self) -> Result<SourceFormat, AravisError> {
        let code = self.device.pixel_format()?;
        SourceFormat::from_code(code).ok_or_else(|| {
            let name = self.device.text("PixelFormat").unwrap_or_else(|_| format!("{code:#010x}"));
            AravisError(format!("its pixel format {name} is not supported"))
        })
    }

    /// Applies settings in the order that cameras need: region, format, exposure, gain, rate, trigger last.
    pub fn set(
        &self,
        request: &CameraRequest,
        sensor_px: (usize, usize),
        settings: &GenicamSettings,
    ) -> Result<(), AravisError> {
        let device = &self.device;
        if let Some(roi) = request.roi {
            self.set_region(&within(roi, sensor_px))?;
        }
        if let Some(format) = request.pixel_format {
            choose_format(device, format == PixelFormat::Mono16, settings)?;
        }
        let set = |feature: &[&'static str], value: Option<f64>| match (device.first(feature), value) {
            (Some(name), Some(value)) => device.set_number(name, value),
            _ => Ok(()),
        };
        set(&names::EXPOSURE, request.exposure_us)?;
        set(&names::GAIN, request.gain_db)?;
        if let Some(trigger) = request.trigger {
            // The frame rate must not limit triggers; it is enabled again for free-running.
            self.limit_rate(trigger == Trigger::Free)?;
        }
        set(&names::FRAME_RATE, request.frame_rate_hz)?;
        request.trigger.map_or(Ok(()), |trigger| self.set_trigger(trigger, settings))
    }

    fn set_region(&self, roi: &Roi) -> Result<(), AravisError> {
        let pixels = |feature: &str, px: usize| match self.device.has(feature) {
            true => self.device.set_number(feature, px as f64),
            false => Ok(()),
        };
        // Offsets limit sizes, and vice versa.
        pixels("OffsetX", 0)?;
        pixels("OffsetY", 0)?;
        pixels("Width", roi.width_px)?;
        pixels("Height", roi.height_px)?;
        pixels("OffsetX", roi.left_px)?;
        pixels("OffsetY", roi.top_px)
    }

    fn limit_rate(&self, on: bool) -> Result<(), AravisError> {
        match self.device.first(&names::FRAME_RATE_ON) {
            Some(name) => self.device.set_flag(name, on),
            None => Ok(()),
        }
    }

    fn set_trigger(&self, trigger: Trigger, settings: &GenicamSettings) -> Result<(), AravisError> {
        let device = &self.device;
        device.clear_triggers()?;
        if trigger == Trigger::Free {
            return Ok(());
        }
        if device.has("TriggerSelector") {
            device.set_text("TriggerSelector", "FrameStart")?;
        }
        if trigger == Trigger::Software {
            device.set_text("TriggerSource", "Software")?;
        } else {
            let lines = self.lines();
            let line = match settings.trigger_line.as_str() {
                "" => lines.first().cloned(),
                named => lines.into_iter().find(|line| line == named),
            };
            let line = line.ok_or_else(|| AravisError(format!("no trigger line `{}`", settings.trigger_line)))?;
            device.set_text("TriggerSource", &line)?;
            if device.has("TriggerActivation") {
                device.set_text("TriggerActivation", settings.trigger_edge.name())?;
            }
            if let Some(delay) = device.first(&names::TRIGGER_DELAY) {
                device.set_number(delay, settings.trigger_delay_us)?;
            }
        }
        device.set_text("TriggerMode", "On")
    }

    /// Inputs usable as trigger.
    fn lines(&self) -> Vec<String> {
        let mut sources = self.device.entries("TriggerSource");
        sources.retain(|source| source.starts_with("Line"));
        sources
    }
}

/// Who controls a camera once the heartbeat of a terminated program would have timed out.
fn control_after_timeout(listed: &Listed) -> Option<Control> {
    let until = Instant::now() + HEARTBEAT_TIMEOUT;
    loop {
        let control = (listed.protocol == gvcp::PROTOCOL).then(|| gvcp::control(&listed.address)).flatten();
        if !matches!(control, Some(Control::Held(_))) || Instant::now() > until {
            return control;
        }
        thread::sleep(CONTROL_POLL_PERIOD);
    }
}

/// Converts errors of the library to those of a camera.
pub fn refused(setting: &'static str) -> impl Fn(AravisError) -> CameraError {
    move |error| CameraError::Unsupported {
        setting,
        value: "the requested value".to_owned(),
        expected: error.to_string(),
    }
}

fn prepare(device: &Device, settings: &GenicamSettings, loopback: bool) -> Result<u32, AravisError> {
    // A camera left running by a program keeps sending; one that does not run may refuse to stop.
    let _ = device.stop();
    device.clear_triggers()?;
    if device.has("AcquisitionMode") {
        device.set_text("AcquisitionMode", "Continuous")?;
    }
    for automatic in names::AUTOMATIC_FUNCTIONS.into_iter().filter(|name| device.has(name)) {
        device.set_text(automatic, "Off")?;
    }
    for binning in ["BinningHorizontal", "BinningVertical"] {
        if device.has(binning) {
            device.set_number(binning, f64::from(settings.binning))?;
        } else if settings.binning > 1 {
            return Err(AravisError(format!("it has no {binning}")));
        }
    }
    if !settings.laser_line.is_empty() {
        // A previous program may have left it on.
        laser_line::set_line(device, settings, false)?;
    }
    let offered = device.entries("PixelFormat");
    let is_deep = SourceFormat::choose(&offered, false, "").is_none();
    choose_format(device, is_deep, settings)?;
    // A socket that bypasses the network stack does not receive packets of this computer itself.
    device.negotiate_packet_size(Some(settings.packet_size_bytes).filter(|&bytes| bytes > 0), !loopback)
}

fn choose_format(device: &Device, is_deep: bool, settings: &GenicamSettings) -> Result<(), AravisError> {
    let offered = device.entries("PixelFormat");
    let preferred = if is_deep { &settings.format_16 } else { &settings.format_8 };
    match SourceFormat::choose(&offered, is_deep, preferred) {
        Some((_, name)) => device.set_text("PixelFormat", name),
        None => Err(AravisError(format!("none of its pixel formats is supported: {}", offered.join(", ")))),
    }
}

/// A region moved and cut to fit on the sensor.
fn within(roi: Roi, (columns, rows): (usize, usize)) -> Roi {
    let (left_px, top_px) = (roi.left_px.min(columns.saturating_sub(1)), roi.top_px.min(rows.saturating_sub(1)));
    Roi {
        left_px,
        top_px,
        width_px: roi.width_px.clamp(1, columns.saturating_sub(left_px).max(1)),
        height_px: roi.height_px.clamp(1, rows.saturating_sub(top_px).max(1)),
    }
}

fn is_loopback(address: &str) -> bool {
    address.parse().is_ok_and(|address: std::net::IpAddr| address.is_loopback())
}

fn in_use(controller: Option<String>) -> (String, &'static str) {
    let controller = controller.map_or_else(String::new, |controller| format!(" at {controller}"));
    (format!("is in use by another program{controller}"), "close that program, or reset the camera")
}

fn not_found(found: &[Listed]) -> (String, &'static str) {
    let found: Vec<&str> = found.iter().map(|camera| camera.serial.as_str()).collect();
    let others = if found.is_empty() { "none".to_owned() } else { found.join(", ") };
    let remedy = "check its cable, power and network address, then reset";
    (format!("does not respond (cameras that do: {others})"), remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_is_clamped_to_the_sensor() {
        let request = Roi { left_px: 90, top_px: 500, width_px: 50, height_px: 0 };
        assert_eq!(within(request, (100, 80)), Roi { left_px: 90, top_px: 79, width_px: 10, height_px: 1 });
    }
}
