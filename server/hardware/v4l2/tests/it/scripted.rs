//! A scripted device that behaves like a UVC camera under Linux.

use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use devices::OpenError;
use v4l2::camera::Open;
use v4l2::device::{Card, Control, ControlId, Filled, Format, FourCc, Interval, Intervals, Stamped, VideoDevice};
use v4l2::{V4l2Camera, V4l2Settings};

/// Errors of the kernel, by its numbers.
pub const ENODEV: i32 = 19;
pub const EBUSY: i32 = 16;
pub const ERANGE: i32 = 34;

/// Controls by the kernel's numbers.
pub const EXPOSURE_AUTO: ControlId = ControlId(0x009A_0901);
pub const EXPOSURE: ControlId = ControlId(0x009A_0902);
pub const GAIN: ControlId = ControlId(0x0098_0913);
pub const AUTO_WHITE_BALANCE: ControlId = ControlId(0x0098_090C);

/// Frame intervals of the camera: 30, 15 and 5 Hz, and one faster than real time for tests that need only frames.
const RATES_HZ: [u32; 4] = [200, 30, 15, 5];

/// Flaws of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Flaw {
    /// Lost frames before it.
    pub lost_before: u32,
    /// Marked by the driver as damaged.
    pub is_marked: bool,
    /// Bytes missing at its end.
    pub missing_bytes: usize,
}

/// The camera at the other end of the cable. It keeps its settings when programs close it, and loses them with its
/// power, as UVC cameras do.
pub struct Scripted {
    pub is_plugged: bool,
    pub is_busy: bool,
    pub controls: BTreeMap<u32, Control>,
    /// Controls whose value cannot be changed.
    pub fixed: Vec<ControlId>,
    pub format: Format,
    pub interval: Interval,
    /// The driver's number of the next frame.
    pub sequence: u32,
    pub stamped: Stamped,
    /// Flaws of the coming frames, the next one first.
    pub flaws: Vec<Flaw>,
    /// Start of the acquisition and its number of frames; `None` while not streaming.
    pub streaming: Option<(Instant, u32)>,
    /// Time stamps of the delivered frames.
    pub stamps: Vec<Instant>,
    /// Numbers of the controls in the order in which they were set.
    pub set: Vec<ControlId>,
}

impl Default for Scripted {
    fn default() -> Self {
        let control = |min, max, step, value| Control { min, max, step, value };
        Self {
            is_plugged: true,
            is_busy: false,
            controls: BTreeMap::from([
                // Factory settings: aperture priority, 15.6 ms, some gain, automatic white balance.
                (EXPOSURE_AUTO.0, control(0, 3, 1, 3)),
                (EXPOSURE.0, control(1, 5000, 1, 156)),
                (GAIN.0, control(4, 255, 1, 64)),
                (AUTO_WHITE_BALANCE.0, control(0, 1, 1, 1)),
            ]),
            fixed: Vec::new(),
            format: Format { pixels: FourCc(*b"MJPG"), width_px: 640, height_px: 480, row_bytes: 0 },
            interval: Interval { numerator: 1, denominator: 30 },
            sequence: 0,
            stamped: Stamped::ExposureStart,
            flaws: Vec::new(),
            streaming: None,
            stamps: Vec::new(),
            set: Vec::new(),
        }
    }
}

/// Both ends of the cable.
#[derive(Clone, Default)]
pub struct Bench(Arc<Mutex<Scripted>>);

impl Bench {
    pub fn camera(&self) -> MutexGuard<'_, Scripted> {
        self.0.lock().unwrap()
    }

    /// Opens the camera as the driver does.
    pub fn open(&self, settings: &V4l2Settings) -> Result<V4l2Camera, OpenError> {
        let bench = self.clone();
        let open: Open = Box::new(move || {
            if !bench.camera().is_plugged {
                return Err(io::ErrorKind::NotFound.into());
            }
            Ok(Box::new(Handle { bench: bench.clone(), is_stale: false }))
        });
        V4l2Camera::open(settings, open)
    }

    /// Unplugs the cable: settings are lost, and open handles become invalid.
    pub fn unplug(&self) {
        *self.camera() = Scripted { is_plugged: false, ..Scripted::default() };
    }

    pub fn replug(&self) {
        self.camera().is_plugged = true;
    }
}

/// Settings that name the camera, with small images.
pub fn settings() -> V4l2Settings {
    V4l2Settings { device: "/dev/video0".to_owned(), width_px: 64, height_px: 48, ..V4l2Settings::default() }
}

struct Handle {
    bench: Bench,
    /// The camera was unplugged since it was opened.
    is_stale: bool,
}

fn kernel(code: i32) -> io::Error {
    io::Error::from_raw_os_error(code)
}

impl Handle {
    fn camera(&self) -> io::Result<MutexGuard<'_, Scripted>> {
        let camera = self.bench.camera();
        if self.is_stale || !camera.is_plugged { Err(kernel(ENODEV)) } else { Ok(camera) }
    }
}

impl VideoDevice for Handle {
    fn card(&self) -> io::Result<Card> {
        drop(self.camera()?);
        let text = str::to_owned;
        Ok(Card { driver: text("uvcvideo"), name: text("Scripted"), bus: text("usb-1"), streams: true })
    }

    fn formats(&self) -> io::Result<Vec<FourCc>> {
        drop(self.camera()?);
        Ok([*b"MJPG", *b"YUYV", *b"Y10 "].map(FourCc).to_vec())
    }

