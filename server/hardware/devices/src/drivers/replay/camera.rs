//! The camera of a replay.

use parking_lot::Mutex;
use std::sync::Arc;
use std::time::{Duration, Instant};

use vision::GreyImage;

use super::playback::{Playback, lock};
use super::sequence::Recording;
use super::{Pace, RATES_HZ, ReplayConfig};
use crate::params::REPLAY_CATCH_UP;
use crate::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, FrameInfo, Roi,
    Trigger,
};

/// Delivers the images of a capture folder or a recording.
pub struct ReplayCamera {
    recording: Recording,
    playback: Arc<Mutex<Playback>>,
    pace: Pace,
    repeat: bool,
    trigger: Trigger,
    run: Option<Run>,
}

/// A started acquisition.
#[derive(Debug)]
struct Run {
    /// The next frame; `None` after the last.
    next_idx: Option<usize>,
    /// Whether frames are played in reverse order.
    backwards: bool,
    /// The next frame's number.
    next_id: u64,
    /// Frames that could not be read since the last frame delivered.
    lost: u64,
    /// When the next frame is due.
    due_at: Instant,
    /// Software triggers not yet answered.
    n_triggers: usize,
}

impl ReplayCamera {
    pub(super) fn new(recording: Recording, config: &ReplayConfig, playback: Arc<Mutex<Playback>>) -> Self {
        Self { recording, playback, pace: config.pace, repeat: config.repeat, trigger: Trigger::Free, run: None }
    }

    fn whole(&self) -> Roi {
        let (width_px, height_px) = self.recording.size_px();
        Roi { left_px: 0, top_px: 0, width_px, height_px }
    }

    /// Refuses settings that a recording does not support.
    fn check(&self, wanted: &CameraRequest) -> Result<(), CameraError> {
        let fixed = "the recording's own";
        if let Some(exposure_us) = wanted.exposure_us {
            return Err(unsupported("exposure_us", exposure_us, fixed));
        }
        if let Some(gain_db) = wanted.gain_db {
            return Err(unsupported("gain_db", gain_db, fixed));
        }
        if let Some(hz) = wanted.frame_rate_hz.filter(|hz| !hz.is_finite()) {
            return Err(unsupported("frame_rate_hz", hz, "a finite number"));
        }
        if wanted.trigger == Some(Trigger::Hardware) {
            return Err(unsupported("trigger", "hardware", "free or software"));
        }
        if let Some(format) = wanted.pixel_format.filter(|format| *format != self.recording.format()) {
            return Err(unsupported("pixel_format", format!("{format:?}"), fixed));
        }
        if let Some(roi) = wanted.roi.filter(|roi| *roi != self.whole()) {
            return Err(unsupported("roi", format!("{roi:?}"), "the whole image"));
        }
        Ok(())
    }

    /// Frames play while the camera runs freely; with triggers the frame taken at the stage's position is delivered.
    fn update_playback(&self) {
        match (&self.run, self.trigger) {
            (Some(_), Trigger::Free) => lock(&self.playback).play(),
            _ => lock(&self.playback).end(),
        }
    }

    /// The next frame, if one is due within `timeout`, which it waits for.
    fn wait_for_next(&mut self, timeout: Duration) -> Result<Option<usize>, CameraError> {
        let held = lock(&self.playback).held();
        let deadline = Instant::now() + timeout;
        let n_frames = self.recording.n_frames();
        let Some(run) = &mut self.run else { return Ok(wait_without_frame(deadline)) };
        if held || (self.trigger == Trigger::Software && run.n_triggers == 0) {
            return Ok(wait_without_frame(deadline));
        }
        if self.trigger == Trigger::Software
            && let Some(here) =
                lock(&self.playback).playback_state().position_mm.and_then(|at| self.recording.nearest(at))
        {
            run.next_idx = Some(here);
        }
        if let Some(sweep) = lock(&self.playback).take_sweep() {
            run.next_idx = self.recording.nearest(sweep.from_mm);
            run.backwards = (sweep.to_mm < sweep.from_mm) == self.recording.ascends();
        }
        let idx = match run.next_idx {
            Some(idx) => idx,
            None if self.repeat => {
                if run.backwards {
                    n_frames - 1
                } else {
                    0
                }
            }
            None => {
                lock(&self.playback).end();
                return Err(CameraError::EndOfRecording);
            }
        };
        run.next_idx = Some(idx);
        if run.due_at > deadline {
            return Ok(wait_without_frame(deadline));
        }
        std::thread::sleep(run.due_at.saturating_duration_since(Instant::now()));
        Ok(Some(idx))
    }
}

