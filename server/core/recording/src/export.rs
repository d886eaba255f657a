//! Export of a recording as a capture folder, which `sheaf scan` and every other command read.

use std::path::{Path, PathBuf};

use capture::{CameraFormat, Frame, Manifest, Scan, write_manifest, write_png};

use crate::error::RecordingError;
use crate::file::RecordingFile;
use crate::params::CALIBRATION_NAME;

/// Folder of the images in the capture.
const IMAGES: &str = "scan";

/// Result of an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The name of its scan.
    pub scan: String,
    /// Frames written.
    pub n_frames: u64,
    /// Frames without a stage position, which a capture cannot contain.
    pub n_without_position: u64,
    /// Rows of the scan whose frames are missing in the recording.
    pub n_rows_missing: u64,
    /// The calibration beside the manifest, if the recording contains one.
    pub calibration: Option<PathBuf>,
}

/// Writes the frames of a recording as the capture folder `folder`: those of its scan with the positions assigned
/// by the scan, or all. `progress` is called before every image with its index and the number of images.
///
/// # Errors
/// [`RecordingError::NothingToExport`], frames that cannot be read, a folder that cannot be written.
pub fn export(
    recording: &RecordingFile,
    folder: &Path,
    mut progress: impl FnMut(usize, usize),
) -> Result<Exported, RecordingError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |cause| RecordingError::File { action: "write", path, cause }
    };
    let (frames, n_rows_missing) = recording.scan_frames();
    let with_position: Vec<_> = frames.iter().filter_map(|(idx, position)| Some((*idx, (*position)?))).collect();
    let Some((first, _)) = with_position.first() else { return Err(RecordingError::NothingToExport) };
    let (width_px, height_px, _) = recording.frames[*first].shape;
    let images = folder.join(IMAGES);
    std::fs::create_dir_all(&images).map_err(failed(&images))?;
    let mut written = Vec::with_capacity(with_position.len());
    for (row, (idx, position)) in with_position.iter().enumerate() {
        progress(row, with_position.len());
        let path = Path::new(IMAGES).join(format!("{row:05}.png"));
        write_png(&folder.join(&path), &recording.image(*idx)?)?;
        written.push(Frame::new(path, *position));
    }
    let scan = recording.header.name.clone();
    write_manifest(
        folder,
        &Manifest {
            format: capture::params::FORMAT.to_owned(),
            camera: CameraFormat::of_size(width_px, height_px),
            target: recording.header.target.clone(),
            projector: recording.header.projector.clone(),
            stage: recording.header.stage,
            background: None,
            poses: Vec::new(),
            stage_views: Vec::new(),
            scans: vec![Scan { name: scan.clone(), frames: written }],
        },
    )?;
    let calibration = match &recording.calibration {
        Some(document) => {
            let path = folder.join(CALIBRATION_NAME);
            std::fs::write(&path, document).map_err(failed(&path))?;
            Some(path)
        }
        None => None,
    };
    Ok(Exported {
        scan,
        n_frames: with_position.len() as u64,
        n_without_position: (frames.len() - with_position.len()) as u64,
        n_rows_missing,
        calibration,
    })
}
