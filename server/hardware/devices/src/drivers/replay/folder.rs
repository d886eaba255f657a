//! The images of a capture folder.

use std::path::{Path, PathBuf};

use capture::{Capture, LaserImage};
use vision::GreyImage;

use super::sequence::{RecordedFrame, Source, copy};
use super::{ImageSelection, ReplayError};
use crate::StageKind;

/// A capture folder, with the files that are played.
pub struct Folder {
    capture: Capture,
    files: Vec<LaserImage>,
}

impl Folder {
    /// Lists the requested images.
    pub fn open(folder: &Path, wanted: &ImageSelection) -> Result<(Self, Vec<RecordedFrame>), ReplayError> {
        let capture = Capture::open(folder)?;
        for warning in &capture.warnings {
            tracing::warn!("{warning}");
        }
        let found = images_of(&capture, wanted)?;
        if found.is_empty() {
            return Err(ReplayError::NoImages { path: folder.to_owned(), images: name_of(wanted) });
        }
        let frames = found
            .iter()
            .map(|(_, position_mm)| RecordedFrame { position_mm: *position_mm, ..RecordedFrame::default() });
        let frames = frames.collect();
        Ok((Self { capture, files: found.into_iter().map(|(file, _)| file).collect() }, frames))
    }
}

impl Source for Folder {
    fn name(&self) -> String {
        self.capture.folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }

    fn stage(&self) -> StageKind {
        match self.capture.manifest.stage.kind {
            capture::StageKind::Linear => StageKind::Linear,
            capture::StageKind::Rotary => StageKind::Rotary,
        }
    }

    fn read_into(&self, idx: usize, target: &mut GreyImage) -> Result<(), ReplayError> {
        copy(&self.capture.laser_image(&self.files[idx])?, target);
        Ok(())
    }

    /// A file named several times in the manifest counts once.
    fn same_as(&self, idx: usize) -> usize {
        let path = &self.files[idx].path;
        self.files[..idx].iter().position(|other| other.path == *path).unwrap_or(idx)
    }
}

fn images_of(capture: &Capture, wanted: &ImageSelection) -> Result<Vec<(LaserImage, Option<f64>)>, ReplayError> {
    let manifest = &capture.manifest;
    let board =
        |entry: String, path: &PathBuf| LaserImage { entry, path: path.clone(), background: None, line: None };
    let laser_files = |beginning: &str| {
        let mut files = capture.laser_images();
        files.retain(|file| file.entry.starts_with(beginning));
        files
    };
    let at_rest = |file| (file, None);
    Ok(match wanted {
        ImageSelection::Scan(name) => {
            let scan = capture.scan(name)?;
            let scan_idx = manifest.scans.iter().position(|other| other.name == scan.name).unwrap_or_default();
            let files = laser_files(&format!("scans[{scan_idx}].")).into_iter().zip(&scan.frames);
            files.map(|(file, frame)| (file, Some(frame.position().value()))).collect()
        }
        ImageSelection::Boards => {
            let poses = manifest.poses.iter().enumerate();
            poses.map(|(idx, pose)| at_rest(board(format!("poses[{idx}].board"), &pose.board))).collect()
        }
        ImageSelection::LaserImages => laser_files("poses[").into_iter().map(at_rest).collect(),
        ImageSelection::StageViews => {
            let views = manifest.stage_views.iter().enumerate();
            let image = |(idx, view): (usize, &capture::StageView)| {
                (board(format!("stage_views[{idx}].board"), &view.board), Some(view.position().value()))
            };
            views.map(image).collect()
        }
    })
}

fn name_of(images: &ImageSelection) -> &'static str {
    match images {
        ImageSelection::Scan(_) => "frames of that scan",
        ImageSelection::Boards => "board images",
        ImageSelection::LaserImages => "laser images",
        ImageSelection::StageViews => "stage views",
    }
}
