//! A continuous run: approach, run-up, frames at constant speed from the first to the last position of interest.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::time::Instant;

use devices::{CameraRequest, StageError, Trigger};

use crate::params::{LIGHT_IDLE, RECORDER_FRAMES, RUN_UP_MARGIN, RUN_UP_TIME};
use crate::parts::light::Light;
use crate::parts::motion::CompletedMotion;
use crate::shared::cancel::CancelFlag;
use crate::shared::frame::{FrameStream, SharedFrame};
use crate::shared::refusal::StationRefusal;
use crate::shared::status::{DropCounts, Lost};
use crate::station_thread::command::Reply;
use crate::station_thread::handle::Sweep;
use crate::station_thread::station::Station;

/// A run in progress.
pub struct Run {
    sweep: Sweep,
    cancel: CancelFlag,
    phase: Phase,
    run_up_mm: f64,
    frames: SyncSender<SharedFrame>,
    ended: SyncSender<StationRefusal>,
    dropped: Arc<DropCounts>,
    /// Until it runs: the caller waiting for the stream, and the stream.
    pending_start: Option<(Reply<FrameStream>, FrameStream)>,
    previous: Option<PreviousFrame>,
    /// Of a belt: whether the first frame with light was triggered, from which its position counts.
    counting: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Phase {
    /// Moving to the start of the run-up; `false` until the stage has its command.
    Approach(bool),
    /// At the start of a recording, which begins to play once the light is as requested, because every frame is needed.
    Waiting,
    /// At the start; waiting for the camera's first frame.
    Starting,
    Running,
    /// Beyond the range, on the ramp that ends the move: a stop would not brake sooner, and a controller whose laser is
    /// on while it brakes may lose its position.
    Braking,
}

#[derive(Clone, Copy)]
struct PreviousFrame {
    at: Instant,
    within: bool,
    position_mm: Option<f64>,
}

impl Run {
    fn new(sweep: Sweep, cancel: CancelFlag, run_up_mm: f64, reply: Reply<FrameStream>) -> Self {
        let (frames, receiver) = sync_channel(RECORDER_FRAMES);
        let (ended, why) = sync_channel(1);
        let dropped = Arc::new(DropCounts::default());
        let stream = FrameStream { frames: receiver, dropped: dropped.clone(), ended: why };
        let pending_start = Some((reply, stream));
        let phase = Phase::Approach(false);
        Self {
            sweep,
            cancel,
            phase,
            run_up_mm,
            frames,
            ended,
            dropped,
            pending_start,
            previous: None,
            counting: false,
        }
    }

    /// Whether frames are being recorded.
    pub fn is_running(&self) -> bool {
        self.phase == Phase::Running
    }

    /// Ends it early; returns the caller that still waits for its start.
    pub fn abort(mut self, refusal: StationRefusal) -> Option<(Reply<FrameStream>, StationRefusal)> {
        match self.pending_start.take() {
            Some((reply, _)) => Some((reply, refusal)),
            None => {
                // The channel holds one value, and this is the only one.
                let _ = self.ended.try_send(refusal);
                None
            }
        }
    }

    fn direction(&self) -> f64 {
        (self.sweep.to_mm - self.sweep.from_mm).signum()
    }

    /// Distance beyond the first position of interest, along the run.
    fn along_mm(&self, position_mm: f64) -> f64 {
        (position_mm - self.sweep.from_mm) * self.direction()
    }

    fn length_mm(&self) -> f64 {
        (self.sweep.to_mm - self.sweep.from_mm).abs()
    }

    fn contains(&self, position_mm: f64) -> bool {
        (0.0..=self.length_mm()).contains(&self.along_mm(position_mm))
    }

    fn start_mm(&self) -> f64 {
        self.sweep.from_mm - self.direction() * self.run_up_mm
    }

    fn end_mm(&self) -> f64 {
        self.sweep.to_mm + self.direction() * self.run_up_mm
    }

