//! `sheaf recording`: what is in a recording, and what can be made of it.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// `sheaf recording`.
#[derive(Debug, Args)]
pub struct RecordingArgs {
    /// What to do with it.
    #[command(subcommand)]
    pub action: RecordingAction,
}

/// What is done with a recording.
#[derive(Debug, Subcommand)]
pub enum RecordingAction {
    /// What is inside: frames, messages, gaps, calibration, whether it is whole. Exit code 7 if something is missing.
    Info(RecordingInfoArgs),
    /// Make a capture folder of it: the frames of its scan, or all that have a stage position, and its calibration.
    /// Exit code 7 if frames are missing.
    Export(RecordingExportArgs),
    /// Make a whole file of one that was broken off or damaged: everything that can be read, with an index. Exit code 7 if
    /// something could not be read.
    Repair(RecordingRepairArgs),
}

/// `sheaf recording info`.
#[derive(Debug, Args)]
pub struct RecordingInfoArgs {
    /// The recording (.mcap).
    pub recording: PathBuf,
}

/// `sheaf recording export`.
#[derive(Debug, Args)]
pub struct RecordingExportArgs {
    /// The recording (.mcap).
    pub recording: PathBuf,
    /// The capture folder; it must not exist yet.
    #[arg(short, long, value_name = "FOLDER")]
    pub output: PathBuf,
}

/// `sheaf recording repair`.
#[derive(Debug, Args)]
pub struct RecordingRepairArgs {
    /// The file (.mcap), also one of another program.
    pub recording: PathBuf,
    /// The new file; it must not exist yet.
    #[arg(short, long, value_name = "FILE.mcap")]
    pub output: PathBuf,
}
