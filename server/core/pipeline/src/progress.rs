//! Progress reports of long procedures, and their cancellation.
//!
//! The same procedures are used by the command line, which draws bars on stderr, and by the jobs of the service,
//! which publish a fraction and a message and may be cancelled. A procedure depends on neither.

use crate::failure::Failure;

/// Receives progress and notes.
pub trait Reporter: Send + Sync {
    /// An optional remark.
    fn note(&self, text: &str);

    /// A warning, shown even in quiet mode.
    fn warn(&self, text: &str);

    /// Whether the procedure was cancelled.
    fn is_cancelled(&self) -> bool;

    /// Progress over `total` items, such as images.
    fn count(&self, title: &str, unit: &str, total: usize) -> Box<dyn Task>;

    /// Progress of a procedure that names its steps and the fraction done.
    fn fraction(&self, title: &str) -> Box<dyn Task>;

    /// Ends the procedure if it was cancelled.
    ///
    /// # Errors
    /// [`Failure::cancelled`].
    fn check_cancelled(&self) -> Result<(), Failure> {
        if self.is_cancelled() { Err(Failure::cancelled()) } else { Ok(()) }
    }
}

/// One task in progress; it ends when dropped.
pub trait Task: Send + Sync {
    /// One more item is done. May be called from any thread.
    fn step(&self);

    /// The current step, in the operator's words, and the fraction done.
    fn at(&self, step: &str, fraction: f64);
}
