//! The images of a scan, kept as a capture for `sheaf scan`.

use std::path::{Path, PathBuf};

use capture::{CameraFormat, Frame, Manifest, Scan, StageDescription, write_manifest};
use scanning::Frames as _;
use scanning::files::peaks::PeaksFile;
use store::Change;

use crate::config::AppConfig;
use crate::error::AppError;
use crate::jobs::ComputeContext;
use crate::resources::captures::{CaptureOrigin, capture_stage, nominal_position};

/// Folder of the images within the capture.
const FOLDER: &str = "scan";

/// Folder of the laser-off images.
const BACKGROUNDS: &str = "background";

/// Path of a frame within the capture.
pub fn image_path(idx: usize) -> PathBuf {
    Path::new(FOLDER).join(format!("{idx:05}.png"))
}

/// Folder of the images within the capture `capture`.
pub fn folder_in(capture: &Path) -> PathBuf {
    capture.join(FOLDER)
}

/// Path of the laser-off image captured before a row.
pub fn background_path(row: usize) -> PathBuf {
    Path::new(BACKGROUNDS).join(format!("{row:05}.png"))
}

/// Folder of the laser-off images within the capture `capture`.
pub fn background_folder_in(capture: &Path) -> PathBuf {
    capture.join(BACKGROUNDS)
}

/// Stores the images under `folder` as a capture with one scan. `backgrounds`: per frame, the row before which its
/// laser-off image was captured. Returns the id and the changes that record it.
pub fn take_in(
    ctx: &ComputeContext,
    folder: &Path,
    scan: &str,
    name: &str,
    frames: &PeaksFile,
    backgrounds: &[(usize, usize)],
) -> Result<(String, Change), AppError> {
    let mut manifest = manifest(&ctx.config, scan, frames);
    for &(frame, row) in backgrounds {
        if let Some(frame) = manifest.scans[0].frames.get_mut(frame) {
            frame.background = Some(background_path(row));
        }
    }
    write_manifest(folder, &manifest)?;
    let (record, change) = ctx.captures.take_in_folder(folder, CaptureOrigin::Scan, name)?;
    Ok((record.id, change))
}

fn manifest(config: &AppConfig, scan: &str, frames: &PeaksFile) -> Manifest {
    Manifest {
        format: capture::params::FORMAT.to_owned(),
        stage: StageDescription { kind: capture_stage(frames.header.stage), ..StageDescription::default() },
        background: None,
        camera: CameraFormat::of_size(frames.header.width_px as usize, frames.header.height_px as usize),
        target: config.target.clone(),
        projector: config.projector.clone(),
        poses: Vec::new(),
        stage_views: Vec::new(),
        scans: vec![Scan {
            name: scan.to_owned(),
            frames: (0..frames.n_frames())
                .map(|idx| Frame::new(image_path(idx), nominal_position(frames.position(idx))))
                .collect(),
        }],
    }
}
