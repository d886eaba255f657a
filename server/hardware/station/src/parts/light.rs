//! The laser as used by the station thread. It is turned off when no frame is due, whoever requested it and whatever
//! call is in progress, and is turned on again only with the requester's next exposure.

use std::time::Instant;

use devices::{Laser, LaserError, LaserState};

use crate::params::{
    LIGHT_IDLE, LIGHT_LEASE, LIGHT_RENEWAL, LIGHT_UP_LIMIT, POLL_IDLE, POLL_LASER_ON, POLL_LASER_SWITCHING,
};

/// The laser and its requested state.
pub struct Light {
    device: Box<dyn Laser>,
    is_switched: bool,
    state: Option<LaserState>,
    /// Requested fraction of full power; 0 is off.
    requested_power: f64,
    /// When it was switched on; `None` if off, or suspended because its user was idle.
    lit_at: Option<Instant>,
    renewed_at: Instant,
    /// No frame is due after this time.
    needed_until: Instant,
    polled_at: Option<Instant>,
    changed_at: Instant,
    /// Until when switching it on is tried again: its controller was not ready for it.
    retried_until: Option<Instant>,
}

impl Light {
    /// Wraps a laser that was just opened.
    pub fn new(device: Box<dyn Laser>) -> Self {
        let now = Instant::now();
        Self {
            is_switched: device.capabilities().switched,
            device,
            state: None,
            requested_power: 0.0,
            lit_at: None,
            renewed_at: now,
            needed_until: now,
            polled_at: None,
            changed_at: now,
            retried_until: None,
        }
    }

    /// The underlying laser, for calls that do not turn it on.
    pub fn device(&mut self) -> &mut dyn Laser {
        &mut *self.device
    }

    /// Whether the laser can be switched.
    pub fn is_switched(&self) -> bool {
        self.is_switched
    }

    /// Last reported state.
    pub fn state(&self) -> Option<LaserState> {
        self.state
    }

    /// Whether light is requested.
    pub fn is_requested(&self) -> bool {
        self.requested_power > 0.0
    }

    /// Whether it reports that it is on.
    pub fn is_on(&self) -> bool {
        self.state.is_some_and(|state| state.emitting)
    }

    /// Whether it reports the requested state.
    pub fn is_as_requested(&self) -> bool {
        self.is_on() == self.is_requested()
    }

    /// Reads the state of a laser that must be off, to check that it works.
    pub fn check_off(&mut self) -> Result<(), LaserError> {
        let state = self.device.poll()?;
        self.take(state, Instant::now());
        Ok(())
    }

    /// Whether it reported that it was on at that time; covers the time since its last change.
    pub fn was_on_at(&self, at: Instant) -> bool {
        self.is_on() == (at >= self.changed_at)
    }

    /// Whether a reading is due.
    fn is_due(&self, now: Instant) -> bool {
        let period = match (self.lit_at.is_some(), self.is_on()) {
            (true, true) => POLL_LASER_ON,
            (false, false) => POLL_IDLE,
            _ => POLL_LASER_SWITCHING,
        };
        self.polled_at.is_none_or(|at| now.saturating_duration_since(at) >= period)
    }

    /// Requests light of this power. Without frames it is suspended soon after it has turned on.
    pub fn request(&mut self, power: f64, now: Instant) -> Result<(), LaserError> {
        if !(power > 0.0 && power <= 1.0) {
            return Err(LaserError::BadPower { value: power });
        }
        let state = match self.device.switch_on(power, LIGHT_LEASE) {
            Err(LaserError::NotYet { .. }) => {
                self.requested_power = power;
                self.retried_until.get_or_insert(now + LIGHT_UP_LIMIT);
                self.needed_until = self.needed_until.max(now + LIGHT_UP_LIMIT + LIGHT_IDLE);
                return Ok(());
            }
            switched => switched?,
        };
        self.retried_until = None;
        self.requested_power = power;
        (self.lit_at, self.renewed_at, self.polled_at) = (Some(now), now, None);
        // Long enough to find out whether it turns on at all.
        self.needed_until = self.needed_until.max(now + LIGHT_UP_LIMIT + LIGHT_IDLE);
        self.take(state, now);
        Ok(())
    }

