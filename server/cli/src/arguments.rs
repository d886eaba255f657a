//! The command line: what can be asked of `sheaf`, as types.

mod bench;

use std::convert::Infallible;
use std::path::PathBuf;
use std::str::FromStr;

use app::config::{GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM};
use capture::ChannelChoice;
use clap::{Args, Parser, Subcommand, ValueEnum};
use optics::LightModelKind;

pub use bench::{
    BenchArgs, BenchBoardsArgs, BenchCentrelinesArgs, BenchCloudArgs, BenchProfilesArgs, BenchServerArgs,
    BenchStreamArgs, BenchSubject,
};

/// Printed below every `--help`.
const EXIT_CODES: &str = "\
Exit codes:
  0  done (with a tolerance: OK)
  1  internal error
  2  wrong usage of the command line
  3  bad input: a file is missing, damaged, malformed or of the wrong size
  4  the data cannot carry the result: the quantity that stays undetermined is named
  5  measured: NOT OK
  6  measured: UNDECIDED (the tolerance lies inside the uncertainty, the uncertainty
     is incomplete, or the model does not fit)

Results go to stdout, progress and messages to stderr. With --json stdout holds exactly one JSON value:
the result, or {\"problem\": …} naming what, file, entry, cause and remedy.";

/// Multi-line laser scanning: a folder of pictures in, a calibrated scanner and measured parts out.
#[derive(Debug, Parser)]
#[command(name = "sheaf", version, about, after_help = EXIT_CODES, propagate_version = true)]
pub struct Cli {
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// How to talk.
#[derive(Debug, Clone, Args)]
pub struct Voice {
    /// Print the result as one JSON value on stdout, or write it to FILE.
    #[arg(long, global = true, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<JsonTo>,
    /// No progress and no notes on stderr; warnings and errors remain.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// Where the result goes as JSON.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JsonTo {
    /// Onto stdout, instead of the text.
    Stdout,
    /// Into a file, beside the text on stdout.
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
    /// Turn a scan of a capture folder into a point cloud, and into a mesh if asked.
    #[command(after_help = EXIT_CODES)]
    Scan(ScanArgs),
    /// Triangulate labelled pixels: CSV with order,u_px,v_px on stdin, the same rows with x_mm,y_mm,z_mm,sigma_mm
    /// (camera frame) on stdout.
    #[command(after_help = EXIT_CODES)]
    Triangulate(TriangulateArgs),
    /// Find the laser lines of images with sub-pixel accuracy.
    #[command(after_help = EXIT_CODES)]
    Centrelines(CentrelinesArgs),
    /// Write a calibration board as a PDF page, true to scale, with a ruler to check the print.
    #[command(after_help = EXIT_CODES)]
    Target(TargetArgs),
    /// Find the corners of a chessboard or ChArUco board, or the centres of a circle grid, in images.
    #[command(after_help = EXIT_CODES)]
    Corners(CornersArgs),
    /// Measure a point cloud: value, uncertainty and, with a tolerance, the verdict.
    #[command(after_help = EXIT_CODES)]
    Measure(MeasureArgs),
    /// Numerical studies of the method.
    #[command(after_help = EXIT_CODES)]
    Study(StudyArgs),
    /// How fast this machine does what a scan does for every frame.
    #[command(after_help = EXIT_CODES)]
    Bench(BenchArgs),
    /// The simulated station.
    #[command(after_help = EXIT_CODES)]
    Twin(TwinArgs),
    /// Render a small station, calibrate it by all three models, scan two parts, compare with the truth.
    #[command(after_help = EXIT_CODES)]
    Demo(DemoArgs),
    /// The service: REST under /api/v1, live stream, API page at /docs; prints its URL once it listens. SHEAF_LOG sets
    /// what is logged.
    #[command(after_help = EXIT_CODES)]
    Serve(ServeArgs),
    /// The configuration in force, and where each value came from.
    #[command(after_help = EXIT_CODES)]
    Config(SettingsArgs),
    /// What is attached to this computer, and the setting that chooses it. Opens nothing.
    #[command(after_help = EXIT_CODES)]
    Devices,
    /// Try the configured station, first without moving or shining, then, if you agree, with; ends with a table of check,
    /// figure, limit and remedy. The service must not run on the same devices.
    #[command(after_help = EXIT_CODES)]
    Doctor(DoctorArgs),
    /// The document of the service's API (OpenAPI).
    Openapi(OpenapiArgs),
}

/// Light model on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum LightModelArg {
    /// The one that cross-validation over the poses recommends.
    #[default]
    Auto,
    /// One free plane per order.
    Planes,
    /// Planes through one line at the angles of the grating equation.
    Pencil,
    /// The exact curved sheets of the vector grating equation.
    Grating,
}

impl LightModelArg {
    /// The model asked for; `None` for `auto`.
    pub fn kind(self) -> Option<LightModelKind> {
        match self {
            Self::Auto => None,
            Self::Planes => Some(LightModelKind::Planes),
            Self::Pencil => Some(LightModelKind::Pencil),
            Self::Grating => Some(LightModelKind::Grating),
        }
    }
}

/// k3 on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum K3Arg {
    /// Only if the pictures tell it apart from zero.
    #[default]
    Auto,
    /// Always.
    Free,
    /// Never: k3 = 0.
    Zero,
}

