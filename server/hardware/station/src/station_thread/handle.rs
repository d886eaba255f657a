//! Access to the station thread for the rest of the service.

use parking_lot::Mutex;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use devices::features::CameraDetails;
use devices::{AcceptedMove, CameraRequest};
use tokio::sync::{oneshot, watch};
use twin::{TwinControl, TwinDriver};

use crate::params::{COMMAND_CAPACITY, LIVE_LIGHT_UNWATCHED, LIVE_UNWATCHED, START_WAIT, STOP_GUARD_DELAY};
use crate::parts::devices::StationDevices;
use crate::shared::dark_frame::CameraDarkFrame;
use crate::shared::frame::SharedFrame;
use crate::shared::refusal::StationRefusal;
use crate::shared::status::{Fault, MachineState, StationStatus};
use crate::shared::stop_latch::{StopEpoch, StopLatch, StopRequest};
use crate::shared::tap::FrameTap;
use crate::shared::viewers::Viewers;
use crate::station_thread::command::{Command, Reply};
use crate::station_thread::lease::StationLease;
use crate::station_thread::station::Station;
use crate::station_thread::status_publisher::{StatusPublisher, first_status};
use crate::station_thread::thread;

/// Shared access to the station.
#[derive(Clone)]
pub struct StationHandle {
    shared: Arc<Shared>,
}

struct Shared {
    commands: SyncSender<Command>,
    stop_latch: Arc<StopLatch>,
    viewers: Arc<Viewers>,
    status: watch::Sender<Arc<StationStatus>>,
    newest: watch::Sender<Option<SharedFrame>>,
    thread: Mutex<Option<JoinHandle<()>>>,
    simulation: Option<TwinControl>,
    camera_details: Arc<Mutex<Option<Arc<dyn CameraDetails>>>>,
}

/// How long a live view continues unwatched.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Watch {
    /// Time until the view ends.
    pub view: Duration,
    /// Time until its light is turned off.
    pub light: Duration,
}

impl Default for Watch {
    fn default() -> Self {
        Self { view: LIVE_UNWATCHED, light: LIVE_LIGHT_UNWATCHED }
    }
}

/// Purpose for which the station is taken, shown to people.
#[derive(Debug, Clone)]
pub struct Purpose {
    /// The job's id.
    pub job_id: String,
    /// Activity in the operator's words: "scanning".
    pub activity: String,
    /// When it was authorised, see [`StationHandle::stop_epoch`].
    pub epoch: StopEpoch,
}

/// A requested Stop; resolves once the devices have acknowledged it.
pub struct StopAcknowledgement(oneshot::Receiver<Result<(), StationRefusal>>);

impl StopAcknowledgement {
    /// Returns once the devices have acknowledged the stop.
    ///
    /// # Errors
    /// A device did not accept the command, or the station is shutting down.
    pub async fn done(self) -> Result<(), StationRefusal> {
        self.0.await.unwrap_or(Err(StationRefusal::ShuttingDown))
    }
}

/// A person's single command; refused while a job has the station.
#[derive(Debug, Clone)]
pub enum Manual {
    /// Home the stage.
    Home,
    /// Move to a position.
    Move {
        /// Target position.
        target_mm: f64,
        /// Highest speed; `None` for the stage's highest.
        speed_mm_s: Option<f64>,
    },
    /// Move while this is repeated; stops within 300 ms of silence.
    Jog {
        /// Signed speed.
        velocity_mm_s: f64,
    },
    /// Configure the camera.
    Configure(CameraRequest),
    /// Turn the laser on with a fraction of full power while frames arrive; 0 turns it off.
    Laser {
        /// 0–1.
        power: f64,
    },
    /// Acknowledge faults and reconnect devices.
    Reset,
}

/// Requested state of the live view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveRequest {
    /// Whether it runs.
    pub running: bool,
    /// Fraction of full laser power; 0 is off.
    pub laser_power: f64,
}

/// A continuous run: the stage moves at constant speed while the camera exposes at its own rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// First position of interest; the station adds the run-up.
    pub from_mm: f64,
    /// Last position of interest.
    pub to_mm: f64,
    /// Speed.
    pub speed_mm_s: f64,
    /// Frames per second.
    pub frame_rate_hz: f64,
}

