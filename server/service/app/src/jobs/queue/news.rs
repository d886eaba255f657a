//! What was told of jobs: of each the newest word, so that one job's progress never hides another's.

use crate::jobs::JobView;

/// Ended jobs that are still told to who looks late: more than can end within the time between two looks.
const ENDED_KEPT: usize = 32;

/// The newest word of every job that is at work, waits or ended a short while ago, in the order they were told.
#[derive(Debug, Clone, Default)]
pub struct JobNews {
    told: Vec<(u64, JobView)>,
    last: u64,
}

impl JobNews {
    /// Tells where a job is. What is late, of a job whose end was told, is not told any more: false.
    pub fn tell(&mut self, view: JobView) -> bool {
        let known = self.told.iter().position(|(_, told)| told.record.id == view.record.id);
        if let Some(at) = known {
            if self.told[at].1.record.state.is_terminal() && !view.record.state.is_terminal() {
                return false;
            }
            self.told.remove(at);
        }
        self.last += 1;
        self.told.push((self.last, view));
        let ended = |(_, view): &(u64, JobView)| view.record.state.is_terminal();
        if self.told.iter().filter(|told| ended(told)).count() > ENDED_KEPT
            && let Some(oldest) = self.told.iter().position(ended)
        {
            self.told.remove(oldest);
        }
        true
    }

    /// What was told first after the word `seen`, with its own number; who asks on with that misses no job.
    pub fn after(&self, seen: u64) -> Option<(u64, &JobView)> {
        self.told.iter().find(|(number, _)| *number > seen).map(|(number, view)| (*number, view))
    }

    /// The number of the newest word.
    pub fn last(&self) -> u64 {
        self.last
    }
}
