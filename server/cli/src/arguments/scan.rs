//! Arguments of `sheaf scan` and `sheaf measure`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

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
    #[arg(long, value_enum, required_unless_present = "plan")]
    pub tool: Option<ToolArg>,
    /// Measure all characteristics of this plan instead; the verdict is the part's.
    #[arg(long, value_name = "PLAN.json", conflicts_with_all = ["tool", "nominal_mm", "tolerance_mm", "region_mm", "seed"])]
    pub plan: Option<PathBuf>,
    /// Nominal value (mm; degrees for an angle; below zero for a pocket's depth).
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub nominal_mm: Option<f64>,
    /// Symmetric tolerance around the nominal value; required for a verdict according to ISO 14253-1.
    #[arg(long, value_name = "MM", requires = "nominal_mm")]
    pub tolerance_mm: Option<f64>,
    /// Only use points in this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_delimiter = ',', num_args = 6, allow_negative_numbers = true)]
    pub region_mm: Option<Vec<f64>>,
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
    /// The surface the part should have: .stl, .glb or .ply, mm (GLB: metres).
    pub part: PathBuf,
    /// Align by the datums of this plan; the part is drawn in their frame.
    #[arg(long, value_name = "PLAN.json")]
    pub plan: Option<PathBuf>,
    /// Bring all points to the surface, from the datums if there is a plan, else from the start pose.
    #[arg(long, required_unless_present = "plan")]
    pub best_fit: bool,
    /// Where the part's origin lies in the scan, x, y, z in mm, and how it is turned, as turns about x, y, z in degrees, one
    /// after the other.
    #[arg(
        long,
        value_name = "X,Y,Z,RX,RY,RZ",
        value_delimiter = ',',
        num_args = 6,
        allow_negative_numbers = true,
        conflicts_with = "plan"
    )]
    pub start: Option<Vec<f64>>,
    /// Largest permitted deviation to either side; asks for a verdict by ISO 14253-1.
    #[arg(long, value_name = "MM")]
    pub tolerance_mm: Option<f64>,
    /// Points further from the surface do not belong to it; by default 2 % of the part's diagonal.
    #[arg(long, value_name = "MM")]
    pub reach_mm: Option<f64>,
    /// How far a best fit may start from the surface; by default 6 % of the part's diagonal.
    #[arg(long, value_name = "MM")]
    pub capture_mm: Option<f64>,
    /// Look only inside this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", value_delimiter = ',', num_args = 6, allow_negative_numbers = true)]
    pub region_mm: Option<Vec<f64>>,
    /// Calibration document; by default the one that the cloud carries.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: Option<PathBuf>,
    /// Also write every point with its deviation and standard uncertainty: CSV with x_mm,y_mm,z_mm (part frame),
    /// deviation_mm,u_mm.
    #[arg(long, value_name = "MAP.csv")]
    pub map: Option<PathBuf>,
}
