//! The simulated camera: settings, acquisition, and frames from a small ring buffer.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use devices::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, FrameInfo,
    PixelFormat, Roi, Trigger, ValueRange,
};
use vision::{GreyImage, Pixels};

use crate::live::fault::TwinFault;
use crate::live::options::TwinOptions;
use crate::live::params::{
    BOARD_EXPOSURE_US, EXPOSURE_US, FRAME_RATE_AT_OPEN_HZ, FRAME_RATE_HZ, GAIN_DB, PENDING_TRIGGERS,
};
use crate::live::sensor_thread::{Finished, Run, Sensor};
use crate::live::world::SharedWorld;

/// The camera of a [`crate::live::TwinStation`]. Its sensor exposes and renders on its own thread.
pub struct TwinCamera {
    world: SharedWorld,
    sensor: Arc<Sensor>,
    sensor_px: (usize, usize),
    thread: Option<JoinHandle<()>>,
}

impl TwinCamera {
    pub(super) fn open(world: SharedWorld, options: &TwinOptions) -> Self {
        let model = world.lock().model.clone();
        let (width_px, height_px) = (model.camera.width_px, model.camera.height_px);
        let native = if model.shape.bits == 16 { PixelFormat::Mono16 } else { PixelFormat::Mono8 };
        let sensor = Arc::new(Sensor::new(
            world.clone(),
            options.timing,
            CameraSettings {
                exposure_us: BOARD_EXPOSURE_US,
                gain_db: 0.0,
                frame_rate_hz: FRAME_RATE_AT_OPEN_HZ,
                trigger: Trigger::Free,
                pixel_format: native,
                roi: Roi { left_px: 0, top_px: 0, width_px, height_px },
            },
        ));
        let thread = std::thread::Builder::new()
            .name("twin-sensor".to_owned())
            .spawn({
                let sensor = sensor.clone();
                move || sensor.run()
            })
            .ok();
        Self { world, sensor, sensor_px: (width_px, height_px), thread }
    }

    /// Detects an unplugged cable; the camera then stays disconnected until it is reconnected.
    fn check(&self) -> Result<(), CameraError> {
        let pulled = self.world.lock().has(TwinFault::CameraUnplugged);
        let mut state = self.sensor.lock();
        if pulled {
            state.gone = true;
            state.run = None;
        }
        if !state.gone {
            return Ok(());
        }
        Err(CameraError::Disconnected { reason: "its cable was unplugged".to_owned() })
    }

    fn triggers(&self) -> Vec<Trigger> {
        let belt = self.world.lock().belt_pitch_mm.map(|_| Trigger::Hardware);
        [Trigger::Free, Trigger::Software].into_iter().chain(belt).collect()
    }

    fn accepted(&self, wanted: &CameraRequest, now: &CameraSettings) -> Result<CameraSettings, CameraError> {
        let mut accepted = *now;
        for (setting, value, range, slot) in [
            ("exposure_us", wanted.exposure_us, EXPOSURE_US, &mut accepted.exposure_us),
            ("gain_db", wanted.gain_db, GAIN_DB, &mut accepted.gain_db),
            ("frame_rate_hz", wanted.frame_rate_hz, FRAME_RATE_HZ, &mut accepted.frame_rate_hz),
        ] {
            if let Some(value) = value {
                *slot = within(setting, value, range)?;
            }
        }
        if let Some(trigger) = wanted.trigger {
            if trigger == Trigger::Hardware && self.world.lock().belt_pitch_mm.is_none() {
                return Err(unsupported(
                    "trigger",
                    "hardware",
                    "only a belt triggers it; set it to free-running or software trigger",
                ));
            }
            accepted.trigger = trigger;
        }
        if let Some(format) = wanted.pixel_format {
            accepted.pixel_format = format;
        }
        if let Some(roi) = wanted.roi {
            accepted.roi = self.nearest_roi(roi);
        }
        Ok(accepted)
    }

    /// The region, moved and cropped to lie on the sensor.
    fn nearest_roi(&self, wanted: Roi) -> Roi {
        let (columns, rows) = self.sensor_px;
        let (width_px, height_px) = (wanted.width_px.clamp(1, columns), wanted.height_px.clamp(1, rows));
        Roi {
            left_px: wanted.left_px.min(columns - width_px),
            top_px: wanted.top_px.min(rows - height_px),
            width_px,
            height_px,
        }
    }
}

fn within(setting: &'static str, value: f64, range: ValueRange) -> Result<f64, CameraError> {
    if value.is_finite() {
        return Ok(range.clamp(value));
    }
    Err(unsupported(setting, &value.to_string(), &format!("give a number from {} to {}", range.min, range.max)))
}

