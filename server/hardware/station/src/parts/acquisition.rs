//! The camera as used by the station thread: reused buffers, and a count of every exposure.

use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::{Camera, CameraError, CameraRequest, CameraSettings, FrameInfo, PixelFormat, Trigger};
use vision::GreyImage;

use crate::params::{
    CAMERA_SILENCE, FRAME_TRANSFER, GRAB_WAIT, INCOMPLETE_PERIODS, PROBE_CAMERA, RENDERING_LIMIT, SILENT_PERIODS,
};
use crate::parts::exposures::{Delivered, Exposures};
use crate::shared::frame::SharedFrame;
use crate::shared::pool::{Pool, empty_image, pool};
use crate::shared::status::{DropCounts, Lost};

/// A frame in its own buffer, not yet stamped.
pub struct RawFrame {
    /// Unshared memory with the pixels.
    pub frame: SharedFrame,
    /// Time at which the driver delivered it.
    pub arrived_at: Instant,
    /// Metadata from the driver.
    pub info: FrameInfo,
    /// Exposures lost since the previous frame.
    pub lost: Lost,
}

/// Why a frame taken from the pool can be written.
pub const UNSHARED: &str = "a frame taken from the pool has no other owner";

/// The camera and the counts of its exposures.
pub struct Acquisition {
    device: Box<dyn Camera>,
    pool: Pool,
    spare: GreyImage,
    running: bool,
    exposures: Exposures,
    lost: Lost,
    totals: Arc<DropCounts>,
    received_at: Instant,
    requested_at: Instant,
    probed_at: Instant,
}

impl Acquisition {
    /// Wraps a camera that was just opened; losses are added to `totals`.
    pub fn new(device: Box<dyn Camera>, totals: Arc<DropCounts>) -> Self {
        let now = Instant::now();
        Self {
            device,
            pool: pool(),
            spare: empty_image(),
            running: false,
            exposures: Exposures::default(),
            lost: Lost::default(),
            totals,
            received_at: now,
            requested_at: now,
            probed_at: now,
        }
    }

    /// Longest time from the trigger to the frame.
    pub fn grab_limit(&self) -> Duration {
        exposure(&self.settings()) + GRAB_WAIT
    }

    /// Whether a simulated camera is still rendering a frame requested at `since`.
    pub fn is_computing(&self, since: Instant, now: Instant) -> bool {
        now.saturating_duration_since(since) < RENDERING_LIMIT && self.device.is_computing()
    }

    /// Time at which the next frame is due, if one is expected; its light is turned off soon after.
    pub fn frame_due(&self, now: Instant) -> Option<Instant> {
        if !self.expects_frames() {
            return None;
        }
        let settings = self.settings();
        let (since, period_s) = match settings.trigger {
            Trigger::Free => (self.received_at, 1.0 / settings.frame_rate_hz.max(SLOWEST_HZ)),
            Trigger::Software => (self.requested_at, 0.0),
            Trigger::Hardware => (self.received_at, 0.0),
        };
        let due = since + Duration::from_secs_f64(period_s) + exposure(&settings) + FRAME_TRANSFER;
        Some(if self.is_computing(since, now) { due.max(now) } else { due })
    }

    /// The underlying camera, for calls that do not concern frames.
    pub fn device(&mut self) -> &mut dyn Camera {
        &mut *self.device
    }

    pub fn settings(&self) -> CameraSettings {
        self.device.settings()
    }

    /// The buffers of its frames.
    pub fn pool(&mut self) -> &mut Pool {
        &mut self.pool
    }

    /// Whether frames may arrive.
    pub fn expects_frames(&self) -> bool {
        self.running && (self.settings().trigger != Trigger::Software || self.exposures.outstanding() > 0)
    }

