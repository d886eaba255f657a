//! Validates an unpacked folder as a capture, decoding every image.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use capture::params::MANIFEST_FILE;
use capture::{Capture, NamedFile, StageKind};
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::error::{AppError, ErrorKind};
use crate::resources::captures::limits::{DECODE_LIMIT_BYTES, MANIFEST_LIMIT_BYTES};
use crate::resources::labels::label;

/// Copies of an image in memory during decoding: the decoder's and the result.
const COPIES: usize = 2;

/// The folder that holds the manifest: `unpacked` itself, or the only folder in it.
pub(super) fn capture_root(unpacked: &Path) -> Result<PathBuf, AppError> {
    if unpacked.join(MANIFEST_FILE).is_file() {
        return Ok(unpacked.to_owned());
    }
    let entries = std::fs::read_dir(unpacked).map_err(|cause| super::unpack::unwritable(&cause))?;
    let mut roots = entries.flatten().map(|entry| entry.path()).filter(|path| path.join(MANIFEST_FILE).is_file());
    match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(root),
        (first, _) => {
            let what = if first.is_some() { "several captures" } else { "no capture.json" };
            Err(AppError::new(ErrorKind::Impossible, format!("the archive contains {what}"))
                .remedy("pack one capture folder, or its content, with capture.json at the top level"))
        }
    }
}

/// Opens the capture in `root` and decodes each of its images once, in bounded memory.
pub(super) fn checked_capture(root: &Path) -> Result<Capture, AppError> {
    opened(root).map_err(|problem| without_folder(problem, root))
}

fn opened(root: &Path) -> Result<Capture, AppError> {
    check_manifest_size(root)?;
    let capture = Capture::open(root)?;
    for (idx, scan) in capture.manifest.scans.iter().enumerate() {
        label(&scan.name, &format!("scans[{idx}].name"))?;
    }
    decode_all(&capture)?;
    Ok(capture)
}

fn check_manifest_size(root: &Path) -> Result<(), AppError> {
    let size_bytes = std::fs::metadata(root.join(MANIFEST_FILE)).map_or(0, |metadata| metadata.len());
    if size_bytes <= MANIFEST_LIMIT_BYTES {
        return Ok(());
    }
    Err(AppError::new(ErrorKind::TooLarge, format!("capture.json has {size_bytes} bytes"))
        .because(format!("the limit is {MANIFEST_LIMIT_BYTES}"))
        .remedy("split it into several captures"))
}

fn decode_all(capture: &Capture) -> Result<(), AppError> {
    let mut seen = HashSet::new();
    let files: Vec<NamedFile> =
        capture.files().into_iter().filter(|file| seen.insert(file.path.clone())).collect();
    let camera = capture.manifest.camera;
    // Three channels of 16 bits, the largest possible pixel.
    let picture_bytes = camera.width_px * camera.height_px * 6 * COPIES;
    let at_once = (DECODE_LIMIT_BYTES / picture_bytes.max(1)).max(1);
    let decode = |file: &NamedFile| capture.image(&file.entry, &file.path).map(drop);
    files.chunks(at_once).try_for_each(|files| files.par_iter().try_for_each(decode)).map_err(AppError::from)
}

/// Clients never see server paths.
pub fn without_folder(mut problem: AppError, folder: &Path) -> AppError {
    problem.detail = strip_folder(&problem.detail, folder);
    for text in [&mut problem.cause, &mut problem.remedy, &mut problem.pointer].into_iter().flatten() {
        *text = strip_folder(text, folder);
    }
    problem
}

fn strip_folder(text: &str, folder: &Path) -> String {
    let folder = folder.display().to_string();
    text.replace(&format!("{folder}/"), "").replace(&folder, "the capture")
}

/// Summary for lists.
pub(super) fn summary(capture: &Capture, unpacked_bytes: u64) -> Value {
    let manifest = &capture.manifest;
    let scans: Vec<Value> = manifest
        .scans
        .iter()
        .map(|scan| {
            let places = scan.frames.iter().map(|frame| frame.position().value());
            let (from, to) = (places.clone().reduce(f64::min), places.reduce(f64::max));
            match manifest.stage.kind {
                StageKind::Linear => {
                    json!({ "name": scan.name, "n_frames": scan.frames.len(), "from_mm": from, "to_mm": to })
                }
                StageKind::Rotary => {
                    json!({ "name": scan.name, "n_frames": scan.frames.len(), "from_deg": from, "to_deg": to })
                }
            }
        })
        .collect();
    let warnings: Vec<String> =
        capture.warnings.iter().map(|warning| strip_folder(warning, &capture.folder)).collect();
    json!({
        "width_px": manifest.camera.width_px,
        "height_px": manifest.camera.height_px,
        "n_poses": manifest.poses.len(),
        "n_laser_poses": manifest.poses.iter().filter(|pose| pose.laser.is_some() || !pose.lasers.is_empty()).count(),
        "n_stage_views": manifest.stage_views.len(),
        "scans": scans,
        "unpacked_bytes": unpacked_bytes,
        "warnings": warnings,
    })
}