impl K3Arg {
    /// The choice as the calibration takes it; `None` decides by significance.
    pub fn estimate(self) -> Option<bool> {
        match self {
            Self::Auto => None,
            Self::Free => Some(true),
            Self::Zero => Some(false),
        }
    }
}

/// `sheaf calibrate`.
#[derive(Debug, Args)]
pub struct CalibrateArgs {
    /// Capture folder, with `capture.json`.
    pub capture: PathBuf,
    /// Where the calibration document goes.
    #[arg(short, long, value_name = "CAL.json")]
    pub output: PathBuf,
    /// Light model of the result.
    #[arg(long, value_enum, default_value_t)]
    pub light_model: LightModelArg,
    /// Also write a self-contained HTML report.
    #[arg(long, value_name = "REPORT.html")]
    pub report: Option<PathBuf>,
    /// Whether the sixth-power distortion k3 is estimated.
    #[arg(long, value_enum, default_value_t)]
    pub k3: K3Arg,
    /// Go on without board and laser pictures that cannot be read even if they are the most.
    #[arg(long)]
    pub leave_out_unreadable: bool,
}

/// Kind of a board on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum TargetKind {
    /// Black and white squares; the whole board must be in every picture.
    #[default]
    Chessboard,
    /// With markers in the white squares: a part of the board in sight is enough.
    Charuco,
    /// Discs in rows and columns; all of them must be in every picture.
    Circles,
    /// Discs of which every other row is shifted by half their distance, as OpenCV's asymmetric grid.
    AsymmetricCircles,
}

/// `sheaf target`.
#[derive(Debug, Args)]
pub struct TargetArgs {
    /// Kind of the board.
    #[arg(long, value_enum, default_value_t)]
    pub kind: TargetKind,
    /// Squares along a row (12), or circles in a row (9; asymmetric 4). One even and one odd count of squares make a
    /// chessboard that cannot be mistaken for itself turned round.
    #[arg(long)]
    pub columns: Option<usize>,
    /// Squares along a column (9), or rows of circles (7; asymmetric 11, an odd number for a grid that cannot be mistaken
    /// for itself turned round).
    #[arg(long)]
    pub rows: Option<usize>,
    /// Side of a square, or distance of neighbouring circles; asymmetric: distance of the rows.
    #[arg(long, value_name = "MM", default_value_t = 20.0)]
    pub square_mm: f64,
    /// charuco: OpenCV's name of the markers' dictionary.
    #[arg(long, default_value = "DICT_5X5_100")]
    pub dictionary: String,
    /// The page; the smallest of A4 to A0 that holds the board.
    #[arg(short, long, value_name = "TARGET.pdf")]
    pub output: PathBuf,
}

