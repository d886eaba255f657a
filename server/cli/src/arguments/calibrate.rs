//! `sheaf calibrate`: which capture, which light model, which lens.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use optics::LightModelKind;

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
    /// Only if the pictures distinguish it from zero.
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

/// `sheaf axis`.
#[derive(Debug, Args)]
pub struct AxisArgs {
    /// Capture folder, with `capture.json`.
    pub capture: PathBuf,
    /// The calibration of camera and light.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: PathBuf,
    /// The scan that shows the part all round, a bit more than a turn.
    #[arg(long)]
    pub scan: String,
    /// Where the calibration with the axis goes.
    #[arg(short, long, value_name = "CAL.json")]
    pub output: PathBuf,
    /// A point within some millimetres of the axis, camera frame; else the calibration's own, or the middle of its depths before
    /// the camera.
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    pub near_mm: Option<Vec<f64>>,
    /// Which way the axis points, within a few degrees: growing angles turn the part about it by the right-hand rule; else the
    /// calibration's own, or along the lines (upwards, or to the right).
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    pub along: Option<Vec<f64>>,
}
