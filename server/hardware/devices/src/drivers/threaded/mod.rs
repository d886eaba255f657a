//! A camera with a blocking driver, run on its own thread, so that no call blocks its caller beyond the limit.
//!
//! Vendor libraries and disks may take arbitrarily long to answer. [`ThreadedCamera`] passes every call to a thread and
//! waits for the answer as long as the rules of [`Camera`] allow; later results are reported later. If a call has not
//! returned after [`HANG_LIMIT`], the camera counts as gone until the call returns and the camera is reconnected.
//!
//! Queues are bounded: at most [`ORDERS`] calls and one frame are pending. Exposures while no frame is requested wait
//! in the driver's own ring buffer, and the driver counts overruns in [`FrameInfo::lost_before`]. A frame of an ended
//! acquisition is discarded.

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
/// which the driver itself observes unless it is late.
const ANSWER_WAIT: Duration = Duration::from_millis(15);

/// Duration after which a pending call counts as hung: the loss of a camera must be reported within two seconds.
pub const HANG_LIMIT: Duration = Duration::from_millis(1500);

/// Most calls queued for the thread: more than a station makes in [`HANG_LIMIT`] without an answer.
pub const ORDERS: usize = 16;

/// Reason reported for a camera that is being reconnected.
const REACHED_AGAIN: &str = "it is being reconnected";

/// A command for the thread.
#[derive(Debug, Clone, Copy)]
enum Order {
    Configure(CameraRequest),
    Start,
    Trigger,
    Stop,
    Reconnect,
}

impl Order {
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

struct Desk {
    orders: VecDeque<(u64, Order)>,
    n_orders: u64,
    /// The answer that a caller is waiting for.
    awaited: Option<u64>,
    answer: Option<Result<(), CameraError>>,
    /// An error of a call whose caller no longer waited; the next frame request gets it.
    late: Option<CameraError>,
    frame_request: Option<FrameRequest>,
    /// Whether a frame request is pending.
    wished: bool,
    delivery: Option<Delivery>,
    /// Counts acquisitions; frames requested in an earlier one are discarded.
    acquisition: u64,
    /// The call in progress.
    busy: Option<(&'static str, Instant)>,
    /// Settings as the camera last reported them, or as it is expected to take them.
    settings: CameraSettings,
    /// Why the camera hung, until it is reconnected.
    gone: Option<String>,
    /// Reconnected, but the driver has not answered a frame request since: whether the camera is present is unknown.
    is_unproven: bool,
    closed: bool,
    ended: bool,
}

struct Shared {
    desk: Mutex<Desk>,
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
        let desk = Desk {
            orders: VecDeque::with_capacity(ORDERS),
            n_orders: 0,
            awaited: None,
            answer: None,
            late: None,
            frame_request: None,
            wished: false,
            delivery: None,
            acquisition: 0,
            busy: None,
            settings: camera.settings(),
            gone: None,
            is_unproven: false,
            closed: false,
            ended: false,
        };
        let shared = Arc::new(Shared { desk: Mutex::new(desk), to_do: Condvar::new(), done: Condvar::new() });
        let ending = Ending(shared.clone());
        // If the thread cannot be created, the closure is dropped, and its guard marks the driver as ended.
        let _ = std::thread::Builder::new().name("camera".to_owned()).spawn(move || ending.0.run(camera));
        Self { shared, identity, capabilities, details, started: false }
    }

    /// Passes `order` to the thread and waits for its answer as long as a call may take.
    fn order(&self, order: Order) -> Result<(), CameraError> {
        let mut desk = self.shared.lock();
        let must_be_taken = matches!(order, Order::Stop | Order::Reconnect);
        if !must_be_taken {
            desk.check()?;
        }
        if desk.orders.len() >= ORDERS {
            return Err(gone(format!("{ORDERS} calls wait for its driver")));
        }
        desk.n_orders += 1;
        let number = desk.n_orders;
        desk.orders.push_back((number, order));
        (desk.awaited, desk.answer) = (Some(number), None);
        if must_be_taken {
            desk.discard_frames();
        }
        desk.is_unproven |= matches!(order, Order::Reconnect);
        self.shared.to_do.notify_one();
        let deadline = Instant::now() + ANSWER_WAIT;
        while desk.answer.is_none() && !desk.ended && desk.hang().is_none() {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            desk = self.shared.wait(&self.shared.done, desk, left);
        }
        desk.awaited = None;
        // The error of a call that takes longer comes with the next frame.
        desk.answer.take().unwrap_or(Ok(()))
    }
}

impl Desk {
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
            return Err(gone("its driver ended by a defect".to_owned()));
        }
        if let Some(reason) = self.hang() {
            self.gone = Some(reason);
        }
        self.gone.clone().map_or(Ok(()), |reason| Err(gone(reason)))
    }

    /// Discards frames requested before.
    fn discard_frames(&mut self) {
        self.acquisition += 1;
        (self.frame_request, self.wished, self.delivery) = (None, false, None);
    }
}

