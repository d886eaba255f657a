//! What a person or a script sees of a command: progress, files written, exit code.

pub mod exit;
pub mod output;
pub mod progress;
