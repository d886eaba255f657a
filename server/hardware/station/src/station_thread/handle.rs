//! How the rest of the service talks to the station thread.

use parking_lot::Mutex;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use devices::features::CameraDetails;
use devices::{AcceptedMove, CameraRequest};
use tokio::sync::{oneshot, watch};
use twin::{TwinControl, TwinDriver};

use crate::params::{COMMANDS, LIVE_LIGHT_UNWATCHED, LIVE_UNWATCHED, START_WAIT, STOP_PATIENCE};
use crate::parts::devices::StationDevices;
use crate::shared::frame::SharedFrame;
use crate::shared::refusal::StationRefusal;
use crate::shared::status::{Fault, MachineState, StationStatus};
use crate::shared::stop_line::{StopEpoch, StopLine, StopRequest};
use crate::shared::tap::FrameTap;
use crate::shared::viewers::Viewers;
use crate::station_thread::command::{Command, Reply};
use crate::station_thread::lease::StationLease;
use crate::station_thread::owner::Station;
use crate::station_thread::status_publisher::{StatusPublisher, first_status};
use crate::station_thread::thread;

/// Everyone's access to the station.
#[derive(Clone)]
pub struct StationHandle {
    shared: Arc<Shared>,
}

struct Shared {
    commands: SyncSender<Command>,
    stop_line: Arc<StopLine>,
    viewers: Arc<Viewers>,
    status: watch::Sender<Arc<StationStatus>>,
    newest: watch::Sender<Option<SharedFrame>>,
    thread: Mutex<Option<JoinHandle<()>>>,
    simulation: Option<TwinControl>,
    camera_details: Arc<Mutex<Option<Arc<dyn CameraDetails>>>>,
}

/// How long a live view goes on without anyone watching.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Watch {
    /// Its camera.
    pub view: Duration,
    /// Its light.
    pub light: Duration,
}

impl Default for Watch {
    fn default() -> Self {
        Self { view: LIVE_UNWATCHED, light: LIVE_LIGHT_UNWATCHED }
    }
}

/// Who wants the station, shown to people.
#[derive(Debug, Clone)]
pub struct Purpose {
    /// The job's id.
    pub job_id: String,
    /// In the operator's words: "scanning".
    pub activity: String,
    /// When it was authorised, see [`StationHandle::stop_epoch`].
    pub epoch: StopEpoch,
}

/// A Stop that was requested; resolves once the devices have acknowledged it.
pub struct StopAcknowledgement(oneshot::Receiver<Result<(), StationRefusal>>);

impl StopAcknowledgement {
    /// Returns once the devices have acknowledged the stop.
    ///
    /// # Errors
    /// Which device did not take the command, or that the station is shutting down.
    pub async fn done(self) -> Result<(), StationRefusal> {
        self.0.await.unwrap_or(Err(StationRefusal::ShuttingDown))
    }
}

/// A person's single command; refused while a job has the station.
#[derive(Debug, Clone)]
pub enum Manual {
    /// Look for the stage's zero.
    Home,
    /// Go to a position; `None`: as fast as the stage can.
    Move {
        /// Where to.
        target_mm: f64,
        /// How fast at most.
        speed_mm_s: Option<f64>,
    },
    /// Move while this is repeated; stops within 300 ms of silence.
    Jog {
        /// Signed speed.
        velocity_mm_s: f64,
    },
    /// Set the camera.
    Configure(CameraRequest),
    /// Shine with a share of full power while frames arrive; 0 goes dark.
    Laser {
        /// 0–1.
        power: f64,
    },
    /// Acknowledge faults, reach devices again.
    Reset,
}

/// What the live view shall do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveRequest {
    /// Whether it shall run.
    pub running: bool,
    /// Share of full laser power, 0 is dark.
    pub laser_power: f64,
}

/// A continuous run: the stage moves at constant speed while the camera exposes at its own rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// First position of interest; the run-up is added by the station.
    pub from_mm: f64,
    /// Last position of interest.
    pub to_mm: f64,
    /// Speed.
    pub speed_mm_s: f64,
    /// Frames per second.
    pub frame_rate_hz: f64,
}

