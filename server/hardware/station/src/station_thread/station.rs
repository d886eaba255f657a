//! State of the station thread, and its cycle.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::{Duration, Instant};

use crate::params::{COMMANDS_PER_CYCLE, CYCLE_TIME, IDLE_CYCLE_TIME};
use crate::parts::acquisition::Acquisition;
use crate::parts::devices::StationDevices;
use crate::parts::light::Light;
use crate::parts::machine::{self, Event};
use crate::parts::motion::Motion;
use crate::parts::tap::Tap;
use crate::shared::dark_frame::CameraDarkFrame;
use crate::shared::refusal::StationRefusal;
use crate::shared::status::{DropCounts, Fault, MachineState, StateHistory};
use crate::station_thread::command::{Answer, Command, Reply};
use crate::station_thread::handle::Purpose;
use crate::station_thread::live_view::LiveView;
use crate::station_thread::opening::Opening;
use crate::station_thread::reset::Resetting;
use crate::station_thread::run::Run;
use crate::station_thread::stamping::Stamping;
use crate::station_thread::status_publisher::StatusPublisher;
use crate::station_thread::task::Task;

/// The job that uses the station.
pub struct LeaseHolder {
    /// Number of its lease.
    pub lease: u64,
    /// Its purpose.
    pub purpose: Purpose,
    /// Camera settings before the lease.
    pub camera_before: Option<devices::CameraSettings>,
}

/// Why a lease was revoked.
pub enum Revoked {
    /// A person stopped the station.
    Stopped {
        /// Who stopped it.
        actor: String,
    },
    /// A device failed.
    Fault,
}

/// State and devices of the station thread.
pub struct Station {
    pub(crate) commands: Receiver<Command>,
    pub(crate) publisher: StatusPublisher,
    pub(crate) devices: StationDevices,
    pub(crate) openings: Vec<Opening>,
    pub(crate) camera: Option<Acquisition>,
    pub(crate) stage: Option<Motion>,
    pub(crate) laser: Option<Light>,
    pub(crate) machine: MachineState,
    pub(crate) history: StateHistory,
    pub(crate) faults: Vec<Fault>,
    pub(crate) holder: Option<LeaseHolder>,
    pub(crate) revoked: Option<(u64, Revoked)>,
    pub(crate) leases: u64,
    pub(crate) task: Option<Task>,
    pub(crate) run: Option<Run>,
    pub(crate) live: Option<LiveView>,
    pub(crate) tap: Option<Tap>,
    pub(crate) resetting: Option<Resetting>,
    pub(crate) camera_before_fault: Option<devices::CameraSettings>,
    pub(crate) calibrated: bool,
    /// Corrects the camera's frames.
    pub(crate) dark_frame: Option<Arc<CameraDarkFrame>>,
    pub(crate) stamping: Stamping,
    pub(crate) drops: Arc<DropCounts>,
    pub(crate) answers: Vec<Box<dyn FnOnce() + Send>>,
    /// Who stopped it last.
    pub(crate) stopped_by: String,
    pub(crate) ending: bool,
}

impl Station {
    /// Creates a station that begins to open its devices; Halted if the stop latch is set.
    pub fn new(commands: Receiver<Command>, publisher: StatusPublisher, devices: StationDevices) -> Self {
        let mut station = Self {
            commands,
            devices,
            openings: Vec::new(),
            camera: None,
            stage: None,
            laser: None,
            machine: if publisher.stop_latch.is_latched() {
                MachineState::Halted
            } else {
                MachineState::Preoperational
            },
            history: StateHistory::default(),
            faults: Vec::new(),
            holder: None,
            revoked: None,
            leases: 0,
            task: None,
            run: None,
            live: None,
            tap: None,
            resetting: None,
            camera_before_fault: None,
            calibrated: false,
            dark_frame: None,
            stamping: Stamping::default(),
            drops: Arc::default(),
            answers: Vec::new(),
            stopped_by: String::new(),
            ending: false,
            publisher,
        };
        station.history.enter(station.machine);
        station.begin_opening();
        station
    }

    /// One cycle: Stop, commands, frame, stage, laser, and their consequences. `false` ends the thread.
    pub fn run_cycle(&mut self) -> bool {
        self.execute_stop();
        self.execute_commands();
        self.update_openings();
        self.update_camera();
        self.update_stage();
        self.update_laser();
        self.update_task();
        self.update_run();
        self.update_live_view();
        self.update_reset();
        self.update_readiness();
        self.publish_and_reply();
        !self.ending
    }

