//! Where a long procedure says how far it is, and asks whether it shall go on.
//!
//! The same procedures serve the command line, which draws bars on stderr, and the jobs of the service, which publish
//! a fraction and words and may be cancelled. A procedure sees neither.

use crate::failure::Failure;

/// Where progress and notes go.
pub trait Reporter: Send + Sync {
    /// A remark a person may skip.
    fn note(&self, text: &str);

    /// A remark a person should see, also when quiet.
    fn warn(&self, text: &str);

    /// Whether the procedure was asked to end.
    fn is_cancelled(&self) -> bool;

    /// Progress over `total` things, such as pictures.
    fn count(&self, title: &str, unit: &str, total: usize) -> Box<dyn Task>;

    /// Progress of a procedure that names its steps and the fraction done.
    fn fraction(&self, title: &str) -> Box<dyn Task>;

    /// Ends the procedure if that was asked for.
    ///
    /// # Errors
    /// [`Failure::cancelled`].
    fn go_on(&self) -> Result<(), Failure> {
        if self.is_cancelled() { Err(Failure::cancelled()) } else { Ok(()) }
    }
}

/// One running piece of work; over when it is dropped.
pub trait Task: Send + Sync {
    /// One more thing is done. May be called from any thread.
    fn step(&self);

    /// Where a procedure is, in the operator's words, and the fraction done.
    fn at(&self, step: &str, fraction: f64);
}