/// `sheaf scan`.
#[derive(Debug, Args)]
pub struct ScanArgs {
    /// Capture folder, with `capture.json`.
    pub capture: PathBuf,
    /// Calibration document.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: PathBuf,
    /// Name of the scan in the capture.
    #[arg(long, value_name = "NAME")]
    pub scan: String,
    /// Where the cloud goes: .ply, .csv, .pcd or .e57.
    #[arg(short, long, value_name = "CLOUD.ply")]
    pub output: PathBuf,
    /// Also write a mesh: .stl, .glb or .ply.
    #[arg(long, value_name = "PART.stl")]
    pub mesh: Option<PathBuf>,
    /// Also write a self-contained HTML report.
    #[arg(long, value_name = "REPORT.html")]
    pub report: Option<PathBuf>,
}

/// `sheaf triangulate`.
#[derive(Debug, Args)]
pub struct TriangulateArgs {
    /// Calibration document.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: PathBuf,
    /// Standard deviation of the pixels across their line; adds image noise to sigma_mm, which otherwise states
    /// the calibration's own uncertainty.
    #[arg(long, value_name = "PX", default_value_t = 0.0)]
    pub pixel_sigma: f64,
}

/// Line direction on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum LineDirectionArg {
    /// Lines run along rows: one crossing per column and line.
    #[default]
    Rows,
    /// Lines run along columns: one crossing per row and line.
    Columns,
}

impl From<LineDirectionArg> for vision::LineDirection {
    fn from(arg: LineDirectionArg) -> Self {
        match arg {
            LineDirectionArg::Rows => Self::Rows,
            LineDirectionArg::Columns => Self::Columns,
        }
    }
}

/// Line direction on the command line, where it may be either.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum DirectionArg {
    /// Lines run along rows: one crossing per column and line.
    #[default]
    Rows,
    /// Lines run along columns: one crossing per row and line.
    Columns,
    /// Lines run either way: each piece as it runs.
    Both,
}

impl From<DirectionArg> for pipeline::Directions {
    fn from(arg: DirectionArg) -> Self {
        match arg {
            DirectionArg::Rows => Self::One(vision::LineDirection::Rows),
            DirectionArg::Columns => Self::One(vision::LineDirection::Columns),
            DirectionArg::Both => Self::Both,
        }
    }
}

/// A rectangle on the command line: first column, first row, columns, rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RoiArg([usize; 4]);

impl FromStr for RoiArg {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        const WANTED: &str = "write U,V,WIDTH,HEIGHT in whole pixels, such as 100,0,640,480";
        let numbers: Option<Vec<usize>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
        let numbers: [usize; 4] = numbers.and_then(|numbers| numbers.try_into().ok()).ok_or(WANTED)?;
        if numbers[2] == 0 || numbers[3] == 0 { Err(WANTED) } else { Ok(Self(numbers)) }
    }
}

impl From<RoiArg> for pipeline::Region {
    fn from(RoiArg([u, v, width, height]): RoiArg) -> Self {
        Self { u, v, width, height }
    }
}

/// Centreline method on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum CentrelineMethodArg {
    /// Gaussian derivatives, Hessian, offset along the normal.
    #[default]
    Steger,
    /// Grey-level centroid per scan column.
    CentreOfGravity,
}

impl From<CentrelineMethodArg> for vision::CentrelineMethod {
    fn from(arg: CentrelineMethodArg) -> Self {
        match arg {
            CentrelineMethodArg::Steger => Self::Steger,
            CentrelineMethodArg::CentreOfGravity => Self::CentreOfGravity,
        }
    }
}

