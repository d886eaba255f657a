//! A laser on an output line of the camera.
//!
//! On, the line outputs a signal of the camera: its exposures (`ExposureActive`), so that the laser is on only while
//! the sensor is exposed, or a user output (`UserOutput1`). Off, it outputs `Off`, or an inactive user output. A
//! separate thread writes to the camera, handles the lease, and reads back: a signal that was not requested, as after a
//! restart of the camera, is turned off.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use devices::{DeviceIdentity, LASER_LEASE_LIMIT, Laser, LaserCapabilities, LaserError, LaserState, StopHandle};
use parking_lot::{Condvar, Mutex, MutexGuard};

use crate::opened::laser_line::{USER_OUTPUT, is_set, set_line};
use crate::settings::GenicamSettings;
use crate::shared::Shared;

/// How long a caller waits for the camera, a part of [`devices::CALL_LIMIT`].
const ANSWER_WAIT: Duration = Duration::from_millis(15);

/// Interval at which the line is read back.
const POLL_INTERVAL: Duration = Duration::from_millis(200);

/// A laser on an output line of the camera (see the module). Dropping it turns the laser off.
pub struct GenicamLaser {
    identity: DeviceIdentity,
    line: Arc<Line>,
}

struct Line {
    settings: GenicamSettings,
    shared: Arc<Shared>,
    state: Mutex<LineState>,
    changed: Condvar,
}

#[derive(Default)]
struct LineState {
    on_until: Option<Instant>,
    /// The state last confirmed by the camera; `None` if unknown.
    confirmed: Option<bool>,
    /// Why the camera did not accept it; persists until a reconnection.
    fault: Option<String>,
    is_closed: bool,
    has_ended: bool,
}

impl LineState {
    fn is_requested(&self, now: Instant) -> bool {
        self.fault.is_none() && !self.is_closed && self.on_until.is_some_and(|until| now < until)
    }

    fn state(&self) -> Result<LaserState, LaserError> {
        if let Some(reason) = &self.fault {
            return Err(LaserError::Disconnected { reason: reason.clone() });
        }
        let emitting = self.is_requested(Instant::now()) || self.confirmed == Some(true);
        Ok(LaserState { emitting, power: if emitting { 1.0 } else { 0.0 }, interlock_closed: None })
    }
}

impl GenicamLaser {
    /// The laser on the configured line of the open camera.
    pub(crate) fn over(settings: &GenicamSettings, shared: Arc<Shared>, camera: &DeviceIdentity) -> Self {
        let model = format!("{} of {}", settings.laser_line, camera.model);
        let identity = DeviceIdentity { model, ..camera.clone() };
        let line = Line { settings: settings.clone(), shared, state: Mutex::default(), changed: Condvar::new() };
        let line = Arc::new(line);
        let on_thread = line.clone();
        let spawned = thread::Builder::new().name("genicam-laser".to_owned()).spawn(move || on_thread.run());
        if let Err(error) = spawned {
            line.locked().fault = Some(format!("its thread could not be created: {error}"));
        }
        Self { identity, line }
    }
}

impl Line {
    fn locked(&self) -> MutexGuard<'_, LineState> {
        self.state.lock()
    }

    /// Changes the requested state, and waits for the camera for at most [`ANSWER_WAIT`].
    fn request(&self, change: impl FnOnce(&mut LineState)) -> Result<LaserState, LaserError> {
        let mut state = self.locked();
        change(&mut state);
        self.changed.notify_all();
        let is_pending = |state: &mut LineState| {
            state.fault.is_none() && state.confirmed != Some(state.is_requested(Instant::now()))
        };
        self.changed.wait_while_for(&mut state, is_pending, ANSWER_WAIT);
        state.state()
    }

    /// The thread: sets the line as requested, until the laser is closed and off.
    fn run(&self) {
        let mut state = self.locked();
        loop {
            let requested = state.is_requested(Instant::now());
            drop(state);
            let outcome = self.set_line(requested);
            state = self.locked();
            match outcome {
                Ok(()) => state.confirmed = Some(requested),
                Err(reason) => {
                    (state.confirmed, state.on_until) = (None, None);
                    state.fault.get_or_insert(reason);
                }
            }
            self.changed.notify_all();
            if state.is_closed {
                state.has_ended = true;
                self.changed.notify_all();
                return;
            }
            let time_left =
                state.on_until.map_or(POLL_INTERVAL, |until| until.saturating_duration_since(Instant::now()));
            let is_unchanged =
                |state: &mut LineState| !state.is_closed && requested == state.is_requested(Instant::now());
            self.changed.wait_while_for(&mut state, is_unchanged, time_left.min(POLL_INTERVAL));
        }
    }

    fn set_line(&self, on: bool) -> Result<(), String> {
        let opened = self.shared.opened.lock();
        let device = &opened.as_ref().ok_or("its camera is disconnected")?.device;
        if is_set(device, &self.settings, on) {
            return Ok(());
        }
        set_line(device, &self.settings, on).map_err(|error| error.to_string())
    }
}

impl StopHandle for Line {
    fn stop_now(&self) {
        self.locked().on_until = None;
        self.changed.notify_all();
    }
}

impl Laser for GenicamLaser {
    fn identity(&self) -> DeviceIdentity {
        self.identity.clone()
    }

    fn capabilities(&self) -> LaserCapabilities {
        LaserCapabilities::default()
    }

    fn lost_host(&self) -> &'static str {
        match self.line.settings.laser_source.starts_with(USER_OUTPUT) {
            true => "the laser stays on until the camera is switched off",
            false => "the laser flashes with the camera's exposures until the camera stops or is switched off",
        }
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        if !(power > 0.0 && power <= 1.0) {
            return Err(LaserError::BadPower { value: power });
        }
        let until = Instant::now() + lease.min(LASER_LEASE_LIMIT);
        self.line.request(|state| state.on_until = Some(until))
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        let now = Instant::now();
        let mut state = self.line.locked();
        if state.is_requested(now) {
            state.on_until = Some(now + lease.min(LASER_LEASE_LIMIT));
        }
        state.state()
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        self.line.request(|state| state.on_until = None).map(drop)
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        Some(self.line.clone())
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        self.line.locked().state()
    }

    /// The camera's own reconnection restores the line; here its fault is acknowledged, and detected again if it
    /// persists.
    fn reconnect(&mut self) -> Result<(), LaserError> {
        let mut state = self.line.locked();
        (state.fault, state.on_until, state.confirmed) = (None, None, None);
        self.line.changed.notify_all();
        Ok(())
    }
}

impl Drop for GenicamLaser {
    fn drop(&mut self) {
        let mut state = self.line.locked();
        state.is_closed = true;
        self.line.changed.notify_all();
        // Longer than a call may take, because the laser cannot be turned off later.
        self.line.changed.wait_while_for(&mut state, |state| !state.has_ended, 20 * ANSWER_WAIT);
    }
}
