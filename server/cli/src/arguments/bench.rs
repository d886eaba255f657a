//! `sheaf bench`: what is measured, on what.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{JsonTo, LineDirectionArg};

/// `sheaf bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// What is measured.
    #[command(subcommand)]
    pub subject: BenchSubject,
}

/// What is measured.
#[derive(Debug, Subcommand)]
pub enum BenchSubject {
    /// Image to labelled line pieces of sub-pixel points with σ, over rotating frames that are in memory.
    Centrelines(BenchCentrelinesArgs),
    /// Image to labelled, triangulated points with σ, on one thread, beside finding the lines alone.
    Profiles(BenchProfilesArgs),
    /// Image to the corners of a chessboard, on one thread, over rotating images that are in memory.
    Corners(BenchBoardsArgs),
    /// Corners of all images to a camera, on one thread: by plain least squares, which is the minimum that OpenCV's
    /// `calibrateCamera` seeks, and as `sheaf calibrate` does it.
    Camera(BenchBoardsArgs),
    /// A made-up scan of any size, from its peaks on the disk to its cloud on the disk: memory a point at peak, and how fast
    /// a PLY file is written beside what the disk takes.
    Cloud(BenchCloudArgs),
    /// The whole service: a recording played from memory, swept as a scan, watched by viewers. Frames a second, what was
    /// lost, how long frames take to their profiles and into the file, and what every thread does for it.
    Server(BenchServerArgs),
    /// The live stream to many viewers, beside bare TCP connections that carry the same bytes, by turns.
    Stream(BenchStreamArgs),
}

/// `sheaf bench stream`.
#[derive(Debug, Args)]
pub struct BenchStreamArgs {
    /// Viewers; several numbers are measured one after the other.
    #[arg(long, value_name = "N", value_delimiter = ',', default_values_t = [10, 100])]
    pub viewers: Vec<usize>,
    /// Bytes of a message.
    #[arg(long, value_name = "N", default_value_t = 30_000)]
    pub bytes: usize,
    /// Rounds, each once by the stream and once by bare connections.
    #[arg(long, value_name = "N", default_value_t = 7)]
    pub rounds: usize,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// `sheaf bench server`.
#[derive(Debug, Args)]
pub struct BenchServerArgs {
    /// A capture folder whose scan pictures are played, there and back, as often as it takes.
    #[arg(value_name = "CAPTURE")]
    pub capture: PathBuf,
    /// The station's calibration document.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: PathBuf,
    /// Frames a second.
    #[arg(long, value_name = "HZ", default_value_t = 500.0)]
    pub rate_hz: f64,
    /// Frames of a sweep; they are held in memory.
    #[arg(long, value_name = "N", default_value_t = 1500)]
    pub frames: usize,
    /// Sweeps, one after the other.
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub sweeps: usize,
    /// Viewers of profiles at 60 Hz, on threads of the same process.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub viewers: usize,
    /// Folder on the disk that is recorded to.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub folder: PathBuf,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// `sheaf bench cloud`.
#[derive(Debug, Args)]
pub struct BenchCloudArgs {
    /// Frames of the scan.
    #[arg(long, value_name = "N", default_value_t = 2000)]
    pub frames: usize,
    /// Points of a frame, on five lines; at most 6400.
    #[arg(long, value_name = "N", default_value_t = 5000)]
    pub points: usize,
    /// Folder on the disk that is measured; needs 190 bytes for every point, which are given back.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub folder: PathBuf,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// Frames with lines, and how they are timed.
#[derive(Debug, Args)]
pub struct TimedFrames {
    /// Frames of one size: PNG, TIFF or JPEG, 8 or 16 bit.
    #[arg(required = true, value_name = "FRAME")]
    pub frames: Vec<PathBuf>,
    /// Rotations over the frames that are timed, at the least; always at least 21 frames.
    #[arg(long, value_name = "N", default_value_t = 21)]
    pub passes: usize,
    /// Which way the lines run.
    #[arg(long, value_enum, default_value_t)]
    pub line_direction: LineDirectionArg,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// `sheaf bench profiles`.
#[derive(Debug, Args)]
pub struct BenchProfilesArgs {
    /// What is timed.
    #[command(flatten)]
    pub timed: TimedFrames,
    /// The station's calibration document.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: PathBuf,
}

/// `sheaf bench corners` and `sheaf bench camera`.
#[derive(Debug, Args)]
pub struct BenchBoardsArgs {
    /// Images of a chessboard: PNG, TIFF or JPEG, 8 or 16 bit.
    #[arg(required = true, value_name = "IMAGE")]
    pub images: Vec<PathBuf>,
    /// Inner corners along a board row.
    #[arg(long)]
    pub columns: usize,
    /// Inner corners along a board column.
    #[arg(long)]
    pub rows: usize,
    /// Rotations over the images that are timed; cameras that are fitted.
    #[arg(long, value_name = "N", default_value_t = 21)]
    pub passes: usize,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// `sheaf bench centrelines`.
#[derive(Debug, Args)]
pub struct BenchCentrelinesArgs {
    /// What is timed.
    #[command(flatten)]
    pub timed: TimedFrames,
    /// Threads that share the frames; with several, a time is that of a thousand frames over their number.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub threads: usize,
    /// Folder for one CSV per frame: u_px,v_px.
    #[arg(long, value_name = "DIR")]
    pub points: Option<PathBuf>,
}