/// `sheaf centrelines`.
#[derive(Debug, Args)]
pub struct CentrelinesArgs {
    /// Images: PNG, TIFF, BMP or JPEG, 8 or 16 bit, grey or colour.
    #[arg(required_unless_present = "pairs", value_name = "IMAGE")]
    pub images: Vec<PathBuf>,
    /// Folder for both: a CSV and a picture with the lines drawn over it (NAME-lines.png) per image.
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["csv", "picture"])]
    pub output: Option<PathBuf>,
    /// Folder for one CSV per image: u_px,v_px,sigma_px,intensity,width_px.
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Folder for one picture per image with the lines drawn over it.
    #[arg(long, value_name = "DIR")]
    pub picture: Option<PathBuf>,
    /// Which way the lines run.
    #[arg(long, alias = "line-direction", value_enum, default_value_t)]
    pub direction: DirectionArg,
    /// How the centre is found.
    #[arg(long, value_enum, default_value_t)]
    pub method: CentrelineMethodArg,
    /// What is looked at of colour pictures: red, green, blue, luma, red-minus-others (or green-, blue-), or auto, decided
    /// from the pictures and said in the output.
    #[arg(long, value_name = "CHANNEL", default_value_t)]
    pub channel: ChannelChoice,
    /// Pictures with the laser off, taken away before lines are looked for: one for all images, or one for each in their
    /// order.
    #[arg(long, value_name = "IMAGE", num_args = 1..)]
    pub background: Vec<PathBuf>,
    /// A list of images with their backgrounds instead: one pair a line, LASER_ON,LASER_OFF, relative to the list's folder.
    #[arg(long, value_name = "LIST.csv", conflicts_with_all = ["images", "background"])]
    pub pairs: Option<PathBuf>,
    /// Keeps points inside a rectangle only: first column, first row, columns, rows.
    #[arg(long, value_name = "U,V,WIDTH,HEIGHT")]
    pub roi: Option<RoiArg>,
    /// Fewest points of a piece of line.
    #[arg(long, value_name = "POINTS", default_value_t = 1)]
    pub min_length: usize,
    /// Least median height of a piece over its surroundings, in grey levels; 4 of 255 of JPEG if not given, else 0.
    #[arg(long, value_name = "LEVELS")]
    pub min_contrast: Option<f32>,
}

/// `sheaf corners`.
#[derive(Debug, Args)]
pub struct CornersArgs {
    /// Images: PNG, TIFF, BMP or JPEG, 8 or 16 bit, grey or colour.
    #[arg(required = true, value_name = "IMAGE")]
    pub images: Vec<PathBuf>,
    /// Kind of the board.
    #[arg(long, value_enum, default_value_t)]
    pub kind: TargetKind,
    /// chessboard: inner corners along a board row; charuco: squares; circles: circles.
    #[arg(long)]
    pub columns: usize,
    /// The same along a board column.
    #[arg(long)]
    pub rows: usize,
    /// charuco: side of a marker over the side of a square.
    #[arg(long, default_value_t = 0.7)]
    pub marker_share: f64,
    /// charuco: OpenCV's name of the markers' dictionary.
    #[arg(long, default_value = "DICT_5X5_100")]
    pub dictionary: String,
    /// Folder for one CSV per image: row,column,u_px,v_px,sigma_px.
    #[arg(long, value_name = "DIR")]
    pub csv: PathBuf,
}

/// What to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ToolArg {
    /// Distance of the dominant plane from the camera.
    Plane,
    /// Radius of a sphere.
    Sphere,
    /// Radius of a cylinder.
    Cylinder,
    /// Height of a face over the one that surrounds it; below zero for a pocket.
    Step,
    /// Distance between two parallel faces or two spheres.
    Distance,
    /// Angle between the two largest planes, degrees.
    Angle,
    /// Flatness of the dominant plane.
    Flatness,
}

impl From<ToolArg> for metrology::Tool {
    fn from(arg: ToolArg) -> Self {
        match arg {
            ToolArg::Plane => Self::Plane,
            ToolArg::Sphere => Self::Sphere,
            ToolArg::Cylinder => Self::Cylinder,
            ToolArg::Step => Self::Step,
            ToolArg::Distance => Self::Distance,
            ToolArg::Angle => Self::Angle,
            ToolArg::Flatness => Self::Flatness,
        }
    }
}

