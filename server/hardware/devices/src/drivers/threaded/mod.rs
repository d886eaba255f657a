//! A camera with a blocking driver, run on its own thread, so that no call blocks its caller beyond the limit.
//!
//! Vendor libraries and disks may take arbitrarily long to answer. [`ThreadedCamera`] passes every call to a thread and
//! waits for the answer as long as the rules of [`Camera`] allow; later results are reported later. If a call has not
//! returned after [`HANG_LIMIT`], the camera counts as gone until the call returns and the camera is reconnected.
//!
//! Queues are bounded: at most [`QUEUE_LIMIT`] calls and one frame are pending. Exposures while no frame is requested
//! wait in the driver's own ring buffer, and the driver counts overruns in [`FrameInfo::lost_before`]. A frame of an
//! ended acquisition is discarded.

#[cfg(test)]
mod tests;

use parking_lot::{Condvar, Mutex, MutexGuard};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use vision::{GreyImage, Pixels};

use crate::traits::features::CameraDetails;
use crate::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity, FrameInfo, Trigger,
};

/// How long a caller waits for an answer, a part of [`crate::CALL_LIMIT`]; for a frame this is added to its timeout,
/// which the driver itself observes unless it is deferred to the next use.
const ANSWER_WAIT: Duration = Duration::from_millis(15);

/// Duration after which a pending call counts as hung: the loss of a camera must be reported within two seconds.
pub const HANG_LIMIT: Duration = Duration::from_millis(1500);

/// Most calls queued for the thread: more than a station makes in [`HANG_LIMIT`] without an answer.
pub const QUEUE_LIMIT: usize = 16;

/// Reason reported for a camera that is being reconnected.
const RECONNECTING: &str = "it is being reconnected";

/// A command for the thread.
#[derive(Debug, Clone, Copy)]
enum Command {
    Configure(CameraRequest),
    Start,
    Trigger,
    Stop,
    Reconnect,
}

impl Command {
    fn name(self) -> &'static str {
        match self {
            Self::Configure(_) => "configure",
            Self::Start => "start",
            Self::Trigger => "trigger",
            Self::Stop => "stop",
            Self::Reconnect => "reconnect",
        }
    }
}

/// A frame request.
struct FrameRequest {
    timeout: Duration,
    /// Memory for the frame.
    image: GreyImage,
}

/// The result of a frame request.
struct Delivery {
    image: GreyImage,
    outcome: Result<Option<FrameInfo>, CameraError>,
}

struct State {
    commands: VecDeque<(u64, Command)>,
    n_commands: u64,
    /// The answer that a caller is waiting for.
    awaited: Option<u64>,
    answer: Option<Result<(), CameraError>>,
    /// An error of a call whose caller no longer waited; the next frame request gets it.
    deferred_error: Option<CameraError>,
    frame_request: Option<FrameRequest>,
    /// Whether a frame request is pending.
    frame_pending: bool,
    delivery: Option<Delivery>,
    /// Counts acquisitions; frames requested in an earlier one are discarded.
    acquisition: u64,
    /// The call in progress.
    busy: Option<(&'static str, Instant)>,
    /// Settings as the camera last reported them, or as it is expected to take them.
    settings: CameraSettings,
    /// As the camera last reported it.
    n_incomplete: u64,
    /// Why the camera hung, until it is reconnected.
    gone: Option<String>,
    /// Reconnected, but the driver has not answered a frame request since: whether the camera is present is unknown.
    is_unconfirmed: bool,
    closed: bool,
    ended: bool,
}

struct Shared {
    state: Mutex<State>,
    to_do: Condvar,
    done: Condvar,
}

/// See the module.
pub struct ThreadedCamera {
    shared: Arc<Shared>,
    identity: DeviceIdentity,
    capabilities: CameraCapabilities,
    details: Option<Arc<dyn CameraDetails>>,
    /// Whether acquisition is running.
    started: bool,
}

impl ThreadedCamera {
    /// Gives an open camera a thread of its own.
    pub fn over(camera: impl Camera + 'static) -> Self {
        let (identity, capabilities) = (camera.identity(), camera.capabilities());
        let details = camera.details();
        let state = State {
            commands: VecDeque::with_capacity(QUEUE_LIMIT),
            n_commands: 0,
            awaited: None,
            answer: None,
            deferred_error: None,
            frame_request: None,
            frame_pending: false,
            delivery: None,
            acquisition: 0,
            busy: None,
            settings: camera.settings(),
            n_incomplete: 0,
            gone: None,
            is_unconfirmed: false,
            closed: false,
            ended: false,
        };
        let shared = Arc::new(Shared { state: Mutex::new(state), to_do: Condvar::new(), done: Condvar::new() });
        let ending = EndGuard(shared.clone());
        // If the thread cannot be created, the closure is dropped, and its guard marks the driver as ended.
        let _ = std::thread::Builder::new().name("camera".to_owned()).spawn(move || ending.0.run(camera));
        Self { shared, identity, capabilities, details, started: false }
    }