impl Camera for ReplayCamera {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity { model: self.recording.name(), ..DeviceIdentity::unknown("replay") }
    }

    fn capabilities(&self) -> CameraCapabilities {
        CameraCapabilities {
            sensor_px: self.recording.size_px(),
            exposure_us: None,
            gain_db: None,
            frame_rate_hz: Some(RATES_HZ),
            triggers: vec![Trigger::Free, Trigger::Software],
            pixel_formats: vec![self.recording.format()],
            roi: false,
        }
    }

    /// The exposure is that of the first frame, 0 if it was not recorded; the gain is reported as 0; a replay at
    /// unlimited pace reports the highest frame rate.
    fn settings(&self) -> CameraSettings {
        CameraSettings {
            exposure_us: self.recording.frame(0).exposure_us,
            gain_db: 0.0,
            frame_rate_hz: match self.pace {
                Pace::Hz(hz) => hz,
                Pace::Unlimited => RATES_HZ.max,
            },
            trigger: self.trigger,
            pixel_format: self.recording.format(),
            roi: self.whole(),
        }
    }

    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        self.check(wanted)?;
        if let Some(hz) = wanted.frame_rate_hz {
            self.pace = Pace::Hz(RATES_HZ.clamp(hz));
        }
        if let Some(trigger) = wanted.trigger {
            self.trigger = trigger;
            self.update_playback();
        }
        Ok(self.settings())
    }

    fn start(&mut self) -> Result<(), CameraError> {
        if self.run.is_none() {
            self.run = Some(Run::new());
            self.update_playback();
        }
        Ok(())
    }

    fn trigger(&mut self) -> Result<(), CameraError> {
        if self.trigger != Trigger::Software {
            return Err(CameraError::NotTriggerable { reason: "it runs freely" });
        }
        let Some(run) = &mut self.run else {
            return Err(CameraError::NotTriggerable { reason: "acquisition is not started" });
        };
        run.n_triggers += 1;
        run.due_at = Instant::now();
        Ok(())
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        let Some(idx) = self.wait_for_next(timeout)? else { return Ok(None) };
        let read = self.recording.read_into(idx, image);
        let Some(run) = &mut self.run else { return Ok(None) };
        let backwards = run.backwards;
        let (frame_id, exposed_at, lost_before) = run.advance(self.pace, self.recording.n_frames());
        if let Err(cause) = read {
            run.lost = lost_before + 1;
            return Err(CameraError::Unreadable { frame_id, cause: cause.into_cause() });
        }
        let frame = self.recording.frame(idx);
        // Frames lost when they were recorded are reported as lost again, while frames are played one after the other.
        let is_next = self.trigger == Trigger::Free && frame_id > 0 && !backwards;
        let lost_before = lost_before + if is_next { frame.lost_before } else { 0 };
        let recorded_position_mm = frame.position_mm;
        lock(&self.playback).delivered(recorded_position_mm, exposed_at);
        Ok(Some(FrameInfo {
            frame_id,
            device_timestamp_ns: None,
            exposed_at,
            lost_before,
            lost_incomplete: 0,
            exposure_us: frame.exposure_us,
            recorded_position_mm,
        }))
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        if self.run.take().is_some() {
            lock(&self.playback).end();
        }
        Ok(())
    }

    fn reconnect(&mut self) -> Result<(), CameraError> {
        self.stop()
    }
}

impl Run {
    fn new() -> Self {
        Self { next_idx: Some(0), backwards: false, next_id: 0, lost: 0, due_at: Instant::now(), n_triggers: 0 }
    }

    /// Advances over the frame that is due: its number, its time, and how many were lost before it.
    fn advance(&mut self, pace: Pace, n_frames: usize) -> (u64, Instant, u64) {
        let now = Instant::now();
        let exposed_at = match pace {
            Pace::Hz(_) if now.saturating_duration_since(self.due_at) < REPLAY_CATCH_UP => self.due_at,
            Pace::Hz(_) | Pace::Unlimited => now,
        };
        self.due_at = match pace {
            Pace::Hz(hz) => exposed_at + Duration::from_secs_f64(1.0 / hz),
            Pace::Unlimited => exposed_at,
        };
        let (frame_id, lost) = (self.next_id, std::mem::take(&mut self.lost));
        self.next_id += 1;
        self.next_idx = self.next_idx.and_then(|idx| {
            if self.backwards { idx.checked_sub(1) } else { Some(idx + 1).filter(|next| *next < n_frames) }
        });
        self.n_triggers = self.n_triggers.saturating_sub(1);
        (frame_id, exposed_at, lost)
    }
}

fn wait_without_frame(deadline: Instant) -> Option<usize> {
    std::thread::sleep(deadline.saturating_duration_since(Instant::now()));
    None
}

fn unsupported(setting: &'static str, value: impl ToString, expected: &str) -> CameraError {
    CameraError::Unsupported { setting, value: value.to_string(), expected: expected.to_owned() }
}
