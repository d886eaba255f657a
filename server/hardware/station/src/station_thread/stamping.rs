//! Stamping of frames: each waits for the position reading after it.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use crate::params::CYCLE_TIME;
use crate::parts::acquisition::{RawFrame, UNSHARED};
use crate::parts::motion::FramePosition;
use crate::shared::frame::SharedFrame;
use crate::shared::refusal::StationRefusal;
use crate::shared::status::Lost;
use crate::station_thread::station::Station;

/// Frames that wait, and statistics of those that were stamped.
pub struct Stamping {
    waiting: VecDeque<RawFrame>,
    sequence: u64,
    began_at: Instant,
    arrivals: VecDeque<Instant>,
}

impl Default for Stamping {
    fn default() -> Self {
        Self { waiting: VecDeque::new(), sequence: 0, began_at: Instant::now(), arrivals: VecDeque::new() }
    }
}

/// Arrivals used for the frame rate.
const ARRIVALS: usize = 256;

impl Stamping {
    /// Whether a frame waits for its position.
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Number of stamped frames.
    pub fn arrived(&self) -> u64 {
        self.sequence
    }

    /// Frames per second over the last second; fast cameras are measured over the last 256 frames.
    pub fn rate_hz(&self, now: Instant) -> f64 {
        let recent = self.arrivals.iter().filter(|at| now.saturating_duration_since(**at).as_secs_f64() < 1.0);
        let count = recent.clone().count();
        match recent.clone().next() {
            Some(first) if count == ARRIVALS => {
                count as f64 / now.saturating_duration_since(*first).as_secs_f64().max(1e-3)
            }
            _ => count as f64,
        }
    }

    fn note_arrival(&mut self, at: Instant) {
        if self.arrivals.len() == ARRIVALS {
            self.arrivals.pop_front();
        }
        self.arrivals.push_back(at);
    }
}

impl Station {
    /// Receives a frame if one is available, and publishes those whose position is now known.
    pub(crate) fn update_camera(&mut self) {
        if !self.is_faulted("camera") {
            self.receive_frame();
        }
        self.forward_frames();
    }

    fn receive_frame(&mut self) {
        let now = Instant::now();
        let Some(camera) = &mut self.camera else { return };
        if !camera.expects_frames() {
            if let Err(error) = camera.probe(now) {
                self.fail(error.into());
            }
            return;
        }
        match camera.take(CYCLE_TIME) {
            Ok(Some(frame)) => self.stamping.waiting.push_back(frame),
            Ok(None) => {
                if let Some(silent) = camera.silence(now) {
                    let (waited_ms, n_incomplete) = (silent.as_millis() as u64, camera.n_incomplete());
                    self.fail(StationRefusal::NoFrame { waited_ms, n_incomplete });
                }
            }
            Err(error) => self.fail(error.into()),
        }
    }

    fn forward_frames(&mut self) {
        let now = Instant::now();
        while let Some(frame) = self.stamping.waiting.front() {
            let position = match &self.stage {
                _ if frame.info.recorded_position_mm.is_some() => FramePosition::Known(None),
                Some(stage) => stage.frame_position(frame.info.exposed_at, now),
                None => FramePosition::Known(None),
            };
            let FramePosition::Known(position_mm) = position else { return };
            let Some(frame) = self.stamping.waiting.pop_front() else { return };
            let lost = frame.lost;
            let stamped = self.stamp(frame, position_mm, now);
            self.deliver(stamped, lost);
        }
    }

    fn stamp(&mut self, raw: RawFrame, position_mm: Option<f64>, now: Instant) -> SharedFrame {
        let RawFrame { mut frame, arrived_at, info, lost } = raw;
        let captured_at = info.exposed_at;
        self.stamping.sequence += 1;
        self.stamping.note_arrival(now);
        let since = captured_at.saturating_duration_since(self.stamping.began_at);
        let stamped = Arc::get_mut(&mut frame).expect(UNSHARED);
        stamped.sequence = self.stamping.sequence;
        stamped.captured_at = captured_at;
        stamped.arrived_at = arrived_at;
        stamped.captured_at_ns = since.as_nanos() as u64;
        stamped.position_mm = info.recorded_position_mm.or(position_mm);
        stamped.lost_before = lost.total();
        stamped.exposure_us = info.exposure_us;
        stamped.dark_frame = match (&self.dark_frame, &mut self.camera) {
            (Some(dark), Some(camera)) => {
                let identity = camera.device().identity();
                dark.correct(&mut stamped.image, &identity, &camera.settings())
            }
            _ => None,
        };
        stamped.laser_on = self.laser.as_ref().is_some_and(|laser| laser.was_on_at(captured_at));
        let laser_on = stamped.laser_on;
        if let Some(position_mm) = self.belt_position_mm(laser_on, lost.total()) {
            Arc::get_mut(&mut frame).expect(UNSHARED).position_mm = Some(position_mm);
        }
        if let Some(camera) = &mut self.camera {
            camera.pool().lend(&frame);
        }
        frame
    }

    fn deliver(&mut self, frame: SharedFrame, lost: Lost) {
        self.light_for_next_frame();
        self.publisher.publish_frame(frame.clone());
        if self.tap.as_mut().is_some_and(|tap| !tap.offer(&frame, lost, &self.drops)) {
            self.tap = None;
        }
        self.record(&frame, lost);
        self.grabbed(&frame);
    }

    /// A frame arrived: if the camera runs freely, the next one needs light as well.
    fn light_for_next_frame(&mut self) {
        let now = Instant::now();
        let due = self.camera.as_ref().and_then(|camera| camera.frame_due(now));
        if let (Some(laser), Some(due)) = (&mut self.laser, due)
            && let Err(error) = laser.serve_frame(due, now)
        {
            self.fail(error.into());
        }
    }

    /// Discards waiting frames of an acquisition that ended.
    pub(crate) fn discard_waiting_frames(&mut self) {
        let waiting = self.stamping.waiting.drain(..);
        if let Some(camera) = &mut self.camera {
            waiting.for_each(|raw| camera.pool().give_back(raw.frame));
        }
    }
}
