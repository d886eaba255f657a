//! The laser under the station thread: light follows frames. It turns off when no frame is due any more, whoever
//! requested it and whatever call is under way, and comes back only with the next exposure of whoever requested it.

use std::time::Instant;

use devices::{Laser, LaserError, LaserState};

use crate::params::{
    LIGHT_IDLE, LIGHT_LEASE, LIGHT_RENEWAL, LIGHT_UP_LIMIT, POLL_CHANGING, POLL_IDLE, POLL_SHINING,
};

/// The laser and its requested state.
pub struct Light {
    device: Box<dyn Laser>,
    is_switched: bool,
    state: Option<LaserState>,
    /// Share of full power that its user wants; 0 is dark.
    wanted: f64,
    /// When it was switched on; `None`: dark, or gone dark because its user was idle.
    lit_at: Option<Instant>,
    renewed_at: Instant,
    /// No frame is due after this moment.
    needed_until: Instant,
    polled_at: Option<Instant>,
    changed_at: Instant,
}

impl Light {
    /// Over a laser that was just opened.
    pub fn new(device: Box<dyn Laser>) -> Self {
        let now = Instant::now();
        Self {
            is_switched: device.capabilities().switched,
            device,
            state: None,
            wanted: 0.0,
            lit_at: None,
            renewed_at: now,
            needed_until: now,
            polled_at: None,
            changed_at: now,
        }
    }

    /// The laser itself, for what makes no light.
    pub fn device(&mut self) -> &mut dyn Laser {
        &mut *self.device
    }

    /// Whether it goes on and off at all.
    pub fn is_switched(&self) -> bool {
        self.is_switched
    }

    /// What it reported last.
    pub fn state(&self) -> Option<LaserState> {
        self.state
    }

    /// Whether its user wants light.
    pub fn is_wanted(&self) -> bool {
        self.wanted > 0.0
    }

    /// Whether it reports light.
    pub fn shines(&self) -> bool {
        self.state.is_some_and(|state| state.emitting)
    }

    /// Whether it reports the requested state.
    pub fn has_obeyed(&self) -> bool {
        self.shines() == self.is_wanted()
    }

    /// Reads the state of a laser that shall be dark: is it well?
    pub fn check_dark(&mut self) -> Result<(), LaserError> {
        let state = self.device.poll()?;
        self.take(state, Instant::now());
        Ok(())
    }

    /// Whether it reported light at that moment, as far back as its last change.
    pub fn shone_at(&self, at: Instant) -> bool {
        self.shines() == (at >= self.changed_at)
    }

    /// Whether a reading is due.
    fn is_due(&self, now: Instant) -> bool {
        let period = match (self.lit_at.is_some(), self.shines()) {
            (true, true) => POLL_SHINING,
            (false, false) => POLL_IDLE,
            _ => POLL_CHANGING,
        };
        self.polled_at.is_none_or(|at| now.saturating_duration_since(at) >= period)
    }

    /// Wants light of that power. Without frames it goes out soon after it has come.
    pub fn want(&mut self, power: f64, now: Instant) -> Result<(), LaserError> {
        if !(power > 0.0 && power <= 1.0) {
            return Err(LaserError::BadPower { value: power });
        }
        let state = self.device.switch_on(power, LIGHT_LEASE)?;
        self.wanted = power;
        (self.lit_at, self.renewed_at, self.polled_at) = (Some(now), now, None);
        // Until it is on: whether it comes on at all is known before this ends.
        self.needed_until = self.needed_until.max(now + LIGHT_UP_LIMIT + LIGHT_IDLE);
        self.take(state, now);
        Ok(())
    }

    /// A frame is due at `due`: the light that is wanted stays until then, or comes back for it.
    pub fn serve_frame(&mut self, due: Instant, now: Instant) -> Result<(), LaserError> {
        self.needed_until = self.needed_until.max(due + LIGHT_IDLE);
        if self.is_wanted() && self.lit_at.is_none() { self.want(self.wanted, now) } else { Ok(()) }
    }