    /// Publishes the status, then sends the pending replies, so that a caller with a reply sees the resulting state.
    pub fn publish_and_reply(&mut self) {
        self.publish();
        for answer in self.answers.drain(..) {
            answer();
        }
    }

    /// Sends an answer at the end of this cycle.
    pub(crate) fn answer<T: Send + 'static>(&mut self, reply: Reply<T>, answer: Answer<T>) {
        self.answers.push(Box::new(move || reply.send(answer)));
    }

    /// Applies an event to the state machine; `false` if the state refuses it.
    pub(crate) fn transition(&mut self, event: Event) -> bool {
        match machine::next(self.machine, event) {
            Some(state) => {
                self.machine = state;
                // Back at idle, whether a scan can start is determined at once.
                let equipped = if self.can_scan() { Event::ScanPossible } else { Event::ScanNotPossible };
                self.machine = machine::next(self.machine, equipped).unwrap_or(self.machine);
                self.history.enter(self.machine);
                true
            }
            None => false,
        }
    }

    /// Whether the thread may be needed at any moment.
    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some()
            || self.run.is_some()
            || self.resetting.is_some()
            || self.is_opening()
            || self.stage.as_ref().is_some_and(Motion::is_moving)
            || self.laser.as_ref().is_some_and(Light::is_requested)
            || self.stamping.is_waiting()
    }

    fn execute_stop(&mut self) {
        if self.publisher.stop_latch.is_pending() {
            self.stop_everything();
        }
    }

    fn execute_commands(&mut self) {
        let mut wait = self.wait_for_commands();
        for _ in 0..COMMANDS_PER_CYCLE {
            let command = match wait.take() {
                Some(wait) => self.commands.recv_timeout(wait),
                None => self.commands.try_recv().map_err(|error| match error {
                    TryRecvError::Empty => RecvTimeoutError::Timeout,
                    TryRecvError::Disconnected => RecvTimeoutError::Disconnected,
                }),
            };
            match command {
                Ok(command) => self.execute(command),
                Err(RecvTimeoutError::Timeout) => break,
                Err(RecvTimeoutError::Disconnected) => self.ending = true,
            }
            if self.ending {
                break;
            }
            self.execute_stop();
        }
    }

    /// How long to wait for a command: not at all while frames may arrive, since then the thread waits for frames.
    fn wait_for_commands(&self) -> Option<Duration> {
        if self.is_faulted("camera") || !self.camera.as_ref().is_some_and(Acquisition::expects_frames) {
            return Some(if self.is_busy() { CYCLE_TIME } else { IDLE_CYCLE_TIME });
        }
        None
    }

    fn can_scan(&self) -> bool {
        self.calibrated && self.stage.as_ref().is_some_and(Motion::homed)
    }

    fn update_readiness(&mut self) {
        self.transition(if self.can_scan() { Event::ScanPossible } else { Event::ScanNotPossible });
    }

    fn update_stage(&mut self) {
        if self.is_faulted("stage") {
            return;
        }
        let Some(stage) = &mut self.stage else { return };
        match stage.update(Instant::now()) {
            Ok(Some(completed)) => self.motion_completed(completed),
            Ok(None) => {}
            Err(error) => self.fail(error.into()),
        }
    }

    fn update_laser(&mut self) {
        if self.is_faulted("laser") {
            return;
        }
        let now = Instant::now();
        let due = self.camera.as_ref().and_then(|camera| camera.frame_due(now));
        let Some(laser) = &mut self.laser else { return };
        if let Some(due) = due {
            laser.expect_frame(due);
        }
        if let Err(error) = laser.update(now) {
            self.fail(error.into());
        }
    }

    /// The refusal while a fault waits for acknowledgement, or while devices are missing.
    pub(crate) fn in_error(&self) -> StationRefusal {
        match self.faults.first() {
            Some(fault) => StationRefusal::InError { detail: fault.detail.clone(), remedy: fault.remedy.clone() },
            None => StationRefusal::InError {
                detail: "the devices are being opened".to_owned(),
                remedy: "wait a moment".to_owned(),
            },
        }
    }

    /// Refuses every pending request, at the end.
    pub(crate) fn refuse_all(&mut self) {
        self.end_work(|_| StationRefusal::ShuttingDown);
        self.end_reset(|| StationRefusal::ShuttingDown);
        self.publisher.stop_latch.begin_stop();
        for request in self.publisher.stop_latch.finish_stop() {
            // Motion and light have ended, which is what the Stop requested.
            self.answers.push(Box::new(move || request.answer(Ok(()))));
        }
        self.publish_and_reply();
        self.publisher.stop_latch.close();
    }
}
