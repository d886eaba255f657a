//! An opened and prepared camera: its description and settings.

use std::io;

use devices::{
    CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, OpenError, PixelFormat, Roi,
    Trigger, ValueRange,
};

use crate::controls::{self, NotManual};
use crate::device::{Card, Format, Interval, Intervals, VideoDevice};
use crate::pixels::SourceFormat;
use crate::settings::V4l2Settings;

/// `ENODEV`: the camera was unplugged.
pub const ENODEV: i32 = 19;

/// `EBUSY`: another program streams from it.
const EBUSY: i32 = 16;

/// A camera under this program's control: stopped, all automatic functions off.
pub struct OpenedCamera {
    pub device: Box<dyn VideoDevice>,
    card: Card,
    /// Format of the images.
    pub format: Format,
    /// Conversion to grey.
    pub source: SourceFormat,
    intervals: Intervals,
    exposure_us: Option<ValueRange>,
    pixel_formats: Vec<PixelFormat>,
}

impl OpenedCamera {
    /// Prepares a camera whose device file was just opened.
    ///
    /// # Errors
    /// [`OpenError::Absent`] if another program uses it, [`OpenError::Settings`] if it is not a camera, supports no
    /// known format, or stays automatic.
    pub fn prepare(mut device: Box<dyn VideoDevice>, settings: &V4l2Settings) -> Result<Self, OpenError> {
        let errors = CameraErrors(&settings.device);
        let card = device.card().map_err(|error| errors.kernel("does not respond as a video device", error))?;
        if !card.streams {
            return Err(errors.settings("delivers no images", "choose a device that `sheaf devices` lists"));
        }
        let failed = |error| errors.kernel("does not report its capabilities", error);
        let offered = device.formats().map_err(failed)?;
        let in_depth = |is_deep, preferred| SourceFormat::choose(&offered, is_deep, preferred);
        let (eight, sixteen) = (in_depth(false, &settings.format_8), in_depth(true, &settings.format_16));
        let Some(source) = eight.or(sixteen) else {
            let names: Vec<String> = offered.iter().map(ToString::to_string).collect();
            let what = format!("offers no supported format: {}", names.join(", "));
            return Err(errors.settings(&what, "use a camera with GREY, YUYV, MJPG, Y16, Y12 or Y10"));
        };
        let size = match (settings.width_px, settings.height_px) {
            (0, _) | (_, 0) => {
                let sizes = device.sizes(source.code).map_err(failed)?;
                let largest = sizes.into_iter().max_by_key(|(width, height)| width * height);
                largest.ok_or_else(|| {
                    errors.settings("does not report its image sizes", "set width_px and height_px")
                })?
            }
            size => size,
        };
        let wanted = Format { pixels: source.code, width_px: size.0, height_px: size.1, row_bytes: 0 };
        let format = device.set_format(&wanted).map_err(|error| errors.kernel("cannot be set", error))?;
        if !is_same(&format, &wanted) {
            let what = format!(
                "sends {} with {}×{} pixels instead of {} with {}×{}",
                format.pixels, format.width_px, format.height_px, source.code, size.0, size.1
            );
            return Err(
                errors.settings(&what, "set station.v4l2 to a supported format: `v4l2-ctl --list-formats-ext`")
            );
        }
        controls::turn_off_automatic_functions(&mut *device).map_err(|error| errors.not_manual(error))?;
        controls::set_gain(&mut *device, settings.gain).map_err(|error| errors.not_manual(error))?;
        let exposure_us = controls::exposure_range(&*device).map_err(failed)?;
        let intervals = device.intervals(&format).map_err(failed)?;
        let is_offered = |source: &SourceFormat| {
            device.sizes(source.code).is_ok_and(|sizes| sizes.contains(&size)) || source.code == format.pixels
        };
        let pixel_formats = [(eight, PixelFormat::Mono8), (sixteen, PixelFormat::Mono16)]
            .into_iter()
            .filter_map(|(source, depth)| source.filter(is_offered).map(|_| depth))
            .collect();
        Ok(Self { device, card, format, source, intervals, exposure_us, pixel_formats })
    }