    /// Counts losses of which `within` lie in the range.
    fn count(&self, mut lost: Lost, within: u64) {
        let mut left = within;
        for part in [&mut lost.camera, &mut lost.no_buffer, &mut lost.malformed] {
            *part = (*part).min(left);
            left -= *part;
        }
        lost.count_into(&self.dropped);
    }
}

impl Station {
    /// Begins a run: checks it, then approaches.
    pub(crate) fn begin_run(&mut self, sweep: Sweep, cancel: CancelFlag, reply: Reply<FrameStream>) {
        match self.run_up_mm(&sweep) {
            Ok(run_up_mm) => self.run = Some(Run::new(sweep, cancel, run_up_mm, reply)),
            Err(refusal) => self.refuse(reply, refusal),
        }
    }

    /// Length of the ramp before the range; the range with its ramps must lie within the travel.
    fn run_up_mm(&mut self, sweep: &Sweep) -> Result<f64, StationRefusal> {
        let stage = self.stage.as_mut().ok_or(StationRefusal::Absent { device: "stage" })?;
        let bad = |name, value: f64| Err(StageError::BadNumber { name, value }.into());
        for (name, value) in [("from_mm", sweep.from_mm), ("to_mm", sweep.to_mm)] {
            if !value.is_finite() {
                return bad(name, value);
            }
        }
        if !(sweep.speed_mm_s > 0.0 && sweep.speed_mm_s.is_finite()) {
            return bad("speed_mm_s", sweep.speed_mm_s);
        }
        if stage.device().capabilities().frame_pitch_mm.is_some() && sweep.from_mm > sweep.to_mm {
            return Err(StageError::NotCommanded { command: "reversed" }.into());
        }
        if sweep.from_mm == sweep.to_mm {
            return bad("to_mm", sweep.to_mm);
        }
        let capabilities = stage.device().capabilities();
        let ramp_mm = match capabilities.acceleration_mm_s2 {
            _ if capabilities.follows_frames => 0.0,
            Some(a) if a > 0.0 => sweep.speed_mm_s * sweep.speed_mm_s / (2.0 * a) * RUN_UP_MARGIN,
            _ => sweep.speed_mm_s * RUN_UP_TIME.as_secs_f64(),
        };
        let (min_mm, max_mm) = capabilities.travel_mm;
        let direction = (sweep.to_mm - sweep.from_mm).signum();
        for target_mm in [sweep.from_mm - direction * ramp_mm, sweep.to_mm + direction * ramp_mm] {
            if !(min_mm..=max_mm).contains(&target_mm) {
                return Err(StageError::OutOfTravel { target_mm, min_mm, max_mm }.into());
            }
        }
        Ok(ramp_mm)
    }

    /// Continues the run.
    pub(crate) fn update_run(&mut self) {
        let Some(run) = &self.run else { return };
        if run.cancel.is_cancelled() {
            self.end_work(|_| StationRefusal::Cancelled);
            return self.stop_after_run();
        }
        let (phase, start_mm, rate_hz) = (run.phase, run.start_mm(), run.sweep.frame_rate_hz);
        match phase {
            Phase::Approach(false) if self.is_belt() => {
                let lit = self.light_for_exposure(Instant::now());
                self.enter(Phase::Waiting, lit);
            }
            Phase::Approach(false) if self.stage_rests() => {
                let full_mm_s = self.stage.as_mut().map(|stage| stage.device().capabilities().max_speed_mm_s);
                let result = self.start_positioning_move(start_mm, full_mm_s.unwrap_or_default());
                self.enter(Phase::Approach(true), result);
            }
            Phase::Waiting if self.light_is_as_requested() => {
                let result = self.expose_freely(rate_hz);
                self.enter(Phase::Starting, result);
                self.start_sweep();
            }
            Phase::Running if self.is_belt() => self.watch_belt(),
            // Laser on without frames while the stage moves: the run has failed in any case.
            Phase::Running if self.frames_are_overdue() => self.report_missing_frame(),
            Phase::Braking if self.stage_rests() => {
                self.run = None;
                self.stop_after_run();
            }
            _ => {}
        }
    }

