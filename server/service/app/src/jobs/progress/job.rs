//! Progress of a job: maps the fraction of a procedure to a part of the job's progress.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use parking_lot::Mutex;
use pipeline::{Reporter, Task};
use station::cancel::CancelFlag;

use crate::jobs::progress::{Phase, Step};

/// Receives a job's fraction 0–1, its step, and a message.
pub type ProgressFn = Arc<dyn Fn(f64, Step, &str) + Send + Sync>;

/// Warnings of a job that end its message: more of them are only in the log.
const MAX_WARNINGS: usize = 5;

/// What a job's procedures warned of, in order.
#[derive(Debug, Clone, Default)]
pub struct Warnings(Arc<Mutex<Vec<String>>>);

impl Warnings {
    fn add(&self, text: &str) {
        self.0.lock().push(text.to_owned());
    }

    /// A final message with the warnings after it.
    pub fn after(&self, message: &str) -> String {
        let warnings = self.0.lock();
        let mut parts = vec![message.to_owned()];
        parts.extend(warnings.iter().take(MAX_WARNINGS).map(|text| format!("Warning: {text}")));
        if let Some(n_more @ 1..) = warnings.len().checked_sub(MAX_WARNINGS) {
            parts.push(format!("{n_more} more warnings are in the log"));
        }
        parts.join(". ")
    }
}

/// The progress sink of a job's procedures.
pub struct JobReporter {
    /// Set when the job is to end.
    pub cancel: CancelFlag,
    /// Receives fraction, step and message.
    pub progress: ProgressFn,
    /// The phase of the procedure.
    pub phase: Phase,
    /// The part of the job's progress that the procedure covers.
    pub part: Range<f64>,
    /// Receives its warnings.
    pub warnings: Warnings,
}

impl JobReporter {
    fn task(&self, title: &str, unit: &str, total: usize) -> Box<dyn Task> {
        let task = JobTask {
            progress: self.progress.clone(),
            phase: self.phase,
            part: self.part.clone(),
            title: title.to_owned(),
            unit: unit.to_owned(),
            total,
            done: AtomicUsize::new(0),
        };
        task.report(0.0, self.phase.into(), title);
        Box::new(task)
    }
}

impl Reporter for JobReporter {
    fn note(&self, text: &str) {
        tracing::debug!("{text}");
    }

    fn warn(&self, text: &str) {
        tracing::warn!("{text}");
        self.warnings.add(text);
    }

    fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    fn count(&self, title: &str, unit: &str, total: usize) -> Box<dyn Task> {
        self.task(title, unit, total)
    }

    fn fraction(&self, title: &str) -> Box<dyn Task> {
        self.task(title, "", 0)
    }
}

struct JobTask {
    progress: ProgressFn,
    phase: Phase,
    part: Range<f64>,
    title: String,
    unit: String,
    total: usize,
    done: AtomicUsize,
}

impl JobTask {
    fn report(&self, fraction: f64, step: Step, words: &str) {
        let done = self.part.start + (self.part.end - self.part.start) * fraction.clamp(0.0, 1.0);
        (self.progress)(done, step, words);
    }
}

impl Task for JobTask {
    fn step(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let words = format!("{}: {done} of {} {}", self.title, self.total, self.unit);
        self.report(done as f64 / self.total.max(1) as f64, self.phase.counted(done, self.total), &words);
    }

    fn at(&self, step: &str, fraction: f64) {
        self.report(fraction, self.phase.into(), step);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use parking_lot::Mutex;

    use super::*;

    #[test]
    fn a_procedure_covers_its_part_of_the_job_and_ends_on_request() {
        let reported = Arc::new(Mutex::new(Vec::new()));
        let cancel = CancelFlag::default();
        let sink = reported.clone();
        let progress = Arc::new(move |fraction: f64, step: Step, words: &str| {
            sink.lock().push((fraction, step, words.to_owned()));
        });
        let phase = Phase::ReadingImages;
        let warnings = Warnings::default();
        let reporter =
            JobReporter { cancel: cancel.clone(), progress, phase, part: 0.5..0.9, warnings: warnings.clone() };
        let task = reporter.count("reading", "images", 2);
        task.step();
        task.step();
        let expected = [
            (0.5, phase.into(), "reading".to_owned()),
            (0.7, phase.counted(1, 2), "reading: 1 of 2 images".to_owned()),
            (0.9, phase.counted(2, 2), "reading: 2 of 2 images".to_owned()),
        ];
        assert_eq!(*reported.lock(), expected);
        assert!(reporter.check_cancelled().is_ok());
        assert_eq!(warnings.after("12 points"), "12 points");
        (0..7).for_each(|n| reporter.warn(&format!("image {n} is dark")));
        let message = warnings.after("12 points");
        assert!(message.starts_with("12 points. Warning: image 0 is dark. Warning: image 1"), "{message}");
        assert!(message.ends_with("image 4 is dark. 2 more warnings are in the log"), "{message}");
        cancel.cancel();
        assert!(reporter.check_cancelled().unwrap_err().is_cancelled());
    }
}
