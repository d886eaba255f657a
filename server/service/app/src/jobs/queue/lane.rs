//! A lane of the queue: one job runs, the others wait in order.

use std::collections::VecDeque;
use std::sync::Arc;

use station::cancel::CancelFlag;
use store::JobRecord;

use crate::access::lease::Authority;
use crate::jobs::input::JobInput;
use crate::jobs::queue::job_progress::JobProgress;

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
    pub progress: Arc<JobProgress>,
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
    /// The job to start now, if none runs and the first waiting one that is not held back may start; it counts as running
    /// from here on.
    pub fn next(
        &mut self,
        is_free: impl Fn(&Waiting) -> bool,
        may_begin: impl Fn(&Waiting) -> bool,
    ) -> Option<(Waiting, Running)> {
        if self.closed || self.running.is_some() {
            return None;
        }
        let place = self.waiting.iter().position(is_free).filter(|place| may_begin(&self.waiting[*place]))?;
        let waiting = self.waiting.remove(place)?;
        let running = Running {
            id: waiting.record.id.clone(),
            cancel: CancelFlag::default(),
            progress: Arc::new(JobProgress::new(waiting.record.clone())),
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

#[cfg(test)]
mod tests {
    use station::StopEpoch;
    use store::JobState;

    use super::*;
    use crate::jobs::{ExportInput, InspectInput, ScanSource, queued_record};
    use crate::resources::inspections::InspectedPart;

    fn waiting(input: JobInput) -> Waiting {
        let record = queued_record(&input, "test").unwrap();
        assert_eq!(record.state, JobState::Queued);
        Waiting { record, input, authority: Authority { holder: None, epoch: StopEpoch::default() } }
    }

    #[test]
    fn held_jobs_are_skipped_and_keep_their_order() {
        let part = |serial: &str| {
            let part = InspectedPart { serial: serial.into(), order: None, attributes: Default::default() };
            let source = ScanSource::Station;
            waiting(JobInput::Inspection(InspectInput { recipe_id: "r".into(), recipe_version: 1, part, source }))
        };
        let other = || {
            waiting(JobInput::Export(ExportInput {
                scan_id: "s".into(),
                what: "cloud".into(),
                format: "csv".into(),
            }))
        };
        let is_free = |waiting: &Waiting| !matches!(waiting.input, JobInput::Inspection(_));
        let mut lane = Lane { waiting: [part("1"), other(), part("2")].into(), ..Lane::default() };
        let all: Vec<String> = lane.waiting.iter().map(|waiting| waiting.record.id.clone()).collect();
        assert!(lane.next(is_free, |_| false).is_none(), "the one that may pass may not begin");
        assert_eq!(lane.next(is_free, |_| true).unwrap().0.record.id, all[1]);
        lane.running = None;
        assert!(lane.next(is_free, |_| true).is_none());
        for id in [&all[0], &all[2]] {
            assert_eq!(&lane.next(|_| true, |_| true).unwrap().0.record.id, id);
            lane.running = None;
        }
    }
}