    /// Passes `command` to the thread and waits for its answer as long as a call may take.
    fn command(&self, command: Command) -> Result<(), CameraError> {
        let mut state = self.shared.lock();
        let must_be_taken = matches!(command, Command::Stop | Command::Reconnect);
        if !must_be_taken {
            state.check()?;
        }
        if state.commands.len() >= QUEUE_LIMIT {
            return Err(gone(format!("{QUEUE_LIMIT} calls wait for its driver")));
        }
        state.n_commands += 1;
        let number = state.n_commands;
        state.commands.push_back((number, command));
        (state.awaited, state.answer) = (Some(number), None);
        if must_be_taken {
            state.discard_frames();
        }
        state.is_unconfirmed |= matches!(command, Command::Reconnect);
        self.shared.to_do.notify_one();
        let deadline = Instant::now() + ANSWER_WAIT;
        while state.answer.is_none() && !state.ended && state.hang().is_none() {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            state = self.shared.wait(&self.shared.done, state, left);
        }
        state.awaited = None;
        // The error of a call that takes longer comes with the next frame.
        state.answer.take().unwrap_or(Ok(()))
    }
}

impl State {
    /// Describes the hung call, if there is one.
    fn hang(&self) -> Option<String> {
        let (call, since) = self.busy?;
        let hangs = since.elapsed();
        (hangs >= HANG_LIMIT)
            .then(|| format!("its driver has not returned from `{call}` for {:.1} s", hangs.as_secs_f64()))
    }

    /// Detects a hang; it persists until the camera is reconnected.
    fn check(&mut self) -> Result<(), CameraError> {
        if self.ended {
            return Err(gone("its driver failed".to_owned()));
        }
        if let Some(reason) = self.hang() {
            self.gone = Some(reason);
        }
        self.gone.clone().map_or(Ok(()), |reason| Err(gone(reason)))
    }

    /// Discards frames requested before.
    fn discard_frames(&mut self) {
        self.acquisition += 1;
        (self.frame_request, self.frame_pending, self.delivery) = (None, false, None);
    }
}

fn gone(reason: String) -> CameraError {
    CameraError::Disconnected { reason }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }

    fn wait<'d>(&self, on: &Condvar, mut state: MutexGuard<'d, State>, limit: Duration) -> MutexGuard<'d, State> {
        on.wait_for(&mut state, limit);
        state
    }

    /// The thread: executes one call after the other, commands before frames, until the camera is closed.
    fn run(&self, mut camera: impl Camera) {
        let mut state = self.lock();
        while !state.closed {
            if let Some((number, command)) = state.commands.pop_front() {
                state.busy = Some((command.name(), Instant::now()));
                drop(state);
                let outcome = execute(&mut camera, command);
                state = self.lock();
                state.busy = None;
                if matches!(command, Command::Configure(_) | Command::Reconnect) {
                    state.settings = camera.settings();
                }
                if matches!(command, Command::Reconnect) && outcome.is_ok() {
                    (state.gone, state.deferred_error, state.is_unconfirmed) = (None, None, true);
                }
                if state.awaited == Some(number) {
                    state.answer = Some(outcome);
                } else if let Err(error) = outcome {
                    state.deferred_error = Some(error);
                }
            } else if let Some(FrameRequest { timeout, mut image }) = state.frame_request.take() {
                state.busy = Some(("next_frame", Instant::now()));
                let acquisition = state.acquisition;
                drop(state);
                let outcome = camera.next_frame(&mut image, timeout);
                state = self.lock();
                (state.busy, state.n_incomplete) = (None, camera.n_incomplete());
                if state.acquisition == acquisition {
                    state.is_unconfirmed &= outcome.is_err();
                    (state.frame_pending, state.delivery) = (false, Some(Delivery { image, outcome }));
                }
            } else {
                self.to_do.wait(&mut state);
                continue;
            }
            self.done.notify_all();
        }
    }
}

