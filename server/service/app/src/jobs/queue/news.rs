//! The newest progress of every job, so that one job's progress never hides another's.

use crate::jobs::JobView;

/// Ended jobs still kept for slow readers: more than can end between two reads.
const ENDED_KEPT: usize = 32;

/// The newest progress of every job that runs, waits or ended recently, in the order of publication.
#[derive(Debug, Clone, Default)]
pub struct JobNews {
    newest: Vec<(u64, JobView)>,
    last: u64,
}

impl JobNews {
    /// Publishes the progress of a job. Late progress of a job whose end was published is dropped: false.
    pub fn publish(&mut self, view: JobView) -> bool {
        let known = self.newest.iter().position(|(_, known)| known.record.id == view.record.id);
        if let Some(at) = known {
            if self.newest[at].1.record.state.is_terminal() && !view.record.state.is_terminal() {
                return false;
            }
            self.newest.remove(at);
        }
        self.last += 1;
        self.newest.push((self.last, view));
        let ended = |(_, view): &(u64, JobView)| view.record.state.is_terminal();
        if self.newest.iter().filter(|known| ended(known)).count() > ENDED_KEPT
            && let Some(oldest) = self.newest.iter().position(ended)
        {
            self.newest.remove(oldest);
        }
        true
    }

    /// The first progress after number `seen`, with its own number; a caller that continues from it misses no job.
    pub fn after(&self, seen: u64) -> Option<(u64, &JobView)> {
        self.newest.iter().find(|(number, _)| *number > seen).map(|(number, view)| (*number, view))
    }

    /// The number of the newest progress.
    pub fn last(&self) -> u64 {
        self.last
    }
}
