//! Arguments of `sheaf scan`, `measure`, `inspect` and `compare`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::numbers::numbers;

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
    /// Output file of the cloud: .ply, .csv, .pcd or .e57.
    #[arg(short, long, value_name = "CLOUD.ply")]
    pub output: PathBuf,
    /// Also write a mesh: .stl, .glb or .ply.
    #[arg(long, value_name = "PART.stl")]
    pub mesh: Option<PathBuf>,
    /// Also write a self-contained HTML report.
    #[arg(long, value_name = "REPORT.html")]
    pub report: Option<PathBuf>,
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
    /// Height of a face above the surrounding face; negative for a pocket.
    Step,
    /// Distance between two parallel faces or two spheres.
    Distance,
    /// Angle between the two largest planes, in degrees.
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
    #[arg(long, value_enum, required_unless_present = "plan")]
    pub tool: Option<ToolArg>,
    /// Measure all characteristics of this plan instead; the verdict is that of the part.
    #[arg(long, value_name = "PLAN.json", conflicts_with_all = ["tool", "nominal_mm", "tolerance_mm", "region_mm", "seed"])]
    pub plan: Option<PathBuf>,
    /// Nominal value in mm, for an angle in degrees; negative for a pocket.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub nominal_mm: Option<f64>,
    /// Symmetric tolerance around the nominal value; required for a verdict according to ISO 14253-1.
    #[arg(long, value_name = "MM", requires = "nominal_mm")]
    pub tolerance_mm: Option<f64>,
    /// Only use points in this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_parser = numbers::<6>, allow_hyphen_values = true)]
    pub region_mm: Option<[f64; 6]>,
    /// Calibration document; default: the one stored in the cloud.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: Option<PathBuf>,
    /// Random seed of the search; the same seed gives the same result.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// `sheaf inspect`.
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// Point cloud written by `sheaf scan`, or downloaded from a station.
    pub cloud: PathBuf,
    /// The recipe: a file exported by a station.
    #[arg(long, value_name = "RECIPE.json")]
    pub recipe: PathBuf,
    /// Serial number of the part, for the result.
    #[arg(long, value_name = "SERIAL")]
    pub serial: Option<String>,
    /// Calibration document; default: the one stored in the cloud.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: Option<PathBuf>,
}

/// `sheaf compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Point cloud written by `sheaf scan`.
    pub cloud: PathBuf,
    /// CAD model of the part: .stl or .ply in mm, or .glb in metres.
    pub part: PathBuf,
    /// Align by the datums of this plan; the CAD model must be in the datum frame.
    #[arg(long, value_name = "PLAN.json")]
    pub plan: Option<PathBuf>,
    /// Align by a best fit of all points to the surface, starting from the datums if a plan is given, otherwise from
    /// --start.
    #[arg(long, required_unless_present = "plan")]
    pub best_fit: bool,
    /// Initial pose of the CAD model in the scan: position of its origin in mm, then rotations about the fixed axes x, y
    /// and z, in this order, in degrees; default: all zero.
    #[arg(
        long,
        value_name = "X,Y,Z,RX,RY,RZ",
        value_parser = numbers::<6>,
        allow_hyphen_values = true,
        conflicts_with = "plan"
    )]
    pub start: Option<[f64; 6]>,
    /// Symmetric tolerance of the deviations; required for a verdict according to ISO 14253-1.
    #[arg(long, value_name = "MM")]
    pub tolerance_mm: Option<f64>,
    /// Maximum distance of points that are compared with the surface; default: 2 % of the diagonal of the part.
    #[arg(long, value_name = "MM")]
    pub reach_mm: Option<f64>,
    /// Capture range of the best fit: maximum initial distance from the surface; default: 6 % of the diagonal of the part.
    #[arg(long, value_name = "MM")]
    pub capture_mm: Option<f64>,
    /// Only use points in this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_parser = numbers::<6>, allow_hyphen_values = true)]
    pub region_mm: Option<[f64; 6]>,
    /// Calibration document; default: the one stored in the cloud.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: Option<PathBuf>,
    /// Also write a CSV with the deviation and standard uncertainty of every point: x_mm,y_mm,z_mm,deviation_mm,u_mm (part
    /// frame).
    #[arg(long, value_name = "MAP.csv")]
    pub map: Option<PathBuf>,
    /// Also write a self-contained HTML report with the map of the deviations.
    #[arg(long, value_name = "REPORT.html")]
    pub report: Option<PathBuf>,
}
