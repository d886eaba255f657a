//! The current call of a job, or snapshot of a person; one at a time.

use std::time::{Duration, Instant};

use devices::{CameraRequest, CameraSettings, LaserError, Trigger};

use crate::params::{LIGHT_IDLE, LIGHT_UP_LIMIT, SNAPSHOT_AGE};
use crate::parts::acquisition::Acquisition;
use crate::parts::light::Light;
use crate::parts::motion::{CompletedMotion, Motion};
use crate::shared::cancel::CancelFlag;
use crate::shared::frame::SharedFrame;
use crate::shared::refusal::StationRefusal;
use crate::shared::status::MachineState::Operational;
use crate::shared::status::OperationalState::SingleExecution;
use crate::station_thread::command::Reply;
use crate::station_thread::station::Station;

/// A call in progress.
pub enum Task {
    /// Moving and settling.
    Move {
        /// Target position.
        target_mm: f64,
        /// Highest speed.
        speed_mm_s: Option<f64>,
        /// Whether the stage has its command; before, it comes to rest from an earlier motion.
        started: bool,
        /// Ends it.
        cancel: CancelFlag,
        /// Receives the position read back.
        reply: Reply<f64>,
    },
    /// Homing.
    Home {
        /// Whether the stage has its command.
        started: bool,
        /// Ends it.
        cancel: CancelFlag,
        /// Answered when the stage is homed.
        reply: Reply<()>,
    },
    /// Exposing one frame.
    Grab(Grab),
    /// Waiting until the laser is on or off.
    Light {
        /// Start of the wait.
        since: Instant,
        /// Answered when the laser reports it.
        reply: Reply<()>,
    },
}

/// One requested frame.
pub struct Grab {
    cancel: Option<CancelFlag>,
    reply: Reply<SharedFrame>,
    begun_at: Instant,
    /// Whether each frame is triggered; otherwise the camera runs freely.
    triggered: bool,
    exposing: Option<Exposing>,
    retried: bool,
    /// For a snapshot: the settings to restore afterwards.
    afterwards: Option<CameraSettings>,
}

struct Exposing {
    since: Instant,
    until: Instant,
}

impl Station {
    /// Continues the current call.
    pub(crate) fn update_task(&mut self) {
        let Some(task) = self.task.take() else { return };
        match task {
            Task::Move { ref cancel, .. } | Task::Home { ref cancel, .. } if cancel.is_cancelled() => {
                self.give_up_task(task, StationRefusal::Cancelled);
                self.come_to_rest();
            }
            Task::Move { target_mm, speed_mm_s, started: false, cancel, reply } => {
                self.update_move(target_mm, speed_mm_s, cancel, reply);
            }
            Task::Home { started: false, cancel, reply } => self.update_homing(cancel, reply),
            Task::Grab(grab) => self.update_grab(grab),
            Task::Light { since, reply } => self.update_light(since, reply),
            under_way => self.task = Some(under_way),
        }
    }

    /// The stage ended a motion.
    pub(crate) fn motion_completed(&mut self, completed: CompletedMotion) {
        self.run_motion_completed(completed);
        match (self.task.take(), completed) {
            (Some(Task::Move { started: true, reply, .. }), CompletedMotion::Moved(position_mm)) => {
                self.answer(reply, Ok(position_mm));
            }
            (Some(Task::Home { started: true, reply, .. }), CompletedMotion::Homed) => self.answer(reply, Ok(())),
            (task, _) => self.task = task,
        }
    }

    /// Ends a call with a refusal.
    pub(crate) fn give_up_task(&mut self, task: Task, refusal: StationRefusal) {
        match task {
            Task::Move { reply, .. } => self.answer(reply, Err(refusal)),
            Task::Home { reply, .. } | Task::Light { reply, .. } => self.answer(reply, Err(refusal)),
            Task::Grab(grab) => {
                self.answer(grab.reply, Err(refusal));
                self.after_grab(grab.afterwards);
            }
        }
    }

    fn update_move(&mut self, target_mm: f64, speed_mm_s: Option<f64>, cancel: CancelFlag, reply: Reply<f64>) {
        let Some(stage) = &mut self.stage else {
            return self.answer(reply, Err(StationRefusal::Absent { device: "stage" }));
        };
        if stage.is_moving() {
            self.task = Some(Task::Move { target_mm, speed_mm_s, started: false, cancel, reply });
            return;
        }
        let speed_mm_s_or_full = speed_mm_s.unwrap_or(stage.device().capabilities().max_speed_mm_s);
        match self.start_positioning_move(target_mm, speed_mm_s_or_full) {
            Ok(()) => self.task = Some(Task::Move { target_mm, speed_mm_s, started: true, cancel, reply }),
            Err(refusal) => self.refuse(reply, refusal),
        }
    }

