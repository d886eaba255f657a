//! Output of commands: progress, files written, exit code.

pub mod exit;
pub mod output;
pub mod progress;
