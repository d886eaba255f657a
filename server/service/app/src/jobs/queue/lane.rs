//! A lane of the queue: one job runs, the others wait in order.

use std::collections::VecDeque;
use std::sync::Arc;

use station::cancel::CancelFlag;
use store::JobRecord;

use crate::access::lease::Authority;
use crate::jobs::input::JobInput;
use crate::jobs::queue::board::Board;

/// A waiting job.
#[derive(Clone)]
pub struct Waiting {
    /// The stored record.
    pub record: JobRecord,
    /// Its input.
    pub input: JobInput,
    /// The authority under which it takes the station.
    pub authority: Authority,
}

/// A running job.
#[derive(Clone)]
pub(in crate::jobs) struct Running {
    pub id: String,
    pub cancel: CancelFlag,
    pub board: Arc<Board>,
    pub authority: Authority,
}

/// Jobs that run one at a time.
#[derive(Default)]
pub(in crate::jobs) struct Lane {
    pub waiting: VecDeque<Waiting>,
    pub running: Option<Running>,
    /// No further jobs are started.
    pub closed: bool,
}

impl Lane {
    /// The job to start now, if none runs and the first waiting one may start; it counts as running from here on.
    pub fn next(&mut self, may_begin: impl Fn(&Waiting) -> bool) -> Option<(Waiting, Running)> {
        if self.closed || self.running.is_some() || !self.waiting.front().is_some_and(may_begin) {
            return None;
        }
        let waiting = self.waiting.pop_front()?;
        let running = Running {
            id: waiting.record.id.clone(),
            cancel: CancelFlag::default(),
            board: Arc::new(Board::new(waiting.record.clone())),
            authority: waiting.authority.clone(),
        };
        self.running = Some(running.clone());
        Some((waiting, running))
    }

    /// Removes a waiting job; returns it with its position.
    pub fn take(&mut self, id: &str) -> Option<(usize, Waiting)> {
        let place = self.waiting.iter().position(|waiting| waiting.record.id == id)?;
        self.waiting.remove(place).map(|waiting| (place, waiting))
    }

    /// Puts back a job whose end could not be stored.
    pub fn put_back(&mut self, place: usize, waiting: Waiting) {
        self.waiting.insert(place.min(self.waiting.len()), waiting);
    }
}
