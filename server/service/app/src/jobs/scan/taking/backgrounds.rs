//! Pictures with the laser off, taken during a scan and taken away from its frames before lines are looked for.

use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use capture::write_png;
use parking_lot::Mutex;
use station::SharedFrame;
use vision::{GreyImage, Picture, room_change};

use crate::error::AppError;
use crate::jobs::scan::pictures::{background_folder_in, background_path};
use crate::resources::stored_scan::disk_problem;

/// Share of the picture that is brighter than what is called its ambient light.
const BRIGHTER_SHARE: f64 = 0.05;

/// Of so many pixels along a row one is looked at for the ambient light.
const LOOK_STRIDE_PX: usize = 7;

/// A picture with the laser off.
pub struct Background {
    /// The row it was taken before.
    pub row: usize,
    picture: Picture,
}

/// What the frames of a scan were, and were not, freed from.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BackgroundCounts {
    /// Frames without a background of the same pose and light: lines were looked for in them as they are.
    pub n_without: usize,
    /// Frames with one.
    pub n_with: usize,
}

/// Which background each frame was freed from: counted, and noted for the capture where pictures are kept.
pub struct BackgroundLog {
    counts: Mutex<BackgroundCounts>,
    note: Option<Mutex<File>>,
    pictures: Option<PathBuf>,
}

impl Background {
    /// The picture of a frame with the laser off, taken before `row`.
    pub fn new(row: usize, frame: &SharedFrame) -> Self {
        Self { row, picture: Picture::Grey(frame.image.clone()) }
    }

    /// Whether it shows what `frame` shows but for the laser.
    pub fn suits(&self, frame: &GreyImage) -> bool {
        room_change(&Picture::Grey(frame.clone()), &self.picture).is_none()
    }

    /// The frame without it; `None` where it shows something else.
    pub fn taken_from(&self, frame: &GreyImage) -> Option<GreyImage> {
        let on = Picture::Grey(frame.clone());
        if room_change(&on, &self.picture).is_some() {
            return None;
        }
        match on.minus(&self.picture)? {
            Picture::Grey(image) => Some(image),
            Picture::Colour(_) => None,
        }
    }

    /// Its ambient light: the level, of 255, that a twentieth of the picture exceeds.
    pub fn ambient_levels(&self) -> f64 {
        let Picture::Grey(image) = &self.picture else { return 0.0 };
        let pixels = (0..image.height())
            .flat_map(|v| (v % LOOK_STRIDE_PX..image.width()).step_by(LOOK_STRIDE_PX).map(move |u| (u, v)));
        let mut levels: Vec<f32> = pixels.map(|(u, v)| image.at(u, v)).collect();
        let rank = ((1.0 - BRIGHTER_SHARE) * levels.len() as f64) as usize;
        let (_, level, _) = levels.select_nth_unstable_by(rank, f32::total_cmp);
        f64::from(*level / image.full_scale()) * 255.0
    }
}

impl BackgroundLog {
    /// `kept`: the file in which the pictures' backgrounds are noted, and the capture folder of the pictures.
    pub fn new(kept: Option<(PathBuf, PathBuf)>) -> Result<Self, AppError> {
        let (note, pictures) = kept.unzip();
        let open = |note: PathBuf| OpenOptions::new().create(true).append(true).open(note);
        let note = note.map(open).transpose().map_err(disk_problem)?.map(Mutex::new);
        Ok(Self { counts: Mutex::default(), note, pictures })
    }

    /// Keeps a background's picture beside those of the frames.
    pub fn keep(&self, background: &Background) -> Result<(), AppError> {
        let (Some(folder), Picture::Grey(image)) = (&self.pictures, &background.picture) else { return Ok(()) };
        std::fs::create_dir_all(background_folder_in(folder)).map_err(disk_problem)?;
        write_png(&folder.join(background_path(background.row)), image).map_err(disk_problem)
    }

    /// A frame was freed from that background, or from none.
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

    /// What was counted.
    pub fn counts(&self) -> BackgroundCounts {
        *self.counts.lock()
    }
}

/// The background of every frame of which one was noted, by the row it was taken before.
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
        Background { row: 3, picture: Picture::Grey(image) }
    }

    #[test]
    fn a_background_is_taken_from_frames_of_its_pose_alone() {
        let lit = |of: GreyImage| grey(move |u, v| of.at(u, v) as u8 + if v == 60 { 100 } else { 0 });
        let here = background(room(20)).taken_from(&lit(room(20))).unwrap();
        assert_eq!((here.at(30, 60), here.at(30, 61), here.at(100, 10)), (100.0, 0.0, 0.0));
        assert_eq!(background(room(80)).taken_from(&lit(room(20))), None);
    }

    #[test]
    fn ambient_light_is_what_a_twentieth_of_the_picture_exceeds() {
        let is = |found: f64, levels: f64| (found - levels).abs() < 1e-3;
        assert!(is(background(room(20)).ambient_levels(), 40.0));
        let window = grey(|u, _| if u < 4 { 200 } else { 7 });
        assert!(is(background(window).ambient_levels(), 7.0));
    }

    #[test]
    fn what_was_noted_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let note = folder.path().join("backgrounds");
        let pictures = folder.path().join("pictures");
        std::fs::create_dir(&pictures).unwrap();
        let log = BackgroundLog::new(Some((note.clone(), pictures.clone()))).unwrap();
        let one = Arc::new(background(room(20)));
        log.keep(&one).unwrap();
        log.used(4, Some(&one)).unwrap();
        log.used(5, None).unwrap();
        assert_eq!(noted(&note), [(4, 3)]);
        assert_eq!(log.counts(), BackgroundCounts { n_with: 1, n_without: 1 });
        assert!(pictures.join(background_path(3)).is_file());
    }
}