fn execute(camera: &mut impl Camera, command: Command) -> Result<(), CameraError> {
    match command {
        Command::Configure(wanted) => camera.configure(&wanted).map(drop),
        Command::Start => camera.start(),
        Command::Trigger => camera.trigger(),
        Command::Stop => camera.stop(),
        Command::Reconnect => camera.reconnect(),
    }
}

/// Notifies all waiters that the thread has ended, also by a panic.
struct EndGuard(Arc<Shared>);

impl Drop for EndGuard {
    fn drop(&mut self) {
        self.0.lock().ended = true;
        self.0.done.notify_all();
    }
}

impl Camera for ThreadedCamera {
    fn identity(&self) -> DeviceIdentity {
        self.identity.clone()
    }

    fn capabilities(&self) -> CameraCapabilities {
        self.capabilities.clone()
    }

    fn settings(&self) -> CameraSettings {
        self.shared.lock().settings
    }

    fn details(&self) -> Option<Arc<dyn CameraDetails>> {
        self.details.clone()
    }

    fn n_incomplete(&self) -> u64 {
        self.shared.lock().n_incomplete
    }

    /// Returns what the camera accepted; for a slow camera the values expected from its capabilities, until it answers.
    /// Requests that the capabilities exclude are refused without asking it.
    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        let before = self.settings();
        self.shared.lock().settings = self.capabilities.expected(&before, wanted)?;
        let outcome = self.command(Command::Configure(*wanted));
        let mut state = self.shared.lock();
        if outcome.is_err() {
            // Refused: nothing has changed.
            state.settings = before;
        }
        outcome.map(|()| state.settings)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.started = false;
        self.command(Command::Start)?;
        self.started = true;
        Ok(())
    }

    /// Refused without asking the camera if it is impossible: a slow camera could not answer in time.
    fn trigger(&mut self) -> Result<(), CameraError> {
        self.shared.lock().check()?;
        if self.settings().trigger != Trigger::Software {
            return Err(CameraError::NotTriggerable { reason: "it is not set to software triggers" });
        }
        if !self.started {
            return Err(CameraError::NotTriggerable { reason: "acquisition is not started" });
        }
        self.command(Command::Trigger)
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        let mut state = self.shared.lock();
        state.check()?;
        if let Some(error) = state.deferred_error.take() {
            return Err(error);
        }
        if state.delivery.is_none() && !state.frame_pending {
            // The memory is returned with the frame.
            let image = std::mem::replace(image, no_image());
            (state.frame_request, state.frame_pending) = (Some(FrameRequest { timeout, image }), true);
            self.shared.to_do.notify_one();
        }
        let deadline = Instant::now() + timeout + ANSWER_WAIT;
        while state.delivery.is_none() && !state.ended {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                state.check()?;
                return if state.is_unconfirmed { Err(gone(RECONNECTING.to_owned())) } else { Ok(None) };
            }
            state = self.shared.wait(&self.shared.done, state, left);
        }
        state.check()?;
        let Some(delivery) = state.delivery.take() else { return Ok(None) };
        *image = delivery.image;
        delivery.outcome
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.started = false;
        self.command(Command::Stop)
    }

    fn reconnect(&mut self) -> Result<(), CameraError> {
        self.started = false;
        self.command(Command::Reconnect)
    }
}

impl Drop for ThreadedCamera {
    /// Closes the camera; a hung one closes when its call returns.
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.closed = true;
        self.shared.to_do.notify_one();
        let deadline = Instant::now() + ANSWER_WAIT;
        while !state.ended && Instant::now() < deadline {
            state = self.shared.wait(&self.shared.done, state, ANSWER_WAIT);
        }
    }
}

fn no_image() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel for one pixel")
}
