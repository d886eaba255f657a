//! Export of a recording as a capture folder, which `sheaf scan` and every other command read.

use std::path::{Path, PathBuf};

use capture::{CameraFormat, ChannelChoice, Frame, Manifest, Scan, write_manifest, write_png};

use crate::error::RecordingError;
use crate::file::RecordingFile;
use crate::params::CALIBRATION_NAME;

/// Folder of the pictures within the capture.
const PICTURES: &str = "scan";

/// Result of an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The name of its scan.
    pub scan: String,
    /// Frames written.
    pub n_frames: u64,
    /// Frames without a stage position, which a capture cannot contain.
    pub n_without_position: u64,
    /// Rows of the scan whose frames are not in the recording.
    pub n_rows_missing: u64,
    /// The calibration beside the manifest, if the recording contains one.
    pub calibration: Option<PathBuf>,
}

/// Writes the frames of a recording as the capture folder `folder`: those of its scan with the positions assigned by
/// the scan, or all. Before every picture `progress` is called with its index and their number.
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
        move |cause| RecordingError::File { act: "write", path, cause }
    };
    let (frames, n_rows_missing) = recording.scan_frames();
    let placed: Vec<_> = frames.iter().filter_map(|(idx, place)| Some((*idx, (*place)?))).collect();
    let Some((first, _)) = placed.first() else { return Err(RecordingError::NothingToExport) };
    let (width_px, height_px, _) = recording.frames[*first].shape;
    let pictures = folder.join(PICTURES);
    std::fs::create_dir_all(&pictures).map_err(failed(&pictures))?;
    let mut written = Vec::with_capacity(placed.len());
    for (row, (idx, place)) in placed.iter().enumerate() {
        progress(row, placed.len());
        let path = Path::new(PICTURES).join(format!("{row:05}.png"));
        write_png(&folder.join(&path), &recording.image(*idx)?)?;
        written.push(Frame::new(path, *place));
    }
    let scan = recording.header.name.clone();
    write_manifest(
        folder,
        &Manifest {
            format: capture::params::FORMAT.to_owned(),
            camera: CameraFormat { width_px, height_px, channel: ChannelChoice::Auto },
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
        n_frames: placed.len() as u64,
        n_without_position: (frames.len() - placed.len()) as u64,
        n_rows_missing,
        calibration,
    })
}