fn gone(reason: String) -> CameraError {
    CameraError::Gone { reason }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock()
    }

    fn wait<'d>(&self, on: &Condvar, mut desk: MutexGuard<'d, Desk>, limit: Duration) -> MutexGuard<'d, Desk> {
        on.wait_for(&mut desk, limit);
        desk
    }

    /// The thread: executes one call after the other, commands before frames, until the camera is closed.
    fn run(&self, mut camera: impl Camera) {
        let mut desk = self.lock();
        while !desk.closed {
            if let Some((number, order)) = desk.orders.pop_front() {
                desk.busy = Some((order.name(), Instant::now()));
                drop(desk);
                let outcome = obey(&mut camera, order);
                desk = self.lock();
                desk.busy = None;
                if matches!(order, Order::Configure(_) | Order::Reconnect) {
                    desk.settings = camera.settings();
                }
                if matches!(order, Order::Reconnect) && outcome.is_ok() {
                    (desk.gone, desk.late, desk.is_unproven) = (None, None, true);
                }
                if desk.awaited == Some(number) {
                    desk.answer = Some(outcome);
                } else if let Err(error) = outcome {
                    desk.late = Some(error);
                }
            } else if let Some(FrameRequest { timeout, mut image }) = desk.frame_request.take() {
                desk.busy = Some(("next_frame", Instant::now()));
                let acquisition = desk.acquisition;
                drop(desk);
                let outcome = camera.next_frame(&mut image, timeout);
                desk = self.lock();
                desk.busy = None;
                if desk.acquisition == acquisition {
                    desk.is_unproven &= outcome.is_err();
                    (desk.wished, desk.delivery) = (false, Some(Delivery { image, outcome }));
                }
            } else {
                self.to_do.wait(&mut desk);
                continue;
            }
            self.done.notify_all();
        }
    }
}

fn obey(camera: &mut impl Camera, order: Order) -> Result<(), CameraError> {
    match order {
        Order::Configure(wanted) => camera.configure(&wanted).map(drop),
        Order::Start => camera.start(),
        Order::Trigger => camera.trigger(),
        Order::Stop => camera.stop(),
        Order::Reconnect => camera.reconnect(),
    }
}

/// Notifies all waiters that the thread has ended, also by a panic.
struct Ending(Arc<Shared>);

impl Drop for Ending {
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

    /// Returns what the camera accepted; for a slow camera the values expected from its capabilities, until it answers.
    /// Requests that the capabilities exclude are refused without asking it.
    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        let before = self.settings();
        self.shared.lock().settings = self.capabilities.expected(&before, wanted)?;
        let outcome = self.order(Order::Configure(*wanted));
        let mut desk = self.shared.lock();
        if outcome.is_err() {
            // Refused: nothing has changed.
            desk.settings = before;
        }
        outcome.map(|()| desk.settings)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.started = false;
        self.order(Order::Start)?;
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
        self.order(Order::Trigger)
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        let mut desk = self.shared.lock();
        desk.check()?;
        if let Some(error) = desk.late.take() {
            return Err(error);
        }
        if desk.delivery.is_none() && !desk.wished {
            // The memory is returned with the frame.
            let image = std::mem::replace(image, no_image());
            (desk.frame_request, desk.wished) = (Some(FrameRequest { timeout, image }), true);
            self.shared.to_do.notify_one();
        }
        let deadline = Instant::now() + timeout + ANSWER_WAIT;
        while desk.delivery.is_none() && !desk.ended {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                desk.check()?;
                return if desk.is_unproven { Err(gone(REACHED_AGAIN.to_owned())) } else { Ok(None) };
            }
            desk = self.shared.wait(&self.shared.done, desk, left);
        }
        desk.check()?;
        let Some(delivery) = desk.delivery.take() else { return Ok(None) };
        *image = delivery.image;
        delivery.outcome
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.started = false;
        self.order(Order::Stop)
    }

    fn reconnect(&mut self) -> Result<(), CameraError> {
        self.started = false;
        self.order(Order::Reconnect)
    }
}

impl Drop for ThreadedCamera {
    /// Closes the camera; a hung one closes when its call returns.
    fn drop(&mut self) {
        let mut desk = self.shared.lock();
        desk.closed = true;
        self.shared.to_do.notify_one();
        let deadline = Instant::now() + ANSWER_WAIT;
        while !desk.ended && Instant::now() < deadline {
            desk = self.shared.wait(&self.shared.done, desk, ANSWER_WAIT);
        }
    }
}

fn no_image() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel for one pixel")
}
