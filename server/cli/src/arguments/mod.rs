//! The command line of `sheaf` as types.

mod bench;
mod calibrate;
mod images;
mod numbers;
mod recording;
mod scan;
mod service;
mod simulation;

use std::convert::Infallible;
use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand};

pub use self::recording::{
    RecordingAction, RecordingArgs, RecordingExportArgs, RecordingInfoArgs, RecordingRepairArgs,
};
pub use bench::{
    BenchArgs, BenchBoardsArgs, BenchCentrelinesArgs, BenchCloudArgs, BenchProfilesArgs, BenchServerArgs,
    BenchStreamArgs, BenchSubject,
};
pub use calibrate::{AxisArgs, CalibrateArgs};
pub use images::{CentrelinesArgs, CornersArgs, LineDirectionArg, TargetArgs, TargetKind, TriangulateArgs};
pub use scan::{CompareArgs, InspectArgs, MeasureArgs, ScanArgs};
pub use service::{DoctorArgs, OpenapiArgs, RegisterFormat, ServeArgs, SettingsArgs};
pub use simulation::{
    DemoArgs, StationArgs, Study, StudyArgs, StudyPaperArgs, TwinAction, TwinArgs, TwinCaptureArgs,
};

/// Printed below every `--help`.
const EXIT_CODES: &str = "\
Exit codes:
  0  done (with a tolerance: OK)
  1  internal error
  2  wrong usage of the command line
  3  bad input: a file is missing, damaged, malformed or of the wrong size
  4  insufficient data: the message names the quantity that cannot be determined
  5  measured: NOT OK, or INVALID (a characteristic with limits could not be measured);
     doctor: a check failed
  6  measured: UNDECIDED (the tolerance lies inside the uncertainty, the uncertainty
     is incomplete, or the model does not fit)
  7  done, but the recording is incomplete: frames were lost, or parts of its file are
     missing or unreadable

Results go to stdout, progress and messages to stderr. With --json, stdout receives exactly one JSON
value: the result, or {\"problem\": …} with kind, exit_code, what, file, entry, causes and remedy.";

/// Multi-line laser scanning: from a folder of images to a calibrated scanner and measured parts.
#[derive(Debug, Parser)]
#[command(name = "sheaf", version, about, after_help = EXIT_CODES, propagate_version = true)]
pub struct Cli {
    /// Output options.
    #[command(flatten)]
    pub output: OutputOptions,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// Output options.
#[derive(Debug, Clone, Args)]
pub struct OutputOptions {
    /// Print the result as one JSON value on stdout, or write it to FILE.
    #[arg(long, global = true, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<JsonTo>,
    /// No progress and no notes on stderr; warnings and errors remain.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// Destination of the JSON result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JsonTo {
    /// To stdout, instead of the text.
    Stdout,
    /// To a file, in addition to the text on stdout.
    File(PathBuf),
}

impl FromStr for JsonTo {
    type Err = Infallible;

    fn from_str(argument: &str) -> Result<Self, Infallible> {
        Ok(if argument == "-" { Self::Stdout } else { Self::File(argument.into()) })
    }
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Calibrate camera, light sheets and stage from a capture folder.
    #[command(after_help = EXIT_CODES)]
    Calibrate(CalibrateArgs),
    /// Calibrate the axis of a turntable from a full-turn scan of a part, without a board.
    #[command(after_help = EXIT_CODES)]
    Axis(AxisArgs),
    /// Compute a point cloud, and optionally a mesh, from a scan in a capture folder.
    #[command(after_help = EXIT_CODES)]
    Scan(ScanArgs),
    /// Triangulate labelled pixels: CSV with order,u_px,v_px on stdin, the same rows with x_mm,y_mm,z_mm,sigma_mm
    /// (camera frame) on stdout.
    #[command(after_help = EXIT_CODES)]
    Triangulate(TriangulateArgs),
    /// Extract the laser lines of images with sub-pixel accuracy.
    #[command(after_help = EXIT_CODES)]
    Centrelines(CentrelinesArgs),
    /// Write a calibration board as a PDF page at true scale, with a ruler to check the print.
    #[command(after_help = EXIT_CODES)]
    Target(TargetArgs),
    /// Detect the corners of a chessboard or ChArUco board, or the centres of a circle grid, in images.
    #[command(after_help = EXIT_CODES)]
    Corners(CornersArgs),
    /// Measure a point cloud: value, uncertainty and, with a tolerance, the verdict.
    #[command(after_help = EXIT_CODES)]
    Measure(MeasureArgs),
    /// Inspect a point cloud with a recipe file, as the service does.
    #[command(after_help = EXIT_CODES)]
    Inspect(InspectArgs),
    /// Compare a point cloud with the nominal surface of its part: deviations, worst places and, with a tolerance, the
    /// verdict.
    #[command(after_help = EXIT_CODES)]
    Compare(CompareArgs),
    /// Inspect, export or repair a recording (MCAP).
    #[command(after_help = EXIT_CODES)]
    Recording(RecordingArgs),
    /// Numerical studies of the method.
    #[command(after_help = EXIT_CODES)]
    Study(StudyArgs),
    /// Benchmark this machine.
    #[command(after_help = EXIT_CODES)]
    Bench(BenchArgs),
    /// The simulated station.
    #[command(after_help = EXIT_CODES)]
    Twin(TwinArgs),
    /// Render a small station, calibrate it with all three models, scan two parts, and compare with the truth.
    #[command(after_help = EXIT_CODES)]
    Demo(DemoArgs),
    /// Run the service: REST under /api/v1, live stream, API documentation at /docs. Prints its URL once it is listening;
    /// SHEAF_LOG sets the log level.
    #[command(after_help = EXIT_CODES)]
    Serve(ServeArgs),
    /// Print the effective configuration and the origin of each value.
    #[command(after_help = EXIT_CODES)]
    Config(SettingsArgs),
    /// List attached devices and the settings that select them. Opens none of them.
    #[command(after_help = EXIT_CODES)]
    Devices,
    /// Check the configured station, first without motion and laser, then, if you agree, with both; ends with a table of
    /// check, figure, limit and remedy. The service must not use the same devices.
    #[command(after_help = EXIT_CODES)]
    Doctor(DoctorArgs),
    /// Print the OpenAPI document of the service.
    Openapi(OpenapiArgs),
}