    /// Identity of the camera.
    pub fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            driver: "v4l2",
            vendor: String::new(),
            model: self.card.name.clone(),
            serial: self.card.bus.clone(),
            firmware: String::new(),
        }
    }

    /// Capabilities with the current format.
    pub fn capabilities(&self) -> CameraCapabilities {
        CameraCapabilities {
            sensor_px: (self.format.width_px, self.format.height_px),
            exposure_us: self.exposure_us,
            // The kernel's gain has no unit; it is set once, by the configuration.
            gain_db: None,
            frame_rate_hz: rates(&self.intervals),
            triggers: vec![Trigger::Free],
            pixel_formats: self.pixel_formats.clone(),
            roi: false,
        }
    }

    /// Settings as read from the camera.
    pub fn settings(&self) -> io::Result<CameraSettings> {
        let depth = if self.source.is_deep() { PixelFormat::Mono16 } else { PixelFormat::Mono8 };
        Ok(CameraSettings {
            exposure_us: controls::exposure_us(&*self.device)?,
            gain_db: 0.0,
            frame_rate_hz: self.device.interval()?.map_or(0.0, Interval::rate_hz),
            trigger: Trigger::Free,
            pixel_format: depth,
            roi: Roi { left_px: 0, top_px: 0, width_px: self.format.width_px, height_px: self.format.height_px },
        })
    }

    /// Whether the request requires a stop of streaming: format and interval, if they differ from `now`.
    pub fn needs_stop(now: &CameraSettings, wanted: &CameraRequest) -> bool {
        wanted.pixel_format.is_some_and(|format| format != now.pixel_format)
            || wanted.frame_rate_hz.is_some_and(|rate_hz| rate_hz != now.frame_rate_hz)
    }

    /// Applies a request that is within the capabilities.
    pub fn set(&mut self, wanted: &CameraRequest, settings: &V4l2Settings) -> io::Result<()> {
        if let Some(depth) = wanted.pixel_format {
            self.set_depth(depth == PixelFormat::Mono16, settings)?;
        }
        if let Some(interval) = wanted.frame_rate_hz.and_then(|rate_hz| nearest(&self.intervals, rate_hz)) {
            self.device.set_interval(interval)?;
        }
        match wanted.exposure_us {
            Some(exposure_us) => controls::set_exposure(&mut *self.device, exposure_us),
            None => Ok(()),
        }
    }

    fn set_depth(&mut self, is_deep: bool, settings: &V4l2Settings) -> io::Result<()> {
        if self.source.is_deep() == is_deep {
            return Ok(());
        }
        let preferred = if is_deep { &settings.format_16 } else { &settings.format_8 };
        let chosen = SourceFormat::choose(&self.device.formats()?, is_deep, preferred);
        let source = chosen.ok_or(io::ErrorKind::Unsupported)?;
        // A new format resets the frame interval; the previous one is set again.
        let interval = self.device.interval()?;
        let wanted = Format { pixels: source.code, row_bytes: 0, ..self.format };
        let format = self.device.set_format(&wanted)?;
        if !is_same(&format, &wanted) {
            self.device.set_format(&self.format)?;
            return Err(io::Error::other(format!("it sends {} instead of {}", format.pixels, source.code)));
        }
        (self.format, self.source) = (format, source);
        if let Some(interval) = interval {
            self.device.set_interval(interval)?;
        }
        Ok(())
    }
}

fn is_same(format: &Format, wanted: &Format) -> bool {
    (format.pixels, format.width_px, format.height_px) == (wanted.pixels, wanted.width_px, wanted.height_px)
}

/// Frame rates from the slowest to the fastest.
fn rates(intervals: &Intervals) -> Option<ValueRange> {
    let rates: Vec<f64> = match intervals {
        Intervals::Discrete(intervals) => intervals.iter().map(|interval| interval.rate_hz()).collect(),
        Intervals::Between(shortest, longest) => vec![shortest.rate_hz(), longest.rate_hz()],
    };
    let min = rates.iter().copied().min_by(f64::total_cmp)?;
    let max = rates.iter().copied().max_by(f64::total_cmp)?;
    Some(ValueRange { min, max })
}

/// The interval whose rate is nearest to the requested one.
fn nearest(intervals: &Intervals, rate_hz: f64) -> Option<Interval> {
    match intervals {
        Intervals::Discrete(intervals) => {
            let off = |interval: &&Interval| (interval.rate_hz() - rate_hz).abs();
            intervals.iter().min_by(|a, b| off(a).total_cmp(&off(b))).copied()
        }
        Intervals::Between(shortest, longest) => {
            if rate_hz >= shortest.rate_hz() {
                Some(*shortest)
            } else if rate_hz <= longest.rate_hz() {
                Some(*longest)
            } else {
                // In tenths of a microsecond, the unit of UVC.
                Some(Interval { numerator: (1e7 / rate_hz).round() as u32, denominator: 10_000_000 })
            }
        }
    }
}

/// Errors of the camera with this device file.
struct CameraErrors<'d>(&'d str);

impl CameraErrors<'_> {
    fn settings(&self, what: &str, remedy: &str) -> OpenError {
        OpenError::Settings { what: format!("the camera {} {what}", self.0), remedy: remedy.to_owned() }
    }

    fn absent(&self, what: &str, remedy: &str) -> OpenError {
        OpenError::Absent { what: format!("the camera {} {what}", self.0), remedy: remedy.to_owned() }
    }

    fn kernel(&self, what: &str, error: io::Error) -> OpenError {
        match error.raw_os_error() {
            Some(EBUSY) => self.absent("is in use by another program", "close that program"),
            Some(ENODEV) => self.absent("was unplugged", "plug it in, then reset"),
            _ => self.settings(&format!("{what}: {error}"), "choose a device that `sheaf devices` lists"),
        }
    }

    fn not_manual(&self, error: NotManual) -> OpenError {
        match error {
            NotManual::StaysAutomatic(what) => self.settings(
                &format!("does not allow its {what} to be set"),
                "use a camera that can be set manually",
            ),
            NotManual::Refused(what, error) => self.kernel(&format!("refuses to set its {what}"), error),
        }
    }
}

/// Why a device file cannot be opened.
pub fn not_opened(device: &str, error: &io::Error) -> OpenError {
    let errors = CameraErrors(device);
    match error.kind() {
        io::ErrorKind::NotFound => errors.absent("was not found", "check its cable, then reset"),
        io::ErrorKind::PermissionDenied => errors.settings(
            "may not be opened by this program's user",
            "add that user to the group `video`, then restart",
        ),
        _ if error.raw_os_error() == Some(ENODEV) => errors.absent("was not found", "check its cable, then reset"),
        _ => errors.settings(&format!("cannot be opened: {error}"), "choose a device that `sheaf devices` lists"),
    }
}

/// Converts a kernel error to a camera error.
pub fn refused(setting: &'static str, error: io::Error) -> CameraError {
    if error.raw_os_error() == Some(ENODEV) {
        return CameraError::Disconnected { reason: "it was unplugged".to_owned() };
    }
    CameraError::Unsupported { setting, value: "the requested value".to_owned(), expected: error.to_string() }
}