impl StationHandle {
    /// Starts the station thread and waits until it tried to open its devices; what is absent then is a fault of the
    /// status, and a reset tries again. `halted`: it was stopped in an earlier life and not reset since.
    pub fn start(devices: &StationDevices, halted: bool) -> Self {
        Self::start_with(devices.clone(), Watch::default(), halted)
    }

    /// Starts the station thread over a simulated station of any shape.
    pub fn over_twin(twin: twin::TwinStation) -> Self {
        Self::start(&StationDevices::over(twin), false)
    }

    /// The same with a live view that goes on so long without viewers.
    pub(crate) fn start_with(devices: StationDevices, watch: Watch, halted: bool) -> Self {
        let simulation = devices.twin.as_deref().and_then(TwinDriver::control);
        let (commands, receiver) = sync_channel(COMMANDS);
        let (opened, first_opening) = sync_channel(1);
        let (stop_line, viewers) = (Arc::new(StopLine::latched(halted)), Arc::new(Viewers::default()));
        let first_state = if halted { MachineState::Halted } else { MachineState::Preoperational };
        let status = watch::Sender::new(Arc::new(first_status(devices.simulated(), first_state)));
        let newest = watch::Sender::new(None);
        let camera_details = Arc::default();
        let publisher = StatusPublisher {
            status: status.clone(),
            newest: newest.clone(),
            stop_line: stop_line.clone(),
            simulated: devices.simulated(),
            viewers: viewers.clone(),
            live_unwatched: watch.view,
            live_light_unwatched: watch.light,
            opened: Some(opened),
            camera_details: Arc::clone(&camera_details),
            published_at: None,
            published: None,
        };
        let begin = move || thread::run(Station::new(receiver, publisher, devices));
        let thread = std::thread::Builder::new().name("station".to_owned()).spawn(begin);
        if let Err(error) = &thread {
            tracing::error!(%error, "the station thread could not be started");
        }
        let guarded = stop_line.clone();
        let guard = move || guarded.guard(STOP_PATIENCE);
        if let Err(error) = std::thread::Builder::new().name("station-stop".to_owned()).spawn(guard) {
            tracing::error!(%error, "nobody watches whether the station thread obeys");
        }
        // Late devices are missing devices; they may still come with a reset.
        let _ = first_opening.recv_timeout(START_WAIT);
        let thread = Mutex::new(thread.ok());
        let shared = Shared { commands, stop_line, viewers, status, newest, thread, simulation, camera_details };
        Self { shared: Arc::new(shared) }
    }

    /// The virtual operator, where the station is simulated.
    pub fn simulation(&self) -> Option<TwinControl> {
        self.shared.simulation.clone()
    }

    /// The camera's own features and how its link does, beside what the station does with it; `None` if there is no
    /// camera, or it has nothing beyond its settings. Calls to it take as long as the camera does.
    pub fn camera_details(&self) -> Option<Arc<dyn CameraDetails>> {
        self.shared.camera_details.lock().clone()
    }

    /// The station as last seen.
    pub fn status(&self) -> Arc<StationStatus> {
        self.shared.status.borrow().clone()
    }

    /// Follows the status; the newest wins.
    pub fn watch_status(&self) -> watch::Receiver<Arc<StationStatus>> {
        self.shared.status.subscribe()
    }

    /// Follows the frames; the newest wins, whoever made the camera expose.
    pub fn watch_frames(&self) -> watch::Receiver<Option<SharedFrame>> {
        self.shared.newest.subscribe()
    }

    /// Somebody who sees the frames was there at that moment; light of a live view goes out 4 s, the view itself 30 s
    /// after the last one.
    pub fn note_viewer(&self, at: Instant) {
        self.shared.viewers.note(at);
    }

    /// Stops motion, turns the laser off, ends what runs. Always taken, and latched from here on: nothing that was
    /// authorised before takes the station again, nothing new does before a reset.
    pub fn pull_stop(&self, actor: &str) -> StopAcknowledgement {
        let (done, told) = oneshot::channel();
        self.shared.stop_line.pull(StopRequest { actor: actor.to_owned(), done });
        // A full channel needs no waking: the thread looks at the line before each command. One that has ended told
        // its devices as it did; the sender that is dropped with the line says so.
        if let Err(TrySendError::Disconnected(_)) = self.shared.commands.try_send(Command::Wake) {
            self.shared.stop_line.begin_to_obey();
            drop(self.shared.stop_line.obeyed());
        }
        StopAcknowledgement(told)
    }