/// `sheaf measure`.
#[derive(Debug, Args)]
pub struct MeasureArgs {
    /// Point cloud written by `sheaf scan`.
    pub cloud: PathBuf,
    /// What to measure.
    #[arg(long, value_enum)]
    pub tool: ToolArg,
    /// Nominal value (mm; degrees for an angle; below zero for a pocket's depth).
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub nominal_mm: Option<f64>,
    /// Symmetric tolerance around the nominal; asks for a verdict by ISO 14253-1.
    #[arg(long, value_name = "MM", requires = "nominal_mm")]
    pub tolerance_mm: Option<f64>,
    /// Look only inside this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_delimiter = ',', num_args = 6, allow_negative_numbers = true)]
    pub region_mm: Option<Vec<f64>>,
    /// Calibration document; by default the one that the cloud carries.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: Option<PathBuf>,
    /// Seed of the search; the same seed gives the same result.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// `sheaf study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// Which study.
    #[command(subcommand)]
    pub study: Study,
}

/// The studies.
#[derive(Debug, Subcommand)]
pub enum Study {
    /// The paper's regime by Monte Carlo: the three models side by side, where planes break, the Cramér–Rao bound.
    Paper(StudyPaperArgs),
}

/// `sheaf study paper`.
#[derive(Debug, Args)]
pub struct StudyPaperArgs {
    /// Seeds per row of the first table.
    #[arg(long, default_value_t = 100)]
    pub seeds: u64,
    /// Where the plot goes.
    #[arg(long, value_name = "PLOT.html", default_value = "study-paper.html")]
    pub plot: PathBuf,
}

/// `sheaf twin`.
#[derive(Debug, Args)]
pub struct TwinArgs {
    /// What the twin does.
    #[command(subcommand)]
    pub action: TwinAction,
}

/// What the twin does.
#[derive(Debug, Subcommand)]
pub enum TwinAction {
    /// Render a capture folder with the truth beside it.
    Capture(TwinCaptureArgs),
}

/// What lies on the simulated stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SceneArg {
    /// A gauge block of 8.9 mm on a plate.
    Gauge,
    /// A ball of radius 18.9 mm on a plate.
    Sphere,
    /// The bare plate.
    Plate,
    /// Smooth hills on a plate.
    Freeform,
}

impl From<SceneArg> for twin::SceneKind {
    fn from(arg: SceneArg) -> Self {
        match arg {
            SceneArg::Gauge => Self::Gauge { height_mm: GAUGE_HEIGHT_MM },
            SceneArg::Sphere => Self::Sphere { radius_mm: SPHERE_RADIUS_MM },
            SceneArg::Plate => Self::Plate,
            SceneArg::Freeform => Self::Freeform,
        }
    }
}

/// `sheaf openapi`.
#[derive(Debug, Args)]
pub struct OpenapiArgs {
    /// The catalogue of events instead, as Markdown.
    #[arg(long)]
    pub events: bool,
}

/// `sheaf twin capture`.
#[derive(Debug, Args)]
pub struct TwinCaptureArgs {
    /// What lies on the stage; several, separated by commas, are scanned one after another.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "gauge")]
    pub scene: Vec<SceneArg>,
    /// Seed of the station and of its noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Capture folder to make.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Board poses.
    #[arg(long, default_value_t = 12)]
    pub poses: usize,
    /// Frames per scan.
    #[arg(long, default_value_t = 40)]
    pub frames: usize,
    /// What the station is like.
    #[command(flatten)]
    pub station: StationArgs,
}