impl StationHandle {
    /// Starts the station thread and waits until it has tried to open its devices. A device missing then is a fault in
    /// the status; a reset tries again. `halted`: it was stopped in an earlier process and not reset since.
    pub fn start(devices: &StationDevices, halted: bool) -> Self {
        Self::start_with(devices.clone(), Watch::default(), halted)
    }

    /// Starts the station thread with any simulated station.
    pub fn over_twin(twin: twin::TwinStation) -> Self {
        Self::start(&StationDevices::over(twin), false)
    }

    /// As [`StationHandle::start`], with the times after which an unwatched live view ends.
    pub(crate) fn start_with(devices: StationDevices, watch: Watch, halted: bool) -> Self {
        let simulation = devices.twin.as_deref().and_then(TwinDriver::control);
        let (commands, receiver) = sync_channel(COMMAND_CAPACITY);
        let (opened, first_opening) = sync_channel(1);
        let (stop_latch, viewers) = (Arc::new(StopLatch::new(halted)), Arc::new(Viewers::default()));
        let first_state = if halted { MachineState::Halted } else { MachineState::Preoperational };
        let status = watch::Sender::new(Arc::new(first_status(devices.simulated(), first_state)));
        let newest = watch::Sender::new(None);
        let camera_details = Arc::default();
        let publisher = StatusPublisher {
            status: status.clone(),
            newest: newest.clone(),
            stop_latch: stop_latch.clone(),
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
        let guarded = stop_latch.clone();
        let guard = move || guarded.guard(STOP_GUARD_DELAY);
        if let Err(error) = std::thread::Builder::new().name("station-stop".to_owned()).spawn(guard) {
            tracing::error!(%error, "the stop guard could not be started");
        }
        // Late devices count as missing; they may still be installed later.
        let _ = first_opening.recv_timeout(START_WAIT);
        let thread = Mutex::new(thread.ok());
        let shared = Shared { commands, stop_latch, viewers, status, newest, thread, simulation, camera_details };
        Self { shared: Arc::new(shared) }
    }

    /// The virtual operator of a simulated station.
    pub fn simulation(&self) -> Option<TwinControl> {
        self.shared.simulation.clone()
    }

    /// The camera's own features and link state, independent of the station; `None` without a camera, or if it has no
    /// features beyond its settings. Calls block as long as the camera does.
    pub fn camera_details(&self) -> Option<Arc<dyn CameraDetails>> {
        self.shared.camera_details.lock().clone()
    }

    /// Last known state of the station.
    pub fn status(&self) -> Arc<StationStatus> {
        self.shared.status.borrow().clone()
    }

    /// Watches the status; only the newest value is kept.
    pub fn watch_status(&self) -> watch::Receiver<Arc<StationStatus>> {
        self.shared.status.subscribe()
    }

    /// Watches the frames of any source; only the newest is kept.
    pub fn watch_frames(&self) -> watch::Receiver<Option<SharedFrame>> {
        self.shared.newest.subscribe()
    }

    /// Records a viewer at that time; the light of a live view is turned off 4 s, the view itself ends 30 s after the
    /// last one.
    pub fn note_viewer(&self, at: Instant) {
        self.shared.viewers.note(at);
    }

    /// Stops motion, turns the laser off and ends all work. Always accepted, and latched from now on: work authorised
    /// before is refused for good, new work until a reset.
    pub fn request_stop(&self, actor: &str) -> StopAcknowledgement {
        let (done, result) = oneshot::channel();
        self.shared.stop_latch.request(StopRequest { actor: actor.to_owned(), done });
        // No wake-up is needed if the channel is full: the thread checks the latch before each command. A thread that
        // has ended stopped its devices at its end; the caller learns this from the sender dropped with the latch.
        if let Err(TrySendError::Disconnected(_)) = self.shared.commands.try_send(Command::Wake) {
            self.shared.stop_latch.begin_stop();
            drop(self.shared.stop_latch.finish_stop());
        }
        StopAcknowledgement(result)
    }

    /// [`StationHandle::request_stop`], and waits until the devices have acknowledged it.
    pub async fn stop(&self, actor: &str) -> Result<(), StationRefusal> {
        self.request_stop(actor).done().await
    }

    /// The current epoch, to be kept with work that is authorised now.
    pub fn stop_epoch(&self) -> StopEpoch {
        self.shared.stop_latch.epoch()
    }

    /// Whether it was stopped and not reset since.
    pub fn is_halted(&self) -> bool {
        self.shared.stop_latch.is_latched()
    }

    /// Reports a failure outside the station: motion and light end, and a fault states what a person has to do.
    pub fn alarm(&self, fault: Fault) {
        // If the thread has ended, light and motion are off already.
        let _ = self.shared.commands.send(Command::Alarm(fault));
    }

    /// Carries out a person's single command; returns once it was accepted, while moves continue.
    pub async fn manual(&self, command: Manual) -> Result<Option<AcceptedMove>, StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::Manual(command, reply))?;
        answer.await.unwrap_or_else(|_| Err(self.unanswered_reason()))
    }

    /// Starts or ends the live view.
    pub async fn live(&self, request: LiveRequest) -> Result<(), StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::Live(request, reply))?;
        answer.await.unwrap_or_else(|_| Err(self.unanswered_reason()))
    }

    /// One frame with the current camera settings: the newest of a running view, else a single exposure.
    pub async fn snapshot(&self) -> Result<SharedFrame, StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::Snapshot(reply))?;
        answer.await.unwrap_or_else(|_| Err(self.unanswered_reason()))
    }

    /// Receives every frame from now on, for one recording at a time. The station does not wait for the receiver.
    ///
    /// # Errors
    /// [`StationRefusal::Busy`] while there is another tap.
    pub async fn tap(&self) -> Result<FrameTap, StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::Tap(reply))?;
        answer.await.unwrap_or_else(|_| Err(self.unanswered_reason()))
    }

    /// Closes the tap; frames already queued can still be taken.
    ///
    /// # Errors
    /// [`StationRefusal::ShuttingDown`]: the tap is closed in that case, too.
    pub async fn close_tap(&self) -> Result<(), StationRefusal> {
        let (reply, answer) = Reply::awaited();
        self.send(Command::CloseTap(reply))?;
        answer.await.unwrap_or_else(|_| Err(self.unanswered_reason()))
    }

    /// Sets whether a calibration is active, which a scan requires.
    pub fn calibration_changed(&self, active: bool) {
        // A thread that has ended does not need it.
        let _ = self.shared.commands.send(Command::CalibrationChanged(active));
    }

    /// Corrects the frames exposed after this by a dark frame, or not. Every receiver gets them corrected.
    pub fn set_dark_frame(&self, dark: Option<Arc<CameraDarkFrame>>) {
        // A thread that has ended has no frames.
        let _ = self.shared.commands.send(Command::DarkFrame(dark));
    }

    /// Takes the station for a job. Ends a running live view; refused while another job has it or it is in error.
    pub fn lease(&self, purpose: Purpose) -> Result<StationLease, StationRefusal> {
        let (reply, answer) = Reply::blocking();
        self.send(Command::Lease(purpose, reply))?;
        let lease = answer.recv().unwrap_or_else(|_| Err(self.unanswered_reason()))?;
        Ok(StationLease::new(self.clone(), lease))
    }

    /// Turns the laser off, stops the stage, closes the devices and ends the thread; returns when it has ended.
    pub fn shut_down(&self) {
        // It may already have ended.
        let _ = self.shared.commands.send(Command::ShutDown);
        let thread = self.shared.thread.lock().take();
        if let Some(thread) = thread
            && thread.join().is_err()
        {
            tracing::error!("the station thread panicked");
        }
    }

    pub(crate) fn send(&self, command: Command) -> Result<(), StationRefusal> {
        self.shared.commands.try_send(command).map_err(|error| match error {
            TrySendError::Full(_) => StationRefusal::TooManyCommands,
            TrySendError::Disconnected(_) => StationRefusal::ShuttingDown,
        })
    }

    /// Releases a lease; waits for room in the channel, because this command must not be lost. Returns `false` if the
    /// thread has ended.
    pub(crate) fn release(&self, command: Command) -> bool {
        self.shared.commands.send(command).is_ok()
    }

    /// Why a call was not answered: a panic during its handling, or the end of the thread.
    pub(crate) fn unanswered_reason(&self) -> StationRefusal {
        match self.status().faults.first() {
            Some(fault) => StationRefusal::InError { detail: fault.detail.clone(), remedy: fault.remedy.clone() },
            None => StationRefusal::ShuttingDown,
        }
    }
}