    /// Applies settings. A change that is impossible during acquisition stops and restarts it.
    pub fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        let now = self.settings();
        let rebuilt = wanted.trigger.is_some_and(|t| t != now.trigger)
            || wanted.roi.is_some_and(|roi| roi != now.roi)
            || wanted.pixel_format.is_some_and(|format| format != now.pixel_format);
        if !(rebuilt && self.running) {
            return self.device.configure(wanted);
        }
        self.stop()?;
        let settings = self.device.configure(wanted);
        self.start()?;
        settings
    }

    /// Starts acquisition if it is not running.
    pub fn start(&mut self) -> Result<(), CameraError> {
        if !self.running {
            self.device.start()?;
            (self.running, self.exposures, self.lost) = (true, Exposures::default(), Lost::default());
            self.received_at = Instant::now();
        }
        Ok(())
    }

    /// Stops acquisition.
    pub fn stop(&mut self) -> Result<(), CameraError> {
        self.running = false;
        self.device.stop()
    }

    /// Triggers one exposure.
    pub fn trigger(&mut self) -> Result<(), CameraError> {
        self.device.trigger()?;
        self.exposures.request();
        self.requested_at = Instant::now();
        Ok(())
    }

    /// Counts requested exposures that did not arrive as lost.
    pub fn give_up(&mut self) {
        let camera = self.exposures.give_up();
        self.lose(Lost { camera, ..Lost::default() });
    }

    /// Waits at most `timeout` for the next frame.
    pub fn take(&mut self, timeout: Duration) -> Result<Option<RawFrame>, CameraError> {
        let taken = self.device.next_frame(&mut self.spare, timeout);
        let now = Instant::now();
        let info = match taken {
            Ok(None) => return Ok(None),
            Ok(Some(info)) => info,
            Err(error) => {
                if matches!(error, CameraError::WrongFrame { .. }) {
                    self.exposures.deliver(0);
                    self.lose(Lost { malformed: 1, ..Lost::default() });
                }
                // The exposures requested from a failed camera no longer arrive.
                self.give_up();
                return Err(error);
            }
        };
        self.received_at = now;
        let Delivered::InTime { newly_lost } = self.exposures.deliver(info.lost_before) else { return Ok(None) };
        let incomplete = info.lost_incomplete.min(newly_lost);
        self.lose(Lost { camera: newly_lost - incomplete, incomplete, ..Lost::default() });
        self.check_format()?;
        let Some(mut frame) = self.pool.take() else {
            self.lose(Lost { no_buffer: 1, ..Lost::default() });
            return Ok(None);
        };
        std::mem::swap(&mut Arc::get_mut(&mut frame).expect(UNSHARED).image, &mut self.spare);
        Ok(Some(RawFrame { frame, arrived_at: now, info, lost: std::mem::take(&mut self.lost) }))
    }

    /// Checks at intervals whether a camera that does not expose is still connected.
    pub fn probe(&mut self, now: Instant) -> Result<(), CameraError> {
        if now - self.probed_at < PROBE_CAMERA {
            return Ok(());
        }
        self.probe_now(now)
    }

    /// As [`Acquisition::probe`], without waiting for the next interval.
    pub fn probe_now(&mut self, now: Instant) -> Result<(), CameraError> {
        self.probed_at = now;
        self.device.next_frame(&mut self.spare, Duration::ZERO).map(drop)
    }

    /// Time since the last successful call.
    pub fn silent_for(&self) -> Duration {
        self.received_at.elapsed()
    }

    /// Number of incomplete frames since the last complete one.
    pub fn n_incomplete(&self) -> u64 {
        self.device.n_incomplete()
    }

    /// Time since a free-running camera last delivered a frame, if that exceeds the limit: a longer one while frames
    /// arrive incomplete.
    pub fn silence(&self, now: Instant) -> Option<Duration> {
        let settings = self.settings();
        if !self.running || settings.trigger != Trigger::Free {
            return None;
        }
        let periods = if self.n_incomplete() == 0 { SILENT_PERIODS } else { INCOMPLETE_PERIODS };
        let period_s = periods / settings.frame_rate_hz.max(1e-3) + settings.exposure_us * 1e-6;
        let limit = CAMERA_SILENCE.max(Duration::from_secs_f64(period_s));
        let silent = now.saturating_duration_since(self.received_at);
        (silent > limit && !self.is_computing(self.received_at, now)).then_some(silent)
    }

    fn lose(&mut self, lost: Lost) {
        self.lost.add(lost);
        lost.count_into(&self.totals);
    }

    fn check_format(&mut self) -> Result<(), CameraError> {
        let settings = self.settings();
        let (width_px, height_px) = (settings.roi.width_px, settings.roi.height_px);
        let (got_width_px, got_height_px) = (self.spare.width(), self.spare.height());
        let bits = if settings.pixel_format == PixelFormat::Mono8 { 8 } else { 16 };
        if (got_width_px, got_height_px) == (width_px, height_px) && self.spare.bit_depth() == bits {
            return Ok(());
        }
        self.lose(Lost { malformed: 1, ..Lost::default() });
        Err(CameraError::WrongFrame { width_px, height_px, got_width_px, got_height_px })
    }
}

/// Exposure time, limited to one minute.
fn exposure(settings: &CameraSettings) -> Duration {
    Duration::from_secs_f64((settings.exposure_us * 1e-6).clamp(0.0, 60.0))
}

/// Rate assumed for a free-running camera that reports none or a lower one: light waits at most a second for its
/// frames.
const SLOWEST_HZ: f64 = 1.0;