    /// [`StationHandle::pull_stop`], and waits until the devices have acknowledged it.
    pub async fn stop(&self, actor: &str) -> Result<(), StationRefusal> {
        self.pull_stop(actor).done().await
    }

    /// The present epoch, to be kept with what is authorised now.
    pub fn stop_epoch(&self) -> StopEpoch {
        self.shared.stop_line.epoch()
    }

    /// Whether it was stopped and not reset since.
    pub fn is_halted(&self) -> bool {
        self.shared.stop_line.is_latched()
    }

    /// Something outside the station failed: motion and light end, and a fault says what a person has to do.
    pub fn alarm(&self, fault: Fault) {
        // A thread that has ended is dark and at rest.
        let _ = self.shared.commands.send(Command::Alarm(fault));
    }

    /// A person's single command; returns once it was accepted, moves go on.
    pub async fn manual(&self, command: Manual) -> Result<Option<AcceptedMove>, StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::Manual(command, reply))?;
        answer.await.unwrap_or_else(|_| Err(self.why_unanswered()))
    }

    /// Starts or ends the live view.
    pub async fn live(&self, request: LiveRequest) -> Result<(), StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::Live(request, reply))?;
        answer.await.unwrap_or_else(|_| Err(self.why_unanswered()))
    }

    /// One frame as the camera is set now: the newest of a running view, else a single exposure.
    pub async fn snapshot(&self) -> Result<SharedFrame, StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::Snapshot(reply))?;
        answer.await.unwrap_or_else(|_| Err(self.why_unanswered()))
    }

    /// Every frame from now on, for one recording at a time. Nothing waits for whoever takes them.
    ///
    /// # Errors
    /// [`StationRefusal::Busy`] while there is another tap.
    pub async fn tap(&self) -> Result<FrameTap, StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::Tap(reply))?;
        answer.await.unwrap_or_else(|_| Err(self.why_unanswered()))
    }

    /// No more frames come through the tap; those that wait there can still be taken.
    ///
    /// # Errors
    /// [`StationRefusal::ShuttingDown`]: then none come either.
    pub async fn close_tap(&self) -> Result<(), StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::CloseTap(reply))?;
        answer.await.unwrap_or_else(|_| Err(self.why_unanswered()))
    }

    /// Whether a scan could begin depends on a calibration being active: the service sets it.
    pub fn calibration_changed(&self, active: bool) {
        // A thread that has ended needs no news.
        let _ = self.shared.commands.send(Command::CalibrationChanged(active));
    }

    /// Takes the station for a job. Ends a running live view; refused while another job has it or it is in error.
    pub fn lease(&self, purpose: Purpose) -> Result<StationLease, StationRefusal> {
        let (reply, answer) = Reply::blocking();
        self.send(Command::Lease(purpose, reply))?;
        let lease = answer.recv().unwrap_or_else(|_| Err(self.why_unanswered()))?;
        Ok(StationLease::new(self.clone(), lease))
    }

    /// Darkens, stops, closes the devices and ends the thread; returns when it has ended.
    pub fn shut_down(&self) {
        // A thread that has ended already is what is wanted.
        let _ = self.shared.commands.send(Command::ShutDown);
        let thread = self.shared.thread.lock().take();
        if let Some(thread) = thread
            && thread.join().is_err()
        {
            tracing::error!("the station thread ended by a defect");
        }
    }

    pub(crate) fn send(&self, command: Command) -> Result<(), StationRefusal> {
        self.shared.commands.try_send(command).map_err(|error| match error {
            TrySendError::Full(_) => StationRefusal::TooManyCommands,
            TrySendError::Disconnected(_) => StationRefusal::ShuttingDown,
        })
    }

    /// Gives a lease back; waits for room in the channel, since this must not be lost. `false`: the thread has ended.
    pub(crate) fn release(&self, command: Command) -> bool {
        self.shared.commands.send(command).is_ok()
    }

    /// Why a call was never answered: a defect ended what the thread did, or the thread itself.
    pub(crate) fn why_unanswered(&self) -> StationRefusal {
        match self.status().faults.first() {
            Some(fault) => StationRefusal::InError { detail: fault.detail.clone(), remedy: fault.remedy.clone() },
            None => StationRefusal::ShuttingDown,
        }
    }
}