    /// The stage ended a motion, possibly that of the run.
    pub(crate) fn run_motion_completed(&mut self, completed: CompletedMotion) {
        let Some(run) = &self.run else { return };
        if run.phase == Phase::Approach(true) && matches!(completed, CompletedMotion::Moved(_)) {
            if self.stage.as_mut().is_some_and(|stage| stage.device().capabilities().follows_frames) {
                let lit = self.light_for_exposure(Instant::now());
                return self.enter(Phase::Waiting, lit);
            }
            let rate_hz = run.sweep.frame_rate_hz;
            let result = self.expose_freely(rate_hz);
            self.enter(Phase::Starting, result);
        }
    }

    /// Adds a frame to the run, with the losses before it.
    pub(crate) fn record(&mut self, frame: &SharedFrame, lost: Lost) {
        let Some(run) = &self.run else { return };
        match run.phase {
            Phase::Approach(_) | Phase::Waiting | Phase::Braking => {}
            Phase::Starting => self.start_sweep(),
            Phase::Running => self.record_running(frame, lost),
        }
    }

    fn record_running(&mut self, frame: &SharedFrame, lost: Lost) {
        if self.is_belt() && !self.run.as_ref().is_some_and(|run| run.counting) {
            return;
        }
        let Some(mut run) = self.run.take() else { return };
        let previous = run.previous;
        let within = match frame.position_mm {
            Some(position_mm) => run.contains(position_mm),
            // A frame without position within the run is left to the job.
            None => previous.is_some_and(|previous| previous.within),
        };
        let lost_within = self.lost_within(&run, frame, lost.total());
        run.count(lost, lost_within);
        run.previous = Some(PreviousFrame { at: frame.captured_at, within, position_mm: frame.position_mm });
        let mut has_receiver = true;
        if within {
            match run.frames.try_send(frame.clone()) {
                Ok(()) => {}
                Err(TrySendError::Full(_)) => {
                    run.dropped.recorder.fetch_add(1, Ordering::Relaxed);
                    self.drops.recorder.fetch_add(1, Ordering::Relaxed);
                }
                Err(TrySendError::Disconnected(_)) => has_receiver = false,
            }
        }
        let is_past_end =
            frame.position_mm.is_some_and(|position_mm| run.along_mm(position_mm) >= run.length_mm());
        let brakes_itself = self.stage.as_mut().is_some_and(|stage| !stage.device().capabilities().follows_frames);
        if !has_receiver || (is_past_end && !brakes_itself) {
            drop(run);
            return self.stop_after_run();
        }
        if is_past_end {
            run.phase = Phase::Braking;
        }
        self.run = Some(run);
    }

    /// Number of exposures lost before `frame` that lay in the range: exposures are spaced evenly in time.
    fn lost_within(&self, run: &Run, frame: &SharedFrame, lost: u64) -> u64 {
        let (Some(previous), Some(stage)) = (run.previous, &self.stage) else { return 0 };
        let between = frame.captured_at.saturating_duration_since(previous.at);
        let is_within = |k: &u64| {
            let fraction = *k as f64 / (lost + 1) as f64;
            let position_mm = match (previous.position_mm, frame.position_mm) {
                // A belt's triggers are evenly spaced at any speed.
                (Some(before_mm), Some(now_mm)) if run.counting => {
                    Some(before_mm + fraction * (now_mm - before_mm))
                }
                _ => stage.position_at_mm(previous.at + between.mul_f64(fraction)),
            };
            position_mm.is_none_or(|position_mm| run.contains(position_mm))
        };
        (1..=lost).filter(is_within).count() as u64
    }

