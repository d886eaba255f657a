//! Errors of a capture folder: each names the file and the entry, and has a remedy.

use std::borrow::Cow;
use std::path::PathBuf;

use remedy::Remedy;
use vision::SceneChange;

use crate::image_file::ImageFileError;
use crate::params::{FORMAT, IMAGE_LIMIT_PX, ORDER_LIMIT};

/// Why a capture folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// There is no manifest.
    #[error("no capture manifest {}", file.display())]
    ManifestMissing {
        /// The expected path.
        file: PathBuf,
    },
    /// The manifest or its folder cannot be read or written.
    #[error("cannot access {}", file.display())]
    Inaccessible {
        /// The file or folder.
        file: PathBuf,
        /// The operating system's reason.
        #[source]
        cause: std::io::Error,
    },
    /// The manifest states lines switched on one by one for a projector whose lines are on together, or vice
    /// versa.
    #[error("{}: {entry} {problem}", file.display())]
    SwitchedLines {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// What is wrong with it.
        problem: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// A background that shows a different scene from the image it would be subtracted from.
    #[error("{entry} ({}) cannot be subtracted from {of}: {change}", path.display())]
    BackgroundMismatch {
        /// Entry of the image with the laser off.
        entry: String,
        /// The file as named.
        path: PathBuf,
        /// Entry of the image with the laser on.
        of: String,
        /// What differs.
        change: SceneChange,
    },
    /// The manifest is too large.
    #[error("{} has {size_bytes} bytes, more than the {limit_bytes} a manifest may have",
        file.display())]
    ManifestTooLarge {
        /// The manifest.
        file: PathBuf,
        /// Its size.
        size_bytes: u64,
        /// The limit.
        limit_bytes: u64,
    },
    /// A bare NaN or Infinity, as Python's `json` writes them.
    #[error("{}, line {line}: {entry} is {found}, which is not a number",
        file.display())]
    NotFinite {
        /// The manifest.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Path of keys.
        entry: String,
        /// As written.
        found: String,
    },
    /// The manifest is not JSON, lacks a key or has a value of the wrong type.
    #[error("{}, line {line}, column {column}, {entry}",
        file.display())]
    Malformed {
        /// The manifest.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Path of keys; `the document` at the top.
        entry: String,
        /// What the parser expected.
        #[source]
        cause: serde_json::Error,
    },
    /// A required key is missing.
    #[error("{}, line {line}: {entry} is missing", file.display())]
    EntryMissing {
        /// The manifest.
        file: PathBuf,
        /// Line, from 1, where the object without it ends.
        line: usize,
        /// Path of keys.
        entry: String,
        /// What to write, in words.
        remedy: &'static str,
    },
    /// A stage view or frame without a stage position.
    #[error("{}: {entry} is missing, but the stage is {kind}",
        file.display())]
    NoPosition {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// Kind of the stage.
        kind: &'static str,
    },
    /// A key of the other kind of stage.
    #[error("{}: {entry} does not belong to a {kind} stage", file.display())]
    OtherStage {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// The last key of the path.
        key: &'static str,
        /// Kind of the stage.
        kind: &'static str,
    },
    /// Another format or version.
    #[error("{}: format is \"{found}\", this program reads \"{FORMAT}\"",
        file.display())]
    UnknownFormat {
        /// The manifest.
        file: PathBuf,
        /// The format it states.
        found: String,
    },
    /// A size, count or length outside its range.
    #[error("{}: {entry} is {value}", file.display())]
    OutOfRange {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// As written.
        value: f64,
        /// What is allowed, in words.
        expected: &'static str,
    },
    /// More pixels than an image may have.
    #[error("{}: camera.width_px × camera.height_px is {width_px}×{height_px}, more than {IMAGE_LIMIT_PX} pixels", file.display())]
    ImagesTooLarge {
        /// The manifest.
        file: PathBuf,
        /// Columns.
        width_px: usize,
        /// Rows.
        height_px: usize,
    },
    /// A value that is not one of the allowed words.
    #[error("{}: {entry} is \"{found}\"", file.display())]
    UnknownValue {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: &'static str,
        /// As written.
        found: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The markers of a ChArUco board are impossible.
    #[error("{}: target.dictionary is not suitable for this board", file.display())]
    Markers {
        /// The manifest.
        file: PathBuf,
        /// Why, and the remedy.
        #[source]
        cause: vision::CharucoError,
    },
    /// No diffraction order is listed.
    #[error("{}: projector.orders is empty", file.display())]
    NoOrders {
        /// The manifest.
        file: PathBuf,
    },
    /// An impossible order.
    #[error("{}: {entry} is {order}", file.display())]
    OrderTooHigh {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// As written.
        order: i8,
    },
    /// The orders are not strictly increasing or decreasing.
    #[error("{}: {entry} is {order} after {previous}", file.display())]
    OrdersNotMonotonic {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// The order out of sequence.
        order: i8,
        /// The one before it.
        previous: i8,
    },
    /// Two scans of the same name, or a scan without one.
    #[error("{}: {entry} is \"{name}\"", file.display())]
    ScanName {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// As written.
        name: String,
    },
    /// A path outside the folder.
    #[error("{}: {entry} names \"{}\", which {reason}", file.display(), path.display())]
    PathOutside {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// As written.
        path: PathBuf,
        /// Why it is outside.
        reason: &'static str,
    },
    /// A missing image.
    #[error("missing image \"{}\" named by {entry} of {}",
        path.display(), file.display())]
    ImageMissing {
        /// The manifest.
        file: PathBuf,
        /// Path of keys.
        entry: String,
        /// Relative to the folder.
        path: PathBuf,
        /// What could be removed from the manifest instead.
        removable: &'static str,
    },
    /// An image that cannot be used; the cause states why and the remedy.
    #[error("image \"{}\" named by {entry} cannot be used", path.display())]
    ImageUnusable {
        /// Path of keys.
        entry: String,
        /// Relative to the folder.
        path: PathBuf,
        /// Why, and the remedy.
        #[source]
        cause: Box<ImageFileError>,
    },
    /// An image of another size than the camera's.
    #[error("image \"{}\" named by {entry} has {width_px}×{height_px} pixels, but camera states {camera_width_px}×{camera_height_px}", path.display())]
    ImageSize {
        /// Path of keys.
        entry: String,
        /// Relative to the folder.
        path: PathBuf,
        /// Columns of the image.
        width_px: usize,
        /// Rows of the image.
        height_px: usize,
        /// Columns of the camera.
        camera_width_px: usize,
        /// Rows of the camera.
        camera_height_px: usize,
    },
    /// 8-bit and 16-bit images in one capture.
    #[error("image \"{}\" named by {entry} has {bits} bits per pixel, but {first_entry} has {first_bits}", path.display())]
    MixedBitDepth {
        /// Path of keys.
        entry: String,
        /// Relative to the folder.
        path: PathBuf,
        /// Of this image.
        bits: u32,
        /// The entry that set the depth.
        first_entry: String,
        /// Its depth.
        first_bits: u32,
    },
    /// A white level for images of 8 bits, in which it is 255.
    #[error("{}: camera.white_level is given, but the images have 8 bits", file.display())]
    WhiteLevelOfEightBits {
        /// The manifest.
        file: PathBuf,
    },
    /// A scan that the capture does not contain.
    #[error("{} has no scan \"{name}\"", file.display())]
    UnknownScan {
        /// The manifest.
        file: PathBuf,
        /// The requested name.
        name: String,
        /// The available names.
        available: Vec<String>,
    },
}

