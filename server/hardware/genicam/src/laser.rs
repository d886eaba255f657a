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

use crate::opened::laser_line::{USER_OUTPUT, is_shown, show};
use crate::settings::GenicamSettings;
use crate::shared::Shared;

/// How long a caller waits for the camera, a part of [`devices::CALL_LIMIT`].
const ANSWER_WAIT: Duration = Duration::from_millis(15);

/// Interval at which the line is read back.
const LOOK: Duration = Duration::from_millis(200);

/// See the module. Dropping it turns it off.
pub struct GenicamLaser {
    identity: DeviceIdentity,
    line: Arc<Line>,
}

struct Line {
    settings: GenicamSettings,
    shared: Arc<Shared>,
    desk: Mutex<Desk>,
    changed: Condvar,
}

#[derive(Default)]
struct Desk {
    lit_until: Option<Instant>,
    /// The state last accepted by the camera; `None` if unknown.
    shows: Option<bool>,
    /// Why the camera did not accept it; persists until a reconnection.
    fault: Option<String>,
    is_closed: bool,
    has_ended: bool,
}

impl Desk {
    fn is_wanted(&self, now: Instant) -> bool {
        self.fault.is_none() && !self.is_closed && self.lit_until.is_some_and(|until| now < until)
    }

    fn state(&self) -> Result<LaserState, LaserError> {
        if let Some(reason) = &self.fault {
            return Err(LaserError::Gone { reason: reason.clone() });
        }
        let emitting = self.is_wanted(Instant::now()) || self.shows == Some(true);
        Ok(LaserState { emitting, power: if emitting { 1.0 } else { 0.0 }, interlock_closed: None })
    }
}

impl GenicamLaser {
    /// The laser on the configured line of the open camera.
    pub(crate) fn over(settings: &GenicamSettings, shared: Arc<Shared>, camera: &DeviceIdentity) -> Self {
        let model = format!("{} of {}", settings.laser_line, camera.model);
        let identity = DeviceIdentity { model, ..camera.clone() };
        let line = Line { settings: settings.clone(), shared, desk: Mutex::default(), changed: Condvar::new() };
        let line = Arc::new(line);
        let on_thread = line.clone();
        let spawned = thread::Builder::new().name("genicam-laser".to_owned()).spawn(move || on_thread.run());
        if let Err(error) = spawned {
            line.desk().fault = Some(format!("no thread for it: {error}"));
        }
        Self { identity, line }
    }
}

impl Line {
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock()
    }

    /// Changes the requested state, and waits for the camera as long as a call may.
    fn want(&self, change: impl FnOnce(&mut Desk)) -> Result<LaserState, LaserError> {
        let mut desk = self.desk();
        change(&mut desk);
        self.changed.notify_all();
        let is_due = |desk: &mut Desk| desk.fault.is_none() && desk.shows != Some(desk.is_wanted(Instant::now()));
        self.changed.wait_while_for(&mut desk, is_due, ANSWER_WAIT);
        desk.state()
    }

    /// The thread: sets the line as requested, until the laser is closed and off.
    fn run(&self) {
        let mut desk = self.desk();
        loop {
            let wanted = desk.is_wanted(Instant::now());
            drop(desk);
            let shown = self.show(wanted);
            desk = self.desk();
            match shown {
                Ok(()) => desk.shows = Some(wanted),
                Err(reason) => {
                    (desk.shows, desk.lit_until) = (None, None);
                    desk.fault.get_or_insert(reason);
                }
            }
            self.changed.notify_all();
            if desk.is_closed {
                desk.has_ended = true;
                self.changed.notify_all();
                return;
            }
            let until_end = desk.lit_until.map_or(LOOK, |until| until.saturating_duration_since(Instant::now()));
            let is_as_wanted = |desk: &mut Desk| !desk.is_closed && wanted == desk.is_wanted(Instant::now());
            self.changed.wait_while_for(&mut desk, is_as_wanted, until_end.min(LOOK));
        }
    }

    fn show(&self, lit: bool) -> Result<(), String> {
        let opened = self.shared.opened.lock();
        let device = &opened.as_ref().ok_or("its camera is gone")?.device;
        if is_shown(device, &self.settings, lit) {
            return Ok(());
        }
        show(device, &self.settings, lit).map_err(|error| error.to_string())
    }
}

impl StopHandle for Line {
    fn stop_now(&self) {
        self.desk().lit_until = None;
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
        self.line.want(|desk| desk.lit_until = Some(until))
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        let now = Instant::now();
        let mut desk = self.line.desk();
        if desk.is_wanted(now) {
            desk.lit_until = Some(now + lease.min(LASER_LEASE_LIMIT));
        }
        desk.state()
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        self.line.want(|desk| desk.lit_until = None).map(drop)
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        Some(self.line.clone())
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        self.line.desk().state()
    }

    /// The camera's own reconnection restores the line; here its fault is acknowledged, and detected again if it
    /// persists.
    fn reconnect(&mut self) -> Result<(), LaserError> {
        let mut desk = self.line.desk();
        (desk.fault, desk.lit_until, desk.shows) = (None, None, None);
        self.line.changed.notify_all();
        Ok(())
    }
}

impl Drop for GenicamLaser {
    fn drop(&mut self) {
        let mut desk = self.line.desk();
        desk.is_closed = true;
        self.line.changed.notify_all();
        // Longer than a call may take: this is the last opportunity.
        self.line.changed.wait_while_for(&mut desk, |desk| !desk.has_ended, 20 * ANSWER_WAIT);
    }
}