    fn sizes(&self, _pixels: FourCc) -> io::Result<Vec<(usize, usize)>> {
        drop(self.camera()?);
        Ok(vec![(640, 480), (64, 48), (1280, 720)])
    }

    fn intervals(&self, _format: &Format) -> io::Result<Intervals> {
        drop(self.camera()?);
        let interval = |denominator| Interval { numerator: 1, denominator };
        Ok(Intervals::Discrete(RATES_HZ.map(interval).to_vec()))
    }

    fn set_format(&mut self, wanted: &Format) -> io::Result<Format> {
        let mut camera = self.camera()?;
        if camera.is_busy || camera.streaming.is_some() {
            return Err(kernel(EBUSY));
        }
        let is_known = self.sizes_offered().contains(&(wanted.width_px, wanted.height_px));
        let (width_px, height_px) = if is_known { (wanted.width_px, wanted.height_px) } else { (640, 480) };
        let row_bytes = if wanted.pixels == FourCc(*b"MJPG") { 0 } else { 2 * width_px };
        camera.format = Format { width_px, height_px, row_bytes, ..*wanted };
        // As in UVC, a format resets the interval.
        camera.interval = Interval { numerator: 1, denominator: 30 };
        Ok(camera.format)
    }

    fn interval(&self) -> io::Result<Option<Interval>> {
        Ok(Some(self.camera()?.interval))
    }

    fn set_interval(&mut self, wanted: Interval) -> io::Result<Interval> {
        let mut camera = self.camera()?;
        if camera.streaming.is_some() {
            return Err(kernel(EBUSY));
        }
        camera.interval = wanted;
        Ok(wanted)
    }

    fn control(&self, id: ControlId) -> io::Result<Option<Control>> {
        Ok(self.camera()?.controls.get(&id.0).copied())
    }

    fn set_control(&mut self, id: ControlId, value: i32) -> io::Result<()> {
        let mut camera = self.camera()?;
        camera.set.push(id);
        let is_fixed = camera.fixed.contains(&id);
        // As in UVC, the exposure cannot be set while it is automatic.
        let is_locked = id == EXPOSURE && camera.controls[&EXPOSURE_AUTO.0].value != 1;
        let control = camera.controls.get_mut(&id.0).ok_or_else(|| kernel(ERANGE))?;
        if is_locked || !(control.min..=control.max).contains(&value) {
            return Err(kernel(ERANGE));
        }
        if !is_fixed {
            control.value = value;
        }
        Ok(())
    }

    fn start(&mut self, _n_buffers: u32) -> io::Result<()> {
        let mut camera = self.camera()?;
        if camera.is_busy {
            return Err(kernel(EBUSY));
        }
        camera.streaming = Some((Instant::now(), 0));
        Ok(())
    }

    fn take(&mut self, timeout: Duration, use_frame: &mut dyn FnMut(&Filled)) -> io::Result<bool> {
        let due = {
            let camera = self.camera()?;
            let Some((began, n_frames)) = camera.streaming else { return Err(kernel(22)) };
            began + Duration::from_secs_f64(f64::from(n_frames + 1) / camera.interval.rate_hz())
        };
        let wait = due.saturating_duration_since(Instant::now());
        std::thread::sleep(wait.min(timeout));
        if wait > timeout {
            return Ok(false);
        }
        let mut camera = self.camera()?;
        let Some((_, n_frames)) = &mut camera.streaming else { return Err(kernel(22)) };
        *n_frames += 1;
        let flaw = if camera.flaws.is_empty() { Flaw::default() } else { camera.flaws.remove(0) };
        let sequence = camera.sequence.wrapping_add(flaw.lost_before);
        camera.sequence = sequence.wrapping_add(1);
        let exposure = Duration::from_micros(100 * camera.controls[&EXPOSURE.0].value as u64);
        let stamped_at = match camera.stamped {
            Stamped::ExposureStart => due.checked_sub(exposure).unwrap(),
            Stamped::FrameEnd => due,
        };
        camera.stamps.push(stamped_at);
        let bytes = image_bytes(&camera.format, sequence);
        let stamped = camera.stamped;
        drop(camera);
        use_frame(&Filled {
            bytes: &bytes[..bytes.len() - flaw.missing_bytes],
            sequence,
            stamped_at: Some(stamped_at),
            stamped,
            is_damaged: flaw.is_marked,
        });
        Ok(true)
    }

    fn stop(&mut self) -> io::Result<()> {
        let mut camera = self.camera()?;
        camera.streaming = None;
        camera.sequence = 0;
        Ok(())
    }
}

impl Handle {
    fn sizes_offered(&self) -> [(usize, usize); 3] {
        [(640, 480), (64, 48), (1280, 720)]
    }
}

/// Grey level of a frame, which distinguishes successive frames.
pub fn level(sequence: u32) -> u8 {
    (sequence % 200) as u8 + 20
}

/// An image of one grey level.
fn image_bytes(format: &Format, sequence: u32) -> Vec<u8> {
    let (n_pixels, level) = (format.width_px * format.height_px, level(sequence));
    match &format.pixels.0 {
        b"MJPG" => {
            let mut bytes = Vec::new();
            let encoder = jpeg_encoder::Encoder::new(&mut bytes, 90);
            let (width, height) = (format.width_px as u16, format.height_px as u16);
            encoder.encode(&vec![level; n_pixels], width, height, jpeg_encoder::ColorType::Luma).unwrap();
            bytes
        }
        b"YUYV" => [level, 128].repeat(n_pixels),
        b"Y10 " => (u16::from(level) << 2).to_le_bytes().repeat(n_pixels),
        other => panic!("no image in {other:?}"),
    }
}