    /// A frame is due at `due`: requested light stays on until then, or is turned on again for it.
    pub fn serve_frame(&mut self, due: Instant, now: Instant) -> Result<(), LaserError> {
        self.needed_until = self.needed_until.max(due + LIGHT_IDLE);
        if self.is_requested() && self.lit_at.is_none() { self.request(self.requested_power, now) } else { Ok(()) }
    }

    /// A frame already in transfer is due at `due`; suspended light stays off.
    pub fn expect_frame(&mut self, due: Instant) {
        self.needed_until = self.needed_until.max(due + LIGHT_IDLE);
    }

    /// Turns the laser off and clears the request.
    pub fn off(&mut self) -> Result<(), LaserError> {
        self.requested_power = 0.0;
        self.suspend()
    }

    /// Reads the state, and renews the lease or suspends the light.
    ///
    /// # Errors
    /// The error of the laser, or light that went off unexpectedly.
    pub fn update(&mut self, now: Instant) -> Result<(), LaserError> {
        if let Some(until) = self.retried_until {
            return self.retry_switch_on(until, now);
        }
        if self.lit_at.is_some() && now > self.needed_until {
            self.suspend()?;
        }
        if self.lit_at.is_some() && now.saturating_duration_since(self.renewed_at) >= LIGHT_LEASE {
            // This thread was late and the lease expired. This is not a fault of the laser; the next exposure turns it
            // on again.
            self.suspend()?;
        }
        if self.lit_at.is_some() && now - self.renewed_at >= LIGHT_RENEWAL {
            self.renewed_at = now;
            let state = self.device.renew(LIGHT_LEASE)?;
            self.take(state, now);
        }
        if self.is_due(now) {
            self.polled_at = Some(now);
            let was = self.is_on();
            let state = self.device.poll()?;
            self.take(state, now);
            return self.check(was, now);
        }
        Ok(())
    }

    fn retry_switch_on(&mut self, until: Instant, now: Instant) -> Result<(), LaserError> {
        if now > until {
            self.retried_until = None;
            return Err(fault_of_light(DID_NOT_TURN_ON));
        }
        if self.polled_at.is_none_or(|at| now.saturating_duration_since(at) >= POLL_LASER_SWITCHING) {
            self.polled_at = Some(now);
            return self.request(self.requested_power, now);
        }
        Ok(())
    }

    /// Turns the laser off until the requester's next exposure.
    pub fn suspend(&mut self) -> Result<(), LaserError> {
        (self.lit_at, self.polled_at, self.retried_until) = (None, None, None);
        self.device.switch_off()
    }

    fn take(&mut self, state: LaserState, now: Instant) {
        if self.is_on() != state.emitting {
            self.changed_at = now;
            if state.emitting {
                self.needed_until = now + LIGHT_IDLE;
            }
        }
        self.state = Some(state);
    }

    fn check(&self, was_on: bool, now: Instant) -> Result<(), LaserError> {
        let Some(lit_at) = self.lit_at else { return Ok(()) };
        if self.state.is_some_and(|state| state.interlock_closed == Some(false)) {
            return Err(LaserError::InterlockOpen);
        }
        if self.is_on() {
            return Ok(());
        }
        let late = now.saturating_duration_since(lit_at) > LIGHT_UP_LIMIT;
        let went_off = was_on.then_some(("the laser went off unexpectedly", "check laser and cable"));
        match went_off.or(late.then_some(DID_NOT_TURN_ON)) {
            Some(fault) => Err(fault_of_light(fault)),
            None => Ok(()),
        }
    }
}

/// What happened, and the remedy.
const DID_NOT_TURN_ON: (&str, &str) = ("the laser did not turn on", "check laser, key switch and cable");

