//! Arguments of commands without a station: studies, the twin, the demo.

use std::path::PathBuf;

use app::config::{GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM};
use clap::{Args, Subcommand, ValueEnum};

use crate::arguments::images::LineDirectionArg;

/// `sheaf study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// The study.
    #[command(subcommand)]
    pub study: Study,
}

/// The studies.
#[derive(Debug, Subcommand)]
pub enum Study {
    /// Monte Carlo study in the regime of the paper: the three models compared, where plane models fail, the Cramér–Rao
    /// bound.
    Paper(StudyPaperArgs),
}

/// `sheaf study paper`.
#[derive(Debug, Args)]
pub struct StudyPaperArgs {
    /// Seeds per row of the first table.
    #[arg(long, default_value_t = 100)]
    pub seeds: u64,
    /// Output file of the plot.
    #[arg(long, value_name = "PLOT.html", default_value = "study-paper.html")]
    pub plot: PathBuf,
}

/// `sheaf twin`.
#[derive(Debug, Args)]
pub struct TwinArgs {
    /// Subcommands of `sheaf twin`.
    #[command(subcommand)]
    pub action: TwinAction,
}

/// Subcommands of `sheaf twin`.
#[derive(Debug, Subcommand)]
pub enum TwinAction {
    /// Render a capture folder together with its ground truth.
    Capture(TwinCaptureArgs),
}

/// Scene on the simulated stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SceneArg {
    /// A gauge block of 8.9 mm on a plate.
    Gauge,
    /// A sphere of radius 18.9 mm on a plate.
    Sphere,
    /// The empty plate.
    Plate,
    /// A freeform surface on a plate.
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

/// `sheaf twin capture`.
#[derive(Debug, Args)]
pub struct TwinCaptureArgs {
    /// Scene on the stage; several, separated by commas, are scanned one after another.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "gauge")]
    pub scene: Vec<SceneArg>,
    /// Random seed of the station and its noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Capture folder to create.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Board poses.
    #[arg(long, default_value_t = 12)]
    pub poses: usize,
    /// Frames per scan.
    #[arg(long, default_value_t = 40)]
    pub frames: usize,
    /// Parameters of the station.
    #[command(flatten)]
    pub station: StationArgs,
}

/// Parameters of the simulated station; default: 1280 × 1024 pixels at 400 mm with five red lines.
#[derive(Debug, Clone, Default, Args)]
pub struct StationArgs {
    /// Image width.
    #[arg(long, value_name = "PX")]
    pub width_px: Option<usize>,
    /// Image height.
    #[arg(long, value_name = "PX")]
    pub height_px: Option<usize>,
    /// Bits per pixel: 8 or 16.
    #[arg(long)]
    pub bits: Option<u32>,
    /// Wavelength of the laser.
    #[arg(long, value_name = "NM")]
    pub wavelength_nm: Option<f64>,
    /// Groove density of the grating.
    #[arg(long, value_name = "PER_MM")]
    pub grating_lines_per_mm: Option<f64>,
    /// Visible diffraction orders, separated by commas.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true)]
    pub orders: Option<Vec<i8>>,
    /// Direction of the lines.
    #[arg(long, value_enum)]
    pub line_direction: Option<LineDirectionArg>,
    /// The stage is a turntable; frames of a scan are spread over 375°.
    #[arg(long)]
    pub rotary: bool,
    /// Distance to the middle of the working volume.
    #[arg(long, value_name = "MM")]
    pub standoff_mm: Option<f64>,
    /// Half the field of view (width) at the standoff.
    #[arg(long, value_name = "MM")]
    pub field_half_width_mm: Option<f64>,
    /// Tilt of the grating relative to the optical axis of the laser.
    #[arg(long, value_name = "DEG")]
    pub grating_tilt_deg: Option<f64>,
    /// Relative error of the nominal λ/d_g.
    #[arg(long, value_name = "RATIO", allow_hyphen_values = true)]
    pub wavelength_over_period_error: Option<f64>,
    /// Mean peak level of the brightest line on white, as a fraction of full scale; above 1 it saturates.
    #[arg(long, value_name = "RATIO")]
    pub line_peak: Option<f64>,
    /// Standard deviation of a line's profile at the standoff, before lens blur.
    #[arg(long, value_name = "PX")]
    pub line_sigma_px: Option<f64>,
    /// Distance from the standoff at which lines are √2 times wider; default: the same width everywhere.
    #[arg(long, value_name = "MM")]
    pub focus_depth_mm: Option<f64>,
    /// Speckle contrast: standard deviation divided by mean, 0 to 1.
    #[arg(long)]
    pub speckle_contrast: Option<f64>,
    /// Full width at half maximum of the speckle correlation.
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
    /// Random seed of the station and its noise.
    #[arg(long, default_value_t = 7)]
    pub seed: u64,
}