fn unsupported(setting: &'static str, value: &str, expected: &str) -> CameraError {
    CameraError::Unsupported { setting, value: value.to_owned(), expected: expected.to_owned() }
}

impl Camera for TwinCamera {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            driver: "twin",
            vendor: "Sheaf".to_owned(),
            model: "simulated camera".to_owned(),
            serial: self.world.lock().model.seed.to_string(),
            firmware: String::new(),
        }
    }

    fn capabilities(&self) -> CameraCapabilities {
        CameraCapabilities {
            sensor_px: self.sensor_px,
            exposure_us: Some(EXPOSURE_US),
            gain_db: Some(GAIN_DB),
            frame_rate_hz: Some(FRAME_RATE_HZ),
            triggers: self.triggers(),
            pixel_formats: vec![PixelFormat::Mono8, PixelFormat::Mono16],
            roi: true,
        }
    }

    fn settings(&self) -> CameraSettings {
        self.sensor.lock().settings
    }

    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        self.check()?;
        let mut state = self.sensor.lock();
        let before = state.settings;
        let accepted = self.accepted(wanted, &before)?;
        state.settings = accepted;
        let reformed = accepted.roi != before.roi
            || accepted.pixel_format != before.pixel_format
            || accepted.trigger != before.trigger;
        if let (true, Some(run)) = (reformed, &mut state.run) {
            run.discard();
        }
        drop(state);
        self.sensor.wake();
        Ok(accepted)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.check()?;
        let mut state = self.sensor.lock();
        if state.run.is_none() {
            state.n_runs += 1;
            state.run = Some(Run::new(state.n_runs, Instant::now()));
        }
        drop(state);
        self.sensor.wake();
        Ok(())
    }

    fn trigger(&mut self) -> Result<(), CameraError> {
        self.check()?;
        let mut state = self.sensor.lock();
        let settings = state.settings;
        let refused = |reason| Err(CameraError::NotTriggerable { reason });
        let Some(run) = &mut state.run else { return refused("acquisition is not started; start it") };
        if settings.trigger != Trigger::Software {
            return refused("it runs freely; set the software trigger");
        }
        if run.pending.len() >= PENDING_TRIGGERS {
            return refused("earlier exposures are not read out yet; collect their frames");
        }
        self.sensor.expose(run, &settings);
        drop(state);
        self.sensor.wake();
        Ok(())
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        let deadline = Instant::now() + timeout;
        loop {
            self.check()?;
            let state = self.sensor.lock();
            let Some(mut state) = self.sensor.wait_for_frame(state, deadline) else { return Ok(None) };
            let Some(finished) = state.take_frame() else { continue };
            drop(state);
            let outcome = hand_over(&finished, image);
            self.sensor.recycle(finished.image);
            return outcome.map(Some);
        }
    }

    fn is_computing(&self) -> bool {
        let hangs = self.world.lock().has(TwinFault::CameraHang);
        !hangs && self.sensor.lock().is_computing(Instant::now())
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.sensor.lock().end_run();
        Ok(())
    }

    fn reconnect(&mut self) -> Result<(), CameraError> {
        let pulled = self.world.lock().has(TwinFault::CameraUnplugged);
        let mut state = self.sensor.lock();
        state.end_run();
        state.gone = pulled;
        Ok(())
    }
}

impl Drop for TwinCamera {
    fn drop(&mut self) {
        self.sensor.close();
        if let Some(thread) = self.thread.take() {
            // The panic of the sensor thread needs no further handling.
            let _ = thread.join();
        }
    }
}

/// Copies the region read out into the caller's memory.
fn hand_over(finished: &Finished, image: &mut GreyImage) -> Result<FrameInfo, CameraError> {
    let roi = finished.roi;
    if let Some((got_width_px, got_height_px)) = finished.wrong_px {
        let (width_px, height_px) = (roi.width_px, roi.height_px);
        return Err(CameraError::WrongFrame { width_px, height_px, got_width_px, got_height_px });
    }
    const SIDES: &str = "a region has at least one row and one column";
    match finished.image.pixels() {
        Pixels::Eight(from) => {
            let target = image.eight_mut(roi.width_px, roi.height_px).expect(SIDES);
            copy_region(from, finished.image.width(), roi, target);
        }
        Pixels::Sixteen(from) => {
            let target = image.sixteen_mut(roi.width_px, roi.height_px).expect(SIDES);
            copy_region(from, finished.image.width(), roi, target);
        }
    }
    Ok(finished.info)
}

fn copy_region<L: Copy>(from: &[L], width: usize, roi: Roi, target: &mut [L]) {
    for (row, line) in target.chunks_exact_mut(roi.width_px).enumerate() {
        let start = (roi.top_px + row) * width + roi.left_px;
        line.copy_from_slice(&from[start..start + roi.width_px]);
    }
}
