//! Progress of a job: a procedure's own fraction becomes a part of the job's.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use station::cancel::CancelFlag;

use crate::progress::{Phase, Step};

/// Takes a job's fraction, 0–1, what it does, and the same in words.
pub type Tell = Arc<dyn Fn(f64, Step, &str) + Send + Sync>;

/// Where a job's procedures report.
pub struct JobVoice {
    /// Set when the job shall end.
    pub cancel: CancelFlag,
    /// Takes the job's fraction, step and words.
    pub at: Tell,
    /// What the procedure does for the job.
    pub phase: Phase,
    /// Which part of the job's fraction the procedure fills.
    pub part: Range<f64>,
}

impl JobVoice {
    pub(super) fn note(&self, text: &str) {
        tracing::debug!("{text}");
    }

    pub(super) fn warn(&self, text: &str) {
        tracing::warn!("{text}");
    }

    fn report(&self, fraction: f64, step: Step, words: &str) {
        let done = self.part.start + (self.part.end - self.part.start) * fraction.clamp(0.0, 1.0);
        (self.at)(done, step, words);
    }
}

pub(super) struct JobTask {
    voice: Arc<JobVoice>,
    title: String,
    unit: String,
    total: usize,
    done: AtomicUsize,
}

impl JobTask {
    pub(super) fn count(voice: Arc<JobVoice>, title: &str, unit: &str, total: usize) -> Self {
        voice.report(0.0, voice.phase.into(), title);
        Self { voice, title: title.to_owned(), unit: unit.to_owned(), total, done: AtomicUsize::new(0) }
    }

    pub(super) fn fraction(voice: Arc<JobVoice>, title: &str) -> Self {
        Self::count(voice, title, "", 0)
    }

    pub(super) fn step(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let words = format!("{}: {done} of {} {}", self.title, self.total, self.unit);
        let step = self.voice.phase.counted(done, self.total);
        self.voice.report(done as f64 / self.total.max(1) as f64, step, &words);
    }

    pub(super) fn at(&self, step: &str, fraction: f64) {
        self.voice.report(fraction, self.voice.phase.into(), step);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use crate::progress::Reporter;

    #[test]
    fn a_procedure_fills_its_part_of_the_job_and_ends_when_asked() {
        let told = Arc::new(Mutex::new(Vec::new()));
        let cancel = CancelFlag::default();
        let heard = told.clone();
        let at = Arc::new(move |fraction: f64, step: Step, words: &str| {
            heard.lock().unwrap().push((fraction, step, words.to_owned()));
        });
        let phase = Phase::ReadingPictures;
        let reporter = Reporter::for_job(JobVoice { cancel: cancel.clone(), at, phase, part: 0.5..0.9 });
        let task = reporter.count("reading", "pictures", 2);
        task.step();
        task.step();
        let expected = [
            (0.5, phase.into(), "reading".to_owned()),
            (0.7, phase.counted(1, 2), "reading: 1 of 2 pictures".to_owned()),
            (0.9, phase.counted(2, 2), "reading: 2 of 2 pictures".to_owned()),
        ];
        assert_eq!(*told.lock().unwrap(), expected);
        assert!(reporter.go_on().is_ok());
        cancel.cancel();
        assert!(reporter.go_on().unwrap_err().is_cancelled());
    }
}