    /// The camera delivers and the light is as requested: starts the sweep.
    fn start_sweep(&mut self) {
        if !self.light_is_as_requested() {
            return;
        }
        let Some(run) = &self.run else { return };
        let (end_mm, speed_mm_s) = (run.end_mm(), run.sweep.speed_mm_s);
        let result = self.move_for_run(end_mm, speed_mm_s);
        self.enter(Phase::Running, result);
        let pending_start =
            self.run.as_mut().filter(|run| run.is_running()).and_then(|run| run.pending_start.take());
        if let Some((reply, stream)) = pending_start {
            self.answer(reply, Ok(stream));
        }
    }

    /// Whether the stage is a belt that triggers the camera.
    fn is_belt(&mut self) -> bool {
        self.stage.as_mut().is_some_and(|stage| stage.device().capabilities().frame_pitch_mm.is_some())
    }

    /// Ends a run over a belt that has stopped; before its first trigger it is waited for, with the laser off.
    fn watch_belt(&mut self) {
        let now = Instant::now();
        let counting = self.run.as_ref().is_some_and(|run| run.counting);
        let due = self.camera.as_ref().and_then(|camera| camera.frame_due(now));
        if !counting || due.is_none_or(|due| now <= due + LIGHT_IDLE) {
            return;
        }
        let waited_ms = self.camera.as_ref().map_or(0, |camera| camera.silent_for().as_millis() as u64);
        self.end_work(|_| StationRefusal::BeltStopped { waited_ms });
        self.stop_after_run();
    }

    /// Position of a belt at a frame that comes after `lost` lost ones; `None` for another stage. It counts from the
    /// first frame of a run that has light.
    pub(crate) fn belt_position_mm(&mut self, lit: bool, lost: u64) -> Option<f64> {
        if !self.is_belt() {
            return None;
        }
        let stage = self.stage.as_mut()?.device();
        match self.run.as_mut().filter(|run| run.is_running()) {
            Some(run) if !run.counting && lit => {
                run.counting = true;
                stage.begin_count();
                stage.count_exposures(1)
            }
            _ => stage.count_exposures(1 + lost),
        }
    }

    /// Whether the light must be turned off because frames are overdue. A recording has neither light nor inertia.
    fn frames_are_overdue(&mut self) -> bool {
        let now = Instant::now();
        let follows = self.stage.as_mut().is_some_and(|stage| stage.device().capabilities().follows_frames);
        let due = self.camera.as_ref().and_then(|camera| camera.frame_due(now));
        !follows && due.is_some_and(|due| now > due + LIGHT_IDLE)
    }

    fn light_is_as_requested(&self) -> bool {
        self.laser.as_ref().is_none_or(Light::is_as_requested)
    }

    fn move_for_run(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<(), StationRefusal> {
        if self.is_belt() {
            return Ok(());
        }
        let stage = self.stage.as_mut().ok_or(StationRefusal::Absent { device: "stage" })?;
        stage.start_move(target_mm, speed_mm_s)?;
        Ok(())
    }

    fn expose_freely(&mut self, frame_rate_hz: f64) -> Result<(), StationRefusal> {
        let trigger = if self.is_belt() { Trigger::Hardware } else { Trigger::Free };
        let camera = self.camera.as_mut().ok_or(StationRefusal::Absent { device: "camera" })?;
        camera.stop()?;
        let rated = camera.device().capabilities().frame_rate_hz.is_some();
        let frame_rate_hz = (rated && trigger == Trigger::Free).then_some(frame_rate_hz);
        camera.configure(&CameraRequest { trigger: Some(trigger), frame_rate_hz, ..CameraRequest::default() })?;
        camera.start()?;
        self.discard_waiting_frames();
        Ok(())
    }

    fn enter(&mut self, phase: Phase, result: Result<(), StationRefusal>) {
        match result {
            Ok(()) => {
                if let Some(run) = &mut self.run {
                    run.phase = phase;
                }
            }
            Err(refusal) => {
                self.fail(refusal);
                self.stop_after_run();
            }
        }
    }

    fn stop_after_run(&mut self) {
        self.come_to_rest();
        if let Some(camera) = &mut self.camera {
            // A camera that cannot be stopped is noticed at its next use.
            let _ = camera.stop();
        }
        self.discard_waiting_frames();
    }
}
