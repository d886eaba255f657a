//! The pictures of a scan, kept as a capture that `sheaf scan` reads.

use std::path::{Path, PathBuf};

use capture::{BoardTarget, CameraFormat, Frame, Manifest, Projector, Scan, write_manifest};
use scanning::Frames as _;
use scanning::files::peaks::PeaksFile;
use store::Change;
use vision::LineDirection;

use crate::captures::CaptureOrigin;
use crate::config::Config;
use crate::jobs::JobContext;
use crate::problem::Problem;

/// Folder of the pictures within the capture.
const FOLDER: &str = "scan";

/// The manifest's word for lines along image columns.
const COLUMNS: &str = "columns";

/// Where a frame's picture lies within the capture.
pub fn picture_path(idx: usize) -> PathBuf {
    Path::new(FOLDER).join(format!("{idx:05}.png"))
}

/// Folder of the pictures within the capture `capture`.
pub fn folder_in(capture: &Path) -> PathBuf {
    capture.join(FOLDER)
}

/// Which way the lines run at this station.
pub fn line_direction(config: &Config) -> LineDirection {
    if config.projector.line_direction == COLUMNS { LineDirection::Columns } else { LineDirection::Rows }
}

/// Takes the pictures under `folder` in as a capture with one scan. Returns its id and what records it.
pub fn take_in(
    ctx: &JobContext,
    folder: &Path,
    scan: &str,
    name: &str,
    frames: &PeaksFile,
) -> Result<(String, Change), Problem> {
    write_manifest(folder, &manifest(&ctx.config, scan, frames))?;
    let (record, change) = ctx.captures.take_in_folder(folder, CaptureOrigin::Scan, name)?;
    Ok((record.id, change))
}

fn manifest(config: &Config, scan: &str, frames: &PeaksFile) -> Manifest {
    let (target, projector) = (&config.target, &config.projector);
    Manifest {
        format: capture::params::FORMAT.to_owned(),
        camera: CameraFormat {
            width_px: frames.header.width_px as usize,
            height_px: frames.header.height_px as usize,
        },
        target: BoardTarget {
            kind: "chessboard".to_owned(),
            inner_columns: target.inner_columns,
            inner_rows: target.inner_rows,
            square_mm: target.square_mm,
        },
        projector: Projector {
            wavelength_nm: projector.wavelength_nm,
            grating_lines_per_mm: projector.grating_lines_per_mm,
            orders: projector.orders.clone(),
            line_direction: Projector::word_for(line_direction(config)),
        },
        poses: Vec::new(),
        stage_views: Vec::new(),
        scans: vec![Scan {
            name: scan.to_owned(),
            frames: (0..frames.n_frames())
                .map(|idx| Frame { image: picture_path(idx), position_mm: frames.position_mm(idx) })
                .collect(),
        }],
    }
}
