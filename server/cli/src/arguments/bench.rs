//! Arguments of `sheaf bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{JsonTo, LineDirectionArg};

/// `sheaf bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// What to measure.
    #[command(subcommand)]
    pub subject: BenchSubject,
}

/// What to measure.
#[derive(Debug, Subcommand)]
pub enum BenchSubject {
    /// Centreline extraction: image to line segments of sub-pixel points with σ, over a rotation of frames in memory.
    Centrelines(BenchCentrelinesArgs),
    /// Image to labelled, triangulated points with σ on one thread, compared with centreline extraction alone.
    Profiles(BenchProfilesArgs),
    /// Chessboard corner detection on one thread, over a rotation of images in memory.
    Corners(BenchBoardsArgs),
    /// Camera calibration from the corners of all images on one thread: by plain least squares, as OpenCV's
    /// `calibrateCamera`, and as in `sheaf calibrate`.
    Camera(BenchBoardsArgs),
    /// A synthetic scan of any size, from peaks on disk to a cloud on disk: peak memory per point, and the write rate of
    /// a PLY file compared with that of the disk.
    Cloud(BenchCloudArgs),
    /// The whole service: a continuous scan over a recording in memory, with viewers. Reports frames per second, losses,
    /// latency of profiles and peaks, and the load of each thread.
    Server(BenchServerArgs),
    /// The live stream to many viewers, alternating with bare TCP connections that carry the same bytes.
    Stream(BenchStreamArgs),
}

/// `sheaf bench stream`.
#[derive(Debug, Args)]
pub struct BenchStreamArgs {
    /// Number of viewers; several numbers are measured one after the other.
    #[arg(long, value_name = "N", value_delimiter = ',', default_values_t = [10, 100])]
    pub viewers: Vec<usize>,
    /// Bytes of a message.
    #[arg(long, value_name = "N", default_value_t = 30_000)]
    pub bytes: usize,
    /// Rounds, each once over the stream and once over bare connections.
    #[arg(long, value_name = "N", default_value_t = 7)]
    pub rounds: usize,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// `sheaf bench server`.
#[derive(Debug, Args)]
pub struct BenchServerArgs {
    /// A capture folder; its scan images are replayed back and forth as often as needed.
    #[arg(value_name = "CAPTURE")]
    pub capture: PathBuf,
    /// The station's calibration document.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: PathBuf,
    /// Frames per second.
    #[arg(long, value_name = "HZ", default_value_t = 500.0)]
    pub rate_hz: f64,
    /// Frames per continuous scan; they are held in memory.
    #[arg(long, value_name = "N", default_value_t = 1500)]
    pub frames: usize,
    /// Number of continuous scans, one after the other.
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub sweeps: usize,
    /// Number of profile viewers at 60 Hz, on threads of the same process.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub viewers: usize,
    /// Folder to write to.
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
    /// Points per frame, on five lines; at most 6400.
    #[arg(long, value_name = "N", default_value_t = 5000)]
    pub points: usize,
    /// Folder on the disk to measure; temporarily needs 190 bytes per point.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub folder: PathBuf,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// Frames with lines, and how to time them.
#[derive(Debug, Args)]
pub struct TimedFrames {
    /// Frames of one size: PNG, TIFF or JPEG, 8 or 16 bit.
    #[arg(required = true, value_name = "FRAME")]
    pub frames: Vec<PathBuf>,
    /// Minimum number of timed rotations over the frames; always at least 21 frames.
    #[arg(long, value_name = "N", default_value_t = 21)]
    pub passes: usize,
    /// Direction of the lines.
    #[arg(long, value_enum, default_value_t)]
    pub line_direction: LineDirectionArg,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// `sheaf bench profiles`.
#[derive(Debug, Args)]
pub struct BenchProfilesArgs {
    /// What to time.
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
    /// Timed rotations over the images, or camera fits.
    #[arg(long, value_name = "N", default_value_t = 21)]
    pub passes: usize,
    /// Also write the result as JSON to this file.
    #[arg(id = "json", long, value_name = "OUT.json")]
    pub json: Option<JsonTo>,
}

/// `sheaf bench centrelines`.
#[derive(Debug, Args)]
pub struct BenchCentrelinesArgs {
    /// What to time.
    #[command(flatten)]
    pub timed: TimedFrames,
    /// Number of threads sharing the frames; with several, the time per frame is averaged over a thousand frames.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub threads: usize,
    /// Folder for one CSV per frame: u_px,v_px.
    #[arg(long, value_name = "DIR")]
    pub points: Option<PathBuf>,
}
