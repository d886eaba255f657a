//! A small complete capture folder, which tests modify.

use std::path::Path;

use capture::{Capture, CaptureError, write_png};
use remedy::Remedy;
use serde_json::{Value, json};
use tempfile::TempDir;
use vision::{GreyImage, Pixels};

/// Size of every image of the valid capture.
pub const WIDTH_PX: usize = 16;
/// Rows of its images.
pub const HEIGHT_PX: usize = 12;

/// The manifest of the valid capture.
pub fn valid_manifest() -> Value {
    json!({
        "format": "sheaf-capture/1",
        "camera": { "width_px": WIDTH_PX, "height_px": HEIGHT_PX },
        "target": { "kind": "chessboard", "inner_columns": 11, "inner_rows": 8, "square_mm": 12.0 },
        "projector": { "wavelength_nm": 660, "grating_lines_per_mm": 50, "orders": [-2, -1, 0, 1, 2] },
        "poses": [
            { "board": "board/000.png", "laser": "laser/000.png" },
            { "board": "board/001.png" }
        ],
        "stage_views": [{ "board": "stage/000.png", "position_mm": -20.0 }],
        "scans": [{ "name": "gauge", "frames": [{ "image": "scan/000.png", "position_mm": 0.5 }] }]
    })
}

/// An image of one grey level.
pub fn flat(width: usize, height: usize) -> GreyImage {
    GreyImage::new(width, height, Pixels::Eight(vec![7; width * height])).unwrap()
}

/// A folder with the valid capture's images and `manifest`.
pub fn folder_with(manifest: &Value) -> TempDir {
    let folder = TempDir::new().unwrap();
    for name in ["board/000.png", "board/001.png", "laser/000.png", "stage/000.png", "scan/000.png"] {
        put(folder.path(), name, &flat(WIDTH_PX, HEIGHT_PX));
    }
    std::fs::write(folder.path().join("capture.json"), manifest.to_string()).unwrap();
    folder
}

/// Writes `image` as `folder/name`.
pub fn put(folder: &Path, name: &str, image: &GreyImage) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    write_png(&path, image).unwrap();
}

/// The valid manifest with the value at a JSON pointer replaced.
pub fn manifest_with(pointer: &str, value: Value) -> Value {
    let mut manifest = valid_manifest();
    *manifest.pointer_mut(pointer).unwrap() = value;
    manifest
}

/// The whole message chain of the error that opening `folder` gives.
pub fn refusal(folder: &Path) -> String {
    chain(&Capture::open(folder).unwrap_err())
}

/// An error, its causes and its remedy, in one line.
pub fn chain(error: &CaptureError) -> String {
    format!("{}; {}", remedy::with_causes(error), error.remedy().unwrap_or_default())
}