impl Remedy for CaptureError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::ManifestMissing { .. } => "use a folder that contains capture.json".into(),
            Self::Inaccessible { .. } => "check that it exists and that its permissions allow it".into(),
            Self::SwitchedLines { remedy, .. } => (*remedy).into(),
            Self::BackgroundMismatch { .. } => {
                "use the image of the same pose with the laser off as its background, or none".into()
            }
            Self::ManifestTooLarge { .. } => "name a capture folder".into(),
            Self::NotFinite { .. } => "write the true value or remove the entry".into(),
            Self::Malformed { .. } => "correct the entry as described in capture.schema.json".into(),
            Self::EntryMissing { remedy, .. } => (*remedy).into(),
            Self::NoPosition { .. } => "state the stage position, or remove the image".into(),
            Self::OtherStage { key, .. } => other_stage_remedy(key).into(),
            Self::UnknownFormat { .. } => "convert the capture or update the program".into(),
            Self::OutOfRange { expected, .. } => format!("give {expected}").into(),
            Self::ImagesTooLarge { .. } => "give the true size of the images".into(),
            Self::UnknownValue { allowed, .. } => format!("write {allowed}").into(),
            Self::Markers { cause, .. } => return cause.remedy(),
            Self::NoOrders { .. } => "list the orders from the top of the image downwards".into(),
            Self::OrderTooHigh { .. } => format!("list orders between −{ORDER_LIMIT} and {ORDER_LIMIT}").into(),
            Self::OrdersNotMonotonic { .. } => {
                "list each order once, from the top of the image downwards, in increasing or decreasing order"
                    .into()
            }
            Self::ScanName { .. } => "give every scan a unique name".into(),
            Self::PathOutside { .. } => {
                "copy the image into the capture folder and use a path relative to it".into()
            }
            Self::ImageMissing { removable, .. } => format!("restore the file or remove the {removable}").into(),
            Self::ImageSize { .. } => {
                "restore the original image or correct camera.width_px and camera.height_px".into()
            }
            Self::MixedBitDepth { .. } => "record the whole capture with one bit depth".into(),
            Self::WhiteLevelOfEightBits { .. } => "remove it: white is 255 in images of 8 bits".into(),
            Self::UnknownScan { available, .. } => format!("choose one of {available:?}").into(),
            Self::ImageUnusable { cause, .. } => return cause.remedy(),
        })
    }
}

/// Remedy for a key of another kind of stage.
fn other_stage_remedy(key: &str) -> &'static str {
    match key {
        "position_mm" => "state angle_deg instead or, if the stage travels, remove stage.kind \"rotary\"",
        _ => "state position_mm instead or, if the part is turned, write stage.kind \"rotary\"",
    }
}