fn fault_of_light((reason, remedy): (&'static str, &'static str)) -> LaserError {
    LaserError::Fault { reason: reason.to_owned(), remedy }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::tests::bench::small_twin;

    #[test]
    fn a_lease_expired_by_this_thread_is_not_a_fault_and_the_next_exposure_turns_the_laser_on() {
        let twin = small_twin(twin::TwinOptions::default());
        let mut light = Light::new(Box::new(twin.laser()));
        let now = Instant::now();
        light.request(0.5, now).unwrap();
        light.expect_frame(now + LIGHT_LEASE);
        light.update(now + LIGHT_LEASE + Duration::from_millis(1)).unwrap();
        light.check_off().unwrap();
        assert!(!light.is_on() && light.is_requested());
        light.serve_frame(Instant::now(), Instant::now()).unwrap();
        assert!(light.is_on());
    }

    #[test]
    fn the_laser_is_off_after_the_last_due_frame_and_an_expected_frame_does_not_turn_it_on() {
        let twin = small_twin(twin::TwinOptions::default());
        let mut light = Light::new(Box::new(twin.laser()));
        let lit = Instant::now();
        light.request(0.5, lit).unwrap();
        // Before the lease would have to be renewed.
        let due = lit + Duration::from_millis(200);
        light.expect_frame(due);
        light.update(due + LIGHT_IDLE).unwrap();
        assert!(light.is_on(), "a frame was due until now");
        light.update(due + LIGHT_IDLE + Duration::from_millis(1)).unwrap();
        light.check_off().unwrap();
        assert!(!light.is_on(), "no frame is due");
        light.expect_frame(Instant::now() + Duration::from_secs(1));
        light.update(Instant::now()).unwrap();
        assert!(!light.is_on(), "a frame in transfer does not turn it on");
    }

    /// A laser whose controller is not ready for a while.
    struct BusyLaser {
        laser: twin::TwinLaser,
        n_refusals: usize,
    }

    impl Laser for BusyLaser {
        fn identity(&self) -> devices::DeviceIdentity {
            self.laser.identity()
        }
        fn capabilities(&self) -> devices::LaserCapabilities {
            self.laser.capabilities()
        }
        fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
            match self.n_refusals.checked_sub(1) {
                Some(left) => {
                    self.n_refusals = left;
                    Err(LaserError::NotYet { reason: "it is being reset" })
                }
                None => self.laser.switch_on(power, lease),
            }
        }
        fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
            self.laser.renew(lease)
        }
        fn switch_off(&mut self) -> Result<(), LaserError> {
            self.laser.switch_off()
        }
        fn stop_handle(&self) -> Option<std::sync::Arc<dyn devices::StopHandle>> {
            self.laser.stop_handle()
        }
        fn poll(&mut self) -> Result<LaserState, LaserError> {
            self.laser.poll()
        }
        fn reconnect(&mut self) -> Result<(), LaserError> {
            self.laser.reconnect()
        }
    }

    fn busy(n_refusals: usize) -> Light {
        Light::new(Box::new(BusyLaser { laser: small_twin(twin::TwinOptions::default()).laser(), n_refusals }))
    }

    #[test]
    fn a_laser_whose_controller_is_not_ready_is_switched_on_as_soon_as_it_is() {
        let (mut light, now) = (busy(3), Instant::now());
        light.request(0.5, now).unwrap();
        for n in 1..=3 {
            assert!(!light.is_on(), "refused {n} times");
            light.update(now + n * POLL_LASER_SWITCHING).unwrap();
        }
        assert!(light.is_on() && light.is_as_requested());
    }

    #[test]
    fn a_controller_that_is_never_ready_is_a_fault_and_a_cancelled_request_is_not_tried_again() {
        let (mut light, now) = (busy(usize::MAX), Instant::now());
        light.request(0.5, now).unwrap();
        light.update(now + LIGHT_UP_LIMIT).unwrap();
        assert!(light.update(now + LIGHT_UP_LIMIT + Duration::from_millis(1)).is_err());
        let mut light = busy(1);
        light.request(0.5, now).unwrap();
        light.off().unwrap();
        light.update(now + POLL_LASER_SWITCHING).unwrap();
        assert!(!light.is_on() && !light.is_requested());
    }
}
