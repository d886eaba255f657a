//! A lane of the queue: one job runs, the others wait in their order.

use std::collections::VecDeque;
use std::sync::Arc;

use station::cancel::CancelFlag;
use store::JobRecord;

use crate::access::lease::Authority;
use crate::jobs::input::JobInput;
use crate::jobs::queue::board::Board;

/// A job that waits.
#[derive(Clone)]
pub struct Waiting {
    /// As stored.
    pub record: JobRecord,
    /// What it is to do.
    pub input: JobInput,
    /// On whose word it takes the station.
    pub authority: Authority,
}

/// A job that runs.
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
    /// Nothing is begun any more.
    pub closed: bool,
}

impl Lane {
    /// The job to begin now, if one waits that may and none runs; it counts as running from here on.
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

    /// Takes a waiting job out, with its place.
    pub fn take(&mut self, id: &str) -> Option<(usize, Waiting)> {
        let place = self.waiting.iter().position(|waiting| waiting.record.id == id)?;
        self.waiting.remove(place).map(|waiting| (place, waiting))
    }

    /// Puts a job back that could not be ended after all.
    pub fn put_back(&mut self, place: usize, waiting: Waiting) {
        self.waiting.insert(place.min(self.waiting.len()), waiting);
    }
}
