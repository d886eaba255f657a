//! Arguments of `sheaf recording`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// `sheaf recording`.
#[derive(Debug, Args)]
pub struct RecordingArgs {
    /// The subcommand.
    #[command(subcommand)]
    pub action: RecordingAction,
}

/// Subcommands of `sheaf recording`.
#[derive(Debug, Subcommand)]
pub enum RecordingAction {
    /// Show the content: frames, messages, gaps, calibration, completeness. Exit code 7 if frames or parts of the file
    /// are missing.
    Info(RecordingInfoArgs),
    /// Export to a capture folder: the frames of its scan, or all frames with a stage position, and its calibration.
    /// Exit code 7 if frames are missing.
    Export(RecordingExportArgs),
    /// Repair an interrupted or damaged file: copies everything readable and adds an index. Exit code 7 if parts could
    /// not be read.
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
    /// The file (.mcap), which may be from another program.
    pub recording: PathBuf,
    /// The new file; it must not exist yet.
    #[arg(short, long, value_name = "FILE.mcap")]
    pub output: PathBuf,
}
