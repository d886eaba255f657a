//! Laser-off images captured during a scan and subtracted from its frames before lines are detected.

use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parking_lot::Mutex;

use crate::camera::background::Background;
use crate::error::AppError;
use crate::error::disk_problem;
use crate::jobs::scan::images::{background_folder_in, background_path};

/// A laser-off image of a scan.
pub struct RowBackground {
    /// The row before which it was captured.
    pub row: usize,
    /// The image.
    pub image: Background,
}

/// Counts of frames with and without ambient light subtraction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BackgroundCounts {
    /// Frames without a matching laser-off image, processed without subtraction.
    pub n_without: usize,
    /// Frames with subtraction.
    pub n_with: usize,
}

/// Records which laser-off image was subtracted from each frame: counted, and written to the capture if images are kept.
pub struct BackgroundLog {
    counts: Mutex<BackgroundCounts>,
    note: Option<Mutex<File>>,
    images: Option<PathBuf>,
}

impl BackgroundLog {
    /// `kept`: the file that records the subtraction, and the capture folder of the images.
    pub fn new(kept: Option<(PathBuf, PathBuf)>) -> Result<Self, AppError> {
        let (note, images) = kept.unzip();
        let open = |note: PathBuf| OpenOptions::new().create(true).append(true).open(note);
        let note = note.map(open).transpose().map_err(disk_problem)?.map(Mutex::new);
        Ok(Self { counts: Mutex::default(), note, images })
    }

    /// Stores a laser-off image beside the frames.
    pub fn keep(&self, background: &RowBackground) -> Result<(), AppError> {
        let Some(folder) = &self.images else { return Ok(()) };
        std::fs::create_dir_all(background_folder_in(folder)).map_err(disk_problem)?;
        background.image.write(&folder.join(background_path(background.row)))
    }

    /// Records that this background, or none, was subtracted from a frame.
    pub fn used(&self, frame: usize, background: Option<&Arc<RowBackground>>) -> Result<(), AppError> {
        let mut counts = self.counts.lock();
        match background {
            None => counts.n_without += 1,
            Some(_) => counts.n_with += 1,
        }
        drop(counts);
        let (Some(background), Some(note)) = (background, &self.note) else { return Ok(()) };
        let mut note = note.lock();
        writeln!(note, "{frame} {}", background.row).map_err(disk_problem)
    }

    /// The counts.
    pub fn counts(&self) -> BackgroundCounts {
        *self.counts.lock()
    }
}

/// The recorded background of each frame, by the row before which it was captured.
pub fn noted(note: &Path) -> Vec<(usize, usize)> {
    let text = std::fs::read_to_string(note).unwrap_or_default();
    let pair = |line: &str| {
        let (frame, row) = line.split_once(' ')?;
        Some((frame.parse().ok()?, row.parse().ok()?))
    };
    text.lines().filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::background::tests::room;

    #[test]
    fn recorded_backgrounds_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let note = folder.path().join("backgrounds");
        let images = folder.path().join("images");
        std::fs::create_dir(&images).unwrap();
        let log = BackgroundLog::new(Some((note.clone(), images.clone()))).unwrap();
        let one = Arc::new(RowBackground { row: 3, image: Background::of(room(20)) });
        log.keep(&one).unwrap();
        log.used(4, Some(&one)).unwrap();
        log.used(5, None).unwrap();
        assert_eq!(noted(&note), [(4, 3)]);
        assert_eq!(log.counts(), BackgroundCounts { n_with: 1, n_without: 1 });
        assert!(images.join(background_path(3)).is_file());
    }
}
