//! Commands on single images and pixels, and the board to print.

use std::num::NonZeroU16;
use std::path::PathBuf;
use std::str::FromStr;

use capture::ChannelChoice;
use clap::{Args, ValueEnum};

/// Kind of a board on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum TargetKind {
    /// Chessboard; the whole board must be in every image.
    #[default]
    Chessboard,
    /// ChArUco board; a part of the board in view is enough.
    Charuco,
    /// Symmetric circle grid; all discs must be in every image.
    Circles,
    /// Asymmetric circle grid as in OpenCV: every other row is shifted by half the spacing.
    AsymmetricCircles,
}

/// `sheaf target`.
#[derive(Debug, Args)]
pub struct TargetArgs {
    /// Kind of the board.
    #[arg(long, value_enum, default_value_t)]
    pub kind: TargetKind,
    /// Squares along a row (12), or circles in a row (9; asymmetric 4). A chessboard with one even and one odd number of
    /// squares is unambiguous under rotation by 180°.
    #[arg(long)]
    pub columns: Option<usize>,
    /// Squares along a column (9), or rows of circles (7; asymmetric 11: an odd number is unambiguous under rotation by
    /// 180°).
    #[arg(long)]
    pub rows: Option<usize>,
    /// Square size, or distance between neighbouring circles; asymmetric: row spacing.
    #[arg(long, value_name = "MM", default_value_t = 20.0)]
    pub square_mm: f64,
    /// charuco: OpenCV name of the marker dictionary.
    #[arg(long, default_value = "DICT_5X5_100")]
    pub dictionary: String,
    /// Output file. The page is the smallest of A4 to A0 that holds the board.
    #[arg(short, long, value_name = "TARGET.pdf")]
    pub output: PathBuf,
}

/// `sheaf triangulate`.
#[derive(Debug, Args)]
pub struct TriangulateArgs {
    /// Calibration document.
    #[arg(short, long, value_name = "CAL.json")]
    pub calibration: PathBuf,
    /// Standard deviation of the pixels perpendicular to their line; adds image noise to sigma_mm, which otherwise only
    /// contains the uncertainty of the calibration.
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

/// Line direction on the command line, for images that may contain both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum DirectionArg {
    /// Lines run along rows: one crossing per column and line.
    #[default]
    Rows,
    /// Lines run along columns: one crossing per row and line.
    Columns,
    /// Both: each segment in its own direction.
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
        const EXPECTED: &str = "write U,V,WIDTH,HEIGHT in whole pixels, such as 100,0,640,480";
        let numbers: Option<Vec<usize>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
        let numbers: [usize; 4] = numbers.and_then(|numbers| numbers.try_into().ok()).ok_or(EXPECTED)?;
        if numbers[2] == 0 || numbers[3] == 0 { Err(EXPECTED) } else { Ok(Self(numbers)) }
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
    /// Folder for a CSV and an image with the lines drawn on it (NAME-lines.png), per input image.
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["csv", "overlay"])]
    pub output: Option<PathBuf>,
    /// Folder for one CSV per image: u_px,v_px,sigma_px,intensity,width_px.
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Folder for one image with the lines drawn on it, per input image.
    #[arg(long, alias = "picture", value_name = "DIR")]
    pub overlay: Option<PathBuf>,
    /// Direction of the lines (default: rows; the channel of colour images is then selected from lines of either).
    #[arg(long, alias = "line-direction", value_enum)]
    pub direction: Option<DirectionArg>,
    /// Method for the centre of a line.
    #[arg(long, value_enum, default_value_t)]
    pub method: CentrelineMethodArg,
    /// Channel of colour images: red, green, blue, luma, red-minus-others (or green-, blue-), or auto (selected from the
    /// images and reported in the output).
    #[arg(long, value_name = "CHANNEL", default_value_t)]
    pub channel: ChannelChoice,
    /// Grey level of a saturated pixel in images of 16 bits, such as 4095 for a sensor with 12 (default: that of a sensor
    /// with the bits that all images use).
    #[arg(long, value_name = "LEVEL")]
    pub white_level: Option<NonZeroU16>,
    /// Laser-off images, subtracted before lines are detected: one for all images, or one per image in the same order.
    #[arg(long, value_name = "IMAGE", num_args = 1..)]
    pub background: Vec<PathBuf>,
    /// Instead, a list of images with their backgrounds: one pair LASER_ON,LASER_OFF per line, relative to the folder of
    /// the list.
    #[arg(long, value_name = "LIST.csv", conflicts_with_all = ["images", "background"])]
    pub pairs: Option<PathBuf>,
    /// Region of interest: first column, first row, width, height.
    #[arg(long, value_name = "U,V,WIDTH,HEIGHT")]
    pub roi: Option<RoiArg>,
    /// Minimum number of points of a line segment.
    #[arg(long, value_name = "POINTS", default_value_t = 1)]
    pub min_length: usize,
    /// Minimum median contrast of a segment, in grey levels (of 255, or of 65535 in images of 16 bits, to which the white
    /// level is scaled); default 4 of 255 for JPEG, else 0.
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
    /// charuco: ratio of marker size to square size.
    #[arg(long, alias = "marker-share", value_name = "RATIO", default_value_t = 0.7)]
    pub marker_ratio: f64,
    /// charuco: OpenCV name of the marker dictionary.
    #[arg(long, default_value = "DICT_5X5_100")]
    pub dictionary: String,
    /// Folder for one CSV per image: row,column,u_px,v_px,sigma_px.
    #[arg(long, value_name = "DIR")]
    pub csv: PathBuf,
}
