//! Laser-off images captured during a scan and subtracted from its frames before lines are detected.

use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use capture::write_png;
use parking_lot::Mutex;
use station::SharedFrame;
use vision::{CameraImage, GreyImage, scene_change};

use crate::error::AppError;
use crate::error::disk_problem;
use crate::jobs::scan::images::{background_folder_in, background_path};

/// Fraction of pixels brighter than the ambient level.
const BRIGHTER_FRACTION: f64 = 0.05;

/// Subsampling along a row for the ambient level.
const LOOK_STRIDE_PX: usize = 7;

/// A laser-off image.
pub struct Background {
    /// The row before which it was captured.
    pub row: usize,
    image: CameraImage,
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

impl Background {
    /// From a laser-off frame captured before `row`.
    pub fn new(row: usize, frame: &SharedFrame) -> Self {
        Self { row, image: CameraImage::Grey(frame.image.clone()) }
    }

    /// Whether it matches `frame` except for the laser.
    pub fn suits(&self, frame: &GreyImage) -> bool {
        scene_change(&CameraImage::Grey(frame.clone()), &self.image).is_none()
    }

    /// The frame with it subtracted; `None` if it does not match.
    pub fn subtracted_from(&self, frame: &GreyImage) -> Option<GreyImage> {
        let on = CameraImage::Grey(frame.clone());
        if scene_change(&on, &self.image).is_some() {
            return None;
        }
        match on.minus(&self.image)? {
            CameraImage::Grey(image) => Some(image),
            CameraImage::Colour(_) => None,
        }
    }

    /// Its ambient level, of 255, exceeded by 5 % of the pixels.
    pub fn ambient_levels(&self) -> f64 {
        let CameraImage::Grey(image) = &self.image else { return 0.0 };
        let pixels = (0..image.height())
            .flat_map(|v| (v % LOOK_STRIDE_PX..image.width()).step_by(LOOK_STRIDE_PX).map(move |u| (u, v)));
        let mut levels: Vec<f32> = pixels.map(|(u, v)| image.at(u, v)).collect();
        let rank = ((1.0 - BRIGHTER_FRACTION) * levels.len() as f64) as usize;
        let (_, level, _) = levels.select_nth_unstable_by(rank, f32::total_cmp);
        f64::from(*level / image.full_scale()) * 255.0
    }
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
    pub fn keep(&self, background: &Background) -> Result<(), AppError> {
        let (Some(folder), CameraImage::Grey(image)) = (&self.images, &background.image) else {
            return Ok(());
        };
        std::fs::create_dir_all(background_folder_in(folder)).map_err(disk_problem)?;
        write_png(&folder.join(background_path(background.row)), image).map_err(disk_problem)
    }

    /// Records that this background, or none, was subtracted from a frame.
    pub fn used(&self, frame: usize, background: Option<&Arc<Background>>) -> Result<(), AppError> {
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
    use vision::Pixels;

    use super::*;

    fn grey(level: impl Fn(usize, usize) -> u8) -> GreyImage {
        let (width, height) = (160, 120);
        let pixels = (0..width * height).map(|idx| level(idx % width, idx / width)).collect();
        GreyImage::new(width, height, Pixels::Eight(pixels)).unwrap()
    }

    /// A room of 40 levels with a dark block from column `u`.
    fn room(u_px: usize) -> GreyImage {
        grey(|u, v| if (u_px..u_px + 40).contains(&u) && (40..80).contains(&v) { 5 } else { 40 })
    }

    fn background(image: GreyImage) -> Background {
        Background { row: 3, image: CameraImage::Grey(image) }
    }

    #[test]
    fn a_background_is_subtracted_only_from_frames_of_its_pose() {
        let lit = |of: GreyImage| grey(move |u, v| of.at(u, v) as u8 + if v == 60 { 100 } else { 0 });
        let here = background(room(20)).subtracted_from(&lit(room(20))).unwrap();
        assert_eq!((here.at(30, 60), here.at(30, 61), here.at(100, 10)), (100.0, 0.0, 0.0));
        assert_eq!(background(room(80)).subtracted_from(&lit(room(20))), None);
    }

    #[test]
    fn the_ambient_level_is_exceeded_by_a_twentieth_of_the_image() {
        let is = |found: f64, levels: f64| (found - levels).abs() < 1e-3;
        assert!(is(background(room(20)).ambient_levels(), 40.0));
        let window = grey(|u, _| if u < 4 { 200 } else { 7 });
        assert!(is(background(window).ambient_levels(), 7.0));
    }

    #[test]
    fn recorded_backgrounds_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let note = folder.path().join("backgrounds");
        let images = folder.path().join("images");
        std::fs::create_dir(&images).unwrap();
        let log = BackgroundLog::new(Some((note.clone(), images.clone()))).unwrap();
        let one = Arc::new(background(room(20)));
        log.keep(&one).unwrap();
        log.used(4, Some(&one)).unwrap();
        log.used(5, None).unwrap();
        assert_eq!(noted(&note), [(4, 3)]);
        assert_eq!(log.counts(), BackgroundCounts { n_with: 1, n_without: 1 });
        assert!(images.join(background_path(3)).is_file());
    }
}