    /// Starts a move during which no frame is due. Before a long one the light is turned off: some controllers turn the
    /// laser off only between motions.
    pub(crate) fn start_positioning_move(
        &mut self,
        target_mm: f64,
        speed_mm_s: f64,
    ) -> Result<(), StationRefusal> {
        let stage = self.stage.as_mut().ok_or(StationRefusal::Absent { device: "stage" })?;
        // The other half is reserved for the reports of its end.
        let is_long = stage.travel_s(target_mm, speed_mm_s) > LIGHT_IDLE.as_secs_f64() / 2.0;
        if let Some(laser) = self.laser.as_mut().filter(|laser| is_long && laser.is_requested()) {
            laser.suspend()?;
        }
        stage.start_move(target_mm, speed_mm_s)?;
        Ok(())
    }

    fn update_homing(&mut self, cancel: CancelFlag, reply: Reply<()>) {
        let Some(stage) = &mut self.stage else {
            return self.answer(reply, Err(StationRefusal::Absent { device: "stage" }));
        };
        if stage.is_moving() {
            self.task = Some(Task::Home { started: false, cancel, reply });
            return;
        }
        match stage.start_home() {
            Ok(()) => self.task = Some(Task::Home { started: true, cancel, reply }),
            Err(error) => self.refuse(reply, error.into()),
        }
    }

    /// Switches the light; the call returns once the laser reports it.
    pub(crate) fn begin_light(&mut self, power: f64, reply: Reply<()>) {
        let now = Instant::now();
        let Some(laser) = &mut self.laser else {
            return self.answer(reply, Err(StationRefusal::Absent { device: "laser" }));
        };
        let result = if power == 0.0 { laser.off() } else { laser.request(power, now) };
        match result {
            Ok(()) => self.task = Some(Task::Light { since: now, reply }),
            Err(error) => self.refuse(reply, error.into()),
        }
    }

    fn update_light(&mut self, since: Instant, reply: Reply<()>) {
        let Some(laser) = &self.laser else { return self.answer(reply, Err(self.in_error())) };
        if laser.is_as_requested() {
            return self.answer(reply, Ok(()));
        }
        let late = since.elapsed() > LIGHT_UP_LIMIT;
        let off_requested = !laser.is_requested();
        self.task = Some(Task::Light { since, reply });
        if late && off_requested {
            let reason = "it reports light although it was switched off".to_owned();
            self.fail(LaserError::Disconnected { reason }.into());
        }
    }

    /// Begins to expose one frame for a job.
    pub(crate) fn begin_grab(&mut self, cancel: Option<CancelFlag>, reply: Reply<SharedFrame>) {
        match self.ready_to_expose() {
            Ok(triggered) => self.start_grab(cancel, reply, triggered, None),
            Err(refusal) => self.refuse(reply, refusal),
        }
    }

    /// Begins to take one frame for a person, without light and motion.
    pub(crate) fn begin_snapshot(&mut self, reply: Reply<SharedFrame>) {
        if self.machine == Operational(SingleExecution) || self.task.is_some() {
            let newest = self.publisher.newest.borrow().clone();
            return match newest.filter(|frame| frame.captured_at.elapsed() < SNAPSHOT_AGE) {
                Some(frame) => self.answer(reply, Ok(frame)),
                None => self.answer(reply, Err(StationRefusal::Busy { activity: self.activity().to_owned() })),
            };
        }
        if self.live.is_some() {
            self.watched();
            return self.start_grab(None, reply, false, None);
        }
        if self.is_faulted("camera") {
            return self.answer(reply, Err(self.in_error()));
        }
        let before = self.camera.as_ref().map(|camera| camera.settings());
        match self.ready_to_expose() {
            Ok(triggered) => self.start_grab(None, reply, triggered, before),
            Err(refusal) => self.refuse(reply, refusal),
        }
    }

    /// Prepares the camera for single frames; returns whether each must be triggered.
    fn ready_to_expose(&mut self) -> Result<bool, StationRefusal> {
        let camera = self.camera.as_mut().ok_or(StationRefusal::Absent { device: "camera" })?;
        let triggered = camera.device().capabilities().triggers.contains(&Trigger::Software);
        let trigger = if triggered { Trigger::Software } else { Trigger::Free };
        if camera.settings().trigger != trigger {
            camera.configure(&CameraRequest { trigger: Some(trigger), ..CameraRequest::default() })?;
        }
        camera.start()?;
        Ok(triggered)
    }

    fn start_grab(
        &mut self,
        cancel: Option<CancelFlag>,
        reply: Reply<SharedFrame>,
        triggered: bool,
        afterwards: Option<CameraSettings>,
    ) {
        let begun_at = Instant::now();
        let grab = Grab { cancel, reply, begun_at, triggered, exposing: None, retried: false, afterwards };
        self.update_grab(grab);
    }