    /// A frame that is on its way is due at `due`; light that has gone out stays out.
    pub fn expect_frame(&mut self, due: Instant) {
        self.needed_until = self.needed_until.max(due + LIGHT_IDLE);
    }

    /// Goes dark and stays so.
    pub fn off(&mut self) -> Result<(), LaserError> {
        self.wanted = 0.0;
        self.suspend()
    }

    /// Reads the state, renews the lease or lets the light go out.
    ///
    /// # Errors
    /// What the laser reports, and light that went out by itself.
    pub fn tend(&mut self, now: Instant) -> Result<(), LaserError> {
        if self.lit_at.is_some() && now > self.needed_until {
            self.suspend()?;
        }
        if self.lit_at.is_some() && now.saturating_duration_since(self.renewed_at) >= LIGHT_LEASE {
            // This thread came too late and the lease ran out: no fault of the laser; the next exposure lights it.
            self.suspend()?;
        }
        if self.lit_at.is_some() && now - self.renewed_at >= LIGHT_RENEWAL {
            self.renewed_at = now;
            let state = self.device.renew(LIGHT_LEASE)?;
            self.take(state, now);
        }
        if self.is_due(now) {
            self.polled_at = Some(now);
            let was = self.shines();
            let state = self.device.poll()?;
            self.take(state, now);
            return self.check(was, now);
        }
        Ok(())
    }

    /// Goes dark until the next exposure of whoever wanted the light.
    pub fn suspend(&mut self) -> Result<(), LaserError> {
        (self.lit_at, self.polled_at) = (None, None);
        self.device.switch_off()
    }

    fn take(&mut self, state: LaserState, now: Instant) {
        if self.shines() != state.emitting {
            self.changed_at = now;
            if state.emitting {
                self.needed_until = now + LIGHT_IDLE;
            }
        }
        self.state = Some(state);
    }

    fn check(&self, was_shining: bool, now: Instant) -> Result<(), LaserError> {
        let Some(lit_at) = self.lit_at else { return Ok(()) };
        if self.state.is_some_and(|state| state.interlock_closed == Some(false)) {
            return Err(LaserError::InterlockOpen);
        }
        if self.shines() {
            return Ok(());
        }
        let late = now.saturating_duration_since(lit_at) > LIGHT_UP_LIMIT;
        let went_out = was_shining.then_some(("the light went out by itself", "check laser and cable"));
        match went_out.or(late.then_some(("no light came", "check laser, key switch and cable"))) {
            Some((reason, remedy)) => Err(LaserError::Fault { reason: reason.to_owned(), remedy }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::tests::bench::small_twin;

    #[test]
    fn a_lease_that_this_thread_let_run_out_is_no_fault_and_the_next_exposure_lights_again() {
        let twin = small_twin(twin::TwinOptions::default());
        let mut light = Light::new(Box::new(twin.laser()));
        let now = Instant::now();
        light.want(0.5, now).unwrap();
        light.expect_frame(now + LIGHT_LEASE);
        light.tend(now + LIGHT_LEASE + Duration::from_millis(1)).unwrap();
        light.check_dark().unwrap();
        assert!(!light.shines() && light.is_wanted());
        light.serve_frame(Instant::now(), Instant::now()).unwrap();
        assert!(light.shines());
    }

    #[test]
    fn light_goes_out_after_the_last_frame_that_was_due_and_an_expected_frame_does_not_light_it_again() {
        let twin = small_twin(twin::TwinOptions::default());
        let mut light = Light::new(Box::new(twin.laser()));
        let lit = Instant::now();
        light.want(0.5, lit).unwrap();
        // Before the lease would have to be renewed.
        let due = lit + Duration::from_millis(200);
        light.expect_frame(due);
        light.tend(due + LIGHT_IDLE).unwrap();
        assert!(light.shines(), "a frame was due so long");
        light.tend(due + LIGHT_IDLE + Duration::from_millis(1)).unwrap();
        light.check_dark().unwrap();
        assert!(!light.shines(), "none is due any more");
        light.expect_frame(Instant::now() + Duration::from_secs(1));
        light.tend(Instant::now()).unwrap();
        assert!(!light.shines(), "a frame on its way does not light it");
    }
}
