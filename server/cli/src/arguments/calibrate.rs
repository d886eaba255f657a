//! Arguments of `sheaf calibrate` and `sheaf axis`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use optics::LightModelKind;

use super::numbers::numbers;

/// Light model on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum LightModelArg {
    /// The one recommended by cross-validation over the poses.
    #[default]
    Auto,
    /// One free plane per order.
    Planes,
    /// A pencil of planes through one line, at the angles of the grating equation.
    Pencil,
    /// The exact curved sheets of the vector grating equation.
    Grating,
}

impl LightModelArg {
    /// The requested model; `None` for `auto`.
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
    /// Only if it is significantly different from zero.
    #[default]
    Auto,
    /// Always.
    Free,
    /// Never: k3 = 0.
    Zero,
}

impl K3Arg {
    /// The choice; `None` decides by significance.
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
    /// Output file of the calibration document.
    #[arg(short, long, value_name = "CAL.json")]
    pub output: PathBuf,
    /// Light model of the result.
    #[arg(long, value_enum, default_value_t)]
    pub light_model: LightModelArg,
    /// Also write a self-contained HTML report.
    #[arg(long, value_name = "REPORT.html")]
    pub report: Option<PathBuf>,
    /// Also write a Digital Calibration Certificate (DCC) by the `certificate` settings of the configuration.
    #[arg(long, value_name = "CERTIFICATE.xml")]
    pub certificate: Option<PathBuf>,
    /// Configuration file for the certificate; default: that of the service.
    #[arg(long, value_name = "FILE", requires = "certificate")]
    pub config: Option<PathBuf>,
    /// Whether to estimate the sixth-power radial distortion k3.
    #[arg(long, value_enum, default_value_t)]
    pub k3: K3Arg,
    /// Ignore unreadable board and laser images even if most are unreadable.
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
    /// Scan of the part over slightly more than a full turn.
    #[arg(long)]
    pub scan: String,
    /// Output file of the calibration with the axis.
    #[arg(short, long, value_name = "CAL.json")]
    pub output: PathBuf,
    /// Initial point on the axis, to a few millimetres, camera frame; default: that of the calibration, or the middle of
    /// its depth range in front of the camera.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true)]
    pub near_mm: Option<[f64; 3]>,
    /// Initial direction of the axis, to a few degrees; positive angles turn the part by the right-hand rule. Default:
    /// that of the calibration, or along the lines (upwards, or to the right).
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true)]
    pub along: Option<[f64; 3]>,
}