    fn update_grab(&mut self, mut grab: Grab) {
        if grab.cancel.as_ref().is_some_and(CancelFlag::is_cancelled) {
            return self.give_up_task(Task::Grab(grab), StationRefusal::Cancelled);
        }
        let now = Instant::now();
        if let Some(exposing) = &grab.exposing {
            let computing = self.camera.as_ref().is_some_and(|camera| camera.is_computing(exposing.since, now));
            if now <= exposing.until || computing {
                self.task = Some(Task::Grab(grab));
                return;
            }
            if grab.retried {
                self.task = Some(Task::Grab(grab));
                return self.report_missing_frame();
            }
            (grab.retried, grab.exposing) = (true, None);
            if let Some(camera) = &mut self.camera {
                camera.give_up();
            }
        }
        if let Err(refusal) = self.light_for_exposure(now) {
            self.task = Some(Task::Grab(grab));
            return self.fail(refusal);
        }
        if self.laser.as_ref().is_none_or(Light::is_as_requested) {
            self.expose(grab, now);
        } else {
            self.task = Some(Task::Grab(grab));
        }
    }

    /// Turns requested light on again for an exposure about to begin.
    pub(crate) fn light_for_exposure(&mut self, now: Instant) -> Result<(), StationRefusal> {
        Ok(self.laser.as_mut().map_or(Ok(()), |laser| laser.serve_frame(now, now))?)
    }

    fn expose(&mut self, mut grab: Grab, now: Instant) {
        let Some(camera) = &mut self.camera else {
            return self.give_up_task(Task::Grab(grab), StationRefusal::Absent { device: "camera" });
        };
        grab.exposing = Some(Exposing { since: now, until: now + camera.grab_limit() });
        let triggered = if grab.triggered { camera.trigger() } else { Ok(()) };
        self.task = Some(Task::Grab(grab));
        if let Err(error) = triggered {
            self.fail(error.into());
        }
    }

    /// Raises the fault of a camera that delivers no frame; refuses the caller that waits for one.
    pub(crate) fn report_missing_frame(&mut self) {
        let silent = self.camera.as_ref().map_or(Duration::ZERO, Acquisition::silent_for);
        let waited_ms = match &self.task {
            Some(Task::Grab(grab)) => grab.begun_at.elapsed().as_millis() as u64,
            _ => silent.as_millis() as u64,
        };
        let n_incomplete = self.camera.as_ref().map_or(0, Acquisition::n_incomplete);
        if let Some(camera) = &mut self.camera {
            camera.give_up();
        }
        self.fail(StationRefusal::NoFrame { waited_ms, n_incomplete });
    }

    /// Completes the current call if it waits for this frame.
    pub(crate) fn grabbed(&mut self, frame: &SharedFrame) {
        match self.task.take() {
            Some(Task::Grab(Grab { reply, triggered, exposing: Some(exposing), afterwards, .. }))
                if triggered || frame.captured_at >= exposing.since =>
            {
                self.answer(reply, Ok(frame.clone()));
                self.after_grab(afterwards);
            }
            task => self.task = task,
        }
    }

    fn after_grab(&mut self, afterwards: Option<CameraSettings>) {
        if afterwards.is_some() {
            self.restore_camera(afterwards);
        }
    }

    /// Stops the camera and restores its settings.
    pub(crate) fn restore_camera(&mut self, before: Option<CameraSettings>) {
        let is_faulted = self.is_faulted("camera");
        let (Some(camera), Some(before)) = (&mut self.camera, before) else { return };
        let stopped = camera.stop();
        if is_faulted {
            self.camera_before_fault = Some(before);
            return;
        }
        let wanted = difference(&camera.settings(), &before);
        let restored = stopped.and_then(|()| camera.configure(&wanted).map(drop));
        self.discard_waiting_frames();
        if let Err(error) = restored {
            self.fail(error.into());
        }
    }

    /// Whether the stage is at rest.
    pub(crate) fn stage_rests(&self) -> bool {
        self.stage.as_ref().is_none_or(|stage| !Motion::is_moving(stage))
    }
}

/// The settings in which `wanted` differs from `now`; others are left out, since the camera may not support them.
fn difference(now: &CameraSettings, wanted: &CameraSettings) -> CameraRequest {
    CameraRequest {
        exposure_us: (now.exposure_us != wanted.exposure_us).then_some(wanted.exposure_us),
        gain_db: (now.gain_db != wanted.gain_db).then_some(wanted.gain_db),
        frame_rate_hz: (now.frame_rate_hz != wanted.frame_rate_hz).then_some(wanted.frame_rate_hz),
        trigger: (now.trigger != wanted.trigger).then_some(wanted.trigger),
        pixel_format: (now.pixel_format != wanted.pixel_format).then_some(wanted.pixel_format),
        roi: (now.roi != wanted.roi).then_some(wanted.roi),
    }
}