/// What the simulated station is like; by default 1280 × 1024 pixels at 400 mm with five red lines.
#[derive(Debug, Clone, Default, Args)]
pub struct StationArgs {
    /// Image columns.
    #[arg(long, value_name = "PX")]
    pub width_px: Option<usize>,
    /// Image rows.
    #[arg(long, value_name = "PX")]
    pub height_px: Option<usize>,
    /// Bits per pixel: 8 or 16.
    #[arg(long)]
    pub bits: Option<u32>,
    /// Wavelength of the laser.
    #[arg(long, value_name = "NM")]
    pub wavelength_nm: Option<f64>,
    /// Grooves per millimetre.
    #[arg(long)]
    pub grating_lines_per_mm: Option<f64>,
    /// Orders that carry light, separated by commas.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true)]
    pub orders: Option<Vec<i8>>,
    /// Which way the lines run.
    #[arg(long, value_enum)]
    pub line_direction: Option<LineDirectionArg>,
    /// Distance to the middle of the working volume.
    #[arg(long, value_name = "MM")]
    pub standoff_mm: Option<f64>,
    /// Half of what the image's width covers at the standoff.
    #[arg(long, value_name = "MM")]
    pub field_half_width_mm: Option<f64>,
    /// Tilt of the grating against the light's axis.
    #[arg(long, value_name = "DEG")]
    pub grating_tilt_deg: Option<f64>,
    /// Relative error of the true λ/d_g against the data sheets.
    #[arg(long, value_name = "RATIO", allow_hyphen_values = true)]
    pub wavelength_over_period_error: Option<f64>,
    /// Mean ridge of the brightest line on white, as a fraction of full scale; above 1 it saturates.
    #[arg(long, value_name = "RATIO")]
    pub line_peak: Option<f64>,
    /// Standard deviation of a line's profile at the standoff, before lens blur.
    #[arg(long, value_name = "PX")]
    pub line_sigma_px: Option<f64>,
    /// Standard deviation of the speckle over its mean, 0–1.
    #[arg(long)]
    pub speckle_contrast: Option<f64>,
    /// Full width at half height of the speckle's correlation.
    #[arg(long, value_name = "PX")]
    pub speckle_grain_px: Option<f64>,
    /// Grey levels (of 255) of ambient light on white in laser images.
    #[arg(long)]
    pub ambient_levels: Option<f64>,
}

/// `sheaf demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder for captures, clouds, mesh and report.
    #[arg(long, value_name = "DIR", default_value = "sheaf-demo")]
    pub out: PathBuf,
    /// Seed of the station and of its noise.
    #[arg(long, default_value_t = 7)]
    pub seed: u64,
}

/// `sheaf serve`.
#[derive(Debug, Args)]
pub struct ServeArgs {
    /// How it is set up.
    #[command(flatten)]
    pub settings: SettingsArgs,
}

/// `sheaf doctor`.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Move and shine without asking: the area is clear, and eyes are safe.
    #[arg(long)]
    pub yes: bool,
    /// Exposure, µs; as the camera is set if not given.
    #[arg(long, value_name = "US")]
    pub exposure_us: Option<f64>,
    /// Gain, dB; as the camera is set if not given.
    #[arg(long, value_name = "DB")]
    pub gain_db: Option<f64>,
    /// Frames per second; as the camera is set if not given.
    #[arg(long, value_name = "HZ")]
    pub frame_rate_hz: Option<f64>,
    /// Share of full laser power, above 0 to 1.
    #[arg(long, value_name = "SHARE", default_value_t = 1.0, value_parser = power)]
    pub power: f64,
    /// How the station is set up; the board under [target] is that of the stage's scale.
    #[command(flatten)]
    pub settings: SettingsArgs,
}

fn power(text: &str) -> Result<f64, &'static str> {
    let share = text.parse().ok().filter(|share: &f64| *share > 0.0 && *share <= 1.0);
    share.ok_or("write a share of full power above 0 and up to 1")
}

/// What the command line says about the configuration; it wins over environment (SHEAF_…) and file.
#[derive(Debug, Clone, Default, Args)]
pub struct SettingsArgs {
    /// Address and port; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub listen: Option<String>,
    /// Folder of everything that is kept.
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Configuration file; by default DIR/sheaf.toml, if it is there.
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Any other setting, such as station.twin.scene=gauge; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}
