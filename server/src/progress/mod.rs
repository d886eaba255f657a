//! Where a long procedure says how far it is, and asks whether it shall go on.
//!
//! The same procedures serve the command line, which draws bars on stderr, and the jobs of the service, which publish
//! a fraction and words and may be cancelled. A procedure sees neither: it holds a [`Reporter`] and [`Task`]s.

mod job;
mod stderr;
mod step;

use std::sync::Arc;

use job::JobTask;
pub use job::{JobVoice, Tell};
use stderr::{Stderr, StderrTask};
pub use step::{Phase, Step};

use crate::failure::Failure;

/// Where progress and notes go.
#[derive(Clone)]
pub struct Reporter(Voice);

#[derive(Clone)]
enum Voice {
    Stderr(Stderr),
    Job(Arc<JobVoice>),
}

impl Reporter {
    /// For this process's stderr.
    pub fn new(quiet: bool) -> Self {
        Self(Voice::Stderr(Stderr::new(quiet)))
    }

    /// For a part of a job.
    pub fn for_job(voice: JobVoice) -> Self {
        Self(Voice::Job(Arc::new(voice)))
    }

    /// A remark a person may skip.
    pub fn note(&self, text: &str) {
        match &self.0 {
            Voice::Stderr(stderr) => stderr.note(text),
            Voice::Job(voice) => voice.note(text),
        }
    }

    /// A remark a person should see, also when quiet.
    pub fn warn(&self, text: &str) {
        match &self.0 {
            Voice::Stderr(stderr) => stderr.warn(text),
            Voice::Job(voice) => voice.warn(text),
        }
    }

    /// Ends the procedure if that was asked for.
    ///
    /// # Errors
    /// [`Failure::cancelled`]; never on the command line, where the process is ended instead.
    pub fn go_on(&self) -> Result<(), Failure> {
        match &self.0 {
            Voice::Job(voice) if voice.cancel.is_cancelled() => Err(Failure::cancelled()),
            _ => Ok(()),
        }
    }

    /// Progress over `total` things, such as pictures.
    pub fn count(&self, title: &str, unit: &str, total: usize) -> Task {
        Task(match &self.0 {
            Voice::Stderr(stderr) => Work::Stderr(stderr.count(title, unit, total)),
            Voice::Job(voice) => Work::Job(JobTask::count(voice.clone(), title, unit, total)),
        })
    }

    /// Progress of a procedure that names its steps and the fraction done.
    pub fn fraction(&self, title: &str) -> Task {
        Task(match &self.0 {
            Voice::Stderr(stderr) => Work::Stderr(stderr.fraction(title)),
            Voice::Job(voice) => Work::Job(JobTask::fraction(voice.clone(), title)),
        })
    }
}

/// One running piece of work; over when it is dropped.
pub struct Task(Work);

enum Work {
    Stderr(StderrTask),
    Job(JobTask),
}

impl Task {
    /// One more thing is done. May be called from any thread.
    pub fn step(&self) {
        match &self.0 {
            Work::Stderr(task) => task.step(),
            Work::Job(task) => task.step(),
        }
    }

    /// Where a procedure is, in the operator's words, and the fraction done.
    pub fn at(&self, step: &str, fraction: f64) {
        match &self.0 {
            Work::Stderr(task) => task.at(step, fraction),
            Work::Job(task) => task.at(step, fraction),
        }
    }
}
