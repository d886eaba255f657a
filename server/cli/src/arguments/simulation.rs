//! What is computed without a station: studies, the twin, the demo.

use std::path::PathBuf;

use app::config::{GAUGE_HEIGHT_MM, SPHERE_RADIUS_MM};
use clap::{Args, Subcommand, ValueEnum};

use crate::arguments::images::LineDirectionArg;

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
    /// The stage is a turntable; frames of a scan are spread over 375°.
    #[arg(long)]
    pub rotary: bool,
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
    /// How far from the standoff the lines are √2 times as wide as there; without it they are equally wide everywhere.
    #[arg(long, value_name = "MM")]
    pub focus_depth_mm: Option<f64>,
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
