//! The pictures of a replay in their order, from memory or from their files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use capture::{Capture, CaptureError, LaserPicture};
use vision::{GreyImage, Pixels};

use super::{Pictures, ReplayConfig, ReplayError, open_capture};
use crate::PixelFormat;
use crate::params::PRELOAD_LIMIT_BYTES;

/// A picture the manifest names.
struct Picture {
    /// Where it is, and what is taken away from it.
    file: LaserPicture,
    /// Where the stage was, in its unit.
    position_mm: Option<f64>,
}

/// The pictures of a replay.
pub struct Recording {
    capture: Capture,
    pictures: Vec<Picture>,
    /// All of them, if they were preloaded; none where a background shows something else, which its reader is told.
    images: Option<Vec<Option<Arc<GreyImage>>>>,
    format: PixelFormat,
}

impl Recording {
    /// Lists the pictures asked for and reads the first, or all.
    pub fn open(config: &ReplayConfig) -> Result<Self, ReplayError> {
        let capture = open_capture(config)?;
        let pictures = pictures_of(&capture, &config.pictures)?;
        if pictures.is_empty() {
            return Err(ReplayError::NoPictures {
                folder: config.folder.clone(),
                pictures: word_for(&config.pictures),
            });
        }
        let first = first_image(&capture, &pictures)?;
        let format = if first.bit_depth() == 8 { PixelFormat::Mono8 } else { PixelFormat::Mono16 };
        let images = if config.preload { Some(preload(&capture, &pictures, &first)?) } else { None };
        Ok(Self { capture, pictures, images, format })
    }

    /// How many pictures there are.
    pub fn n_pictures(&self) -> usize {
        self.pictures.len()
    }

    /// The folder's name.
    pub fn name(&self) -> String {
        self.capture.folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }

    /// Columns and rows of every picture.
    pub fn size_px(&self) -> (usize, usize) {
        (self.capture.manifest.camera.width_px, self.capture.manifest.camera.height_px)
    }

    /// Format of every picture.
    pub fn format(&self) -> PixelFormat {
        self.format
    }

    /// Whether the stage travelled or turned.
    pub fn stage(&self) -> crate::StageKind {
        match self.capture.manifest.stage.kind {
            capture::StageKind::Linear => crate::StageKind::Linear,
            capture::StageKind::Rotary => crate::StageKind::Rotary,
        }
    }

    /// Where the stage was when picture `idx` was taken.
    pub fn position_mm(&self, idx: usize) -> Option<f64> {
        self.pictures[idx].position_mm
    }

    /// Where the stage was at the first picture.
    pub fn first_position_mm(&self) -> Option<f64> {
        self.position_mm(0)
    }

    /// Where the stage was, picture by picture; empty where that was not recorded.
    pub fn positions_mm(&self) -> Vec<f64> {
        self.pictures.iter().filter_map(|picture| picture.position_mm).collect()
    }

    /// Whether the stage went upwards while pictures were taken.
    pub fn ascends(&self) -> bool {
        let last_mm = self.pictures.last().and_then(|picture| picture.position_mm);
        last_mm >= self.first_position_mm()
    }

    /// The picture taken nearest to `position_mm`, the first of several; `None` where positions were not recorded.
    pub fn nearest(&self, position_mm: f64) -> Option<usize> {
        let off_mm = |at: Option<f64>| Some((at? - position_mm).abs());
        let places = self
            .pictures
            .iter()
            .enumerate()
            .filter_map(|(idx, picture)| Some((idx, off_mm(picture.position_mm)?)));
        places.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(idx, _)| idx)
    }

    /// Writes picture `idx` into `target`, in `target`'s own memory.
    pub fn read_into(&self, idx: usize, target: &mut GreyImage) -> Result<(), CaptureError> {
        match self.images.as_ref().and_then(|images| images[idx].as_ref()) {
            Some(image) => copy(image, target),
            None => copy(&self.capture.laser_image(&self.pictures[idx].file)?, target),
        }
        Ok(())
    }
}

fn copy(source: &GreyImage, target: &mut GreyImage) {
    const NOT_EMPTY: &str = "an image has at least one pixel";
    let (width, height) = (source.width(), source.height());
    match source.pixels() {
        Pixels::Eight(pixels) => target.eight_mut(width, height).expect(NOT_EMPTY).copy_from_slice(pixels),
        Pixels::Sixteen(pixels) => target.sixteen_mut(width, height).expect(NOT_EMPTY).copy_from_slice(pixels),
    }
}

/// What the laser adds to a picture; `None` if its background shows something else.
fn comparable(capture: &Capture, file: &LaserPicture) -> Result<Option<GreyImage>, CaptureError> {
    match capture.laser_image(file) {
        Ok(image) => Ok(Some(image)),
        Err(CaptureError::OtherRoom { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The first picture that shows what the laser adds.
fn first_image(capture: &Capture, pictures: &[Picture]) -> Result<GreyImage, CaptureError> {
    for picture in pictures {
        if let Some(image) = comparable(capture, &picture.file)? {
            return Ok(image);
        }
    }
    // Why there is none.
    capture.laser_image(&pictures[0].file)
}

/// All pictures; one that the manifest names several times is held once.
fn preload(
    capture: &Capture,
    pictures: &[Picture],
    first: &GreyImage,
) -> Result<Vec<Option<Arc<GreyImage>>>, ReplayError> {
    let mut held: BTreeMap<&Path, Option<Arc<GreyImage>>> = BTreeMap::new();
    let n_different =
        pictures.iter().map(|picture| &picture.file.path).collect::<std::collections::BTreeSet<_>>().len();
    let picture_bytes = first.width() * first.height() * (first.bit_depth() as usize / 8);
    let size_bytes = picture_bytes.saturating_mul(n_different);
    if size_bytes > PRELOAD_LIMIT_BYTES {
        return Err(ReplayError::TooLargeToPreload { size_bytes });
    }
    let read = |picture| {
        let Picture { file, .. }: &Picture = picture;
        if let Some(image) = held.get(file.path.as_path()) {
            return Ok(image.clone());
        }
        let image = comparable(capture, file)?.map(Arc::new);
        held.insert(&file.path, image.clone());
        Ok(image)
    };
    pictures.iter().map(read).collect()
}

fn pictures_of(capture: &Capture, wanted: &Pictures) -> Result<Vec<Picture>, ReplayError> {
    let manifest = &capture.manifest;
    let board =
        |entry: String, path: &PathBuf| LaserPicture { entry, path: path.clone(), background: None, line: None };
    let lit = |beginning: &str| {
        let mut files = capture.laser_pictures();
        files.retain(|file| file.entry.starts_with(beginning));
        files
    };
    let at_rest = |file| Picture { file, position_mm: None };
    Ok(match wanted {
        Pictures::Scan(name) => {
            let scan = capture.scan(name)?;
            let scan_idx = manifest.scans.iter().position(|other| other.name == scan.name).unwrap_or_default();
            let files = lit(&format!("scans[{scan_idx}].")).into_iter().zip(&scan.frames);
            files.map(|(file, frame)| Picture { file, position_mm: Some(frame.place().value()) }).collect()
        }
        Pictures::Boards => {
            let poses = manifest.poses.iter().enumerate();
            poses.map(|(idx, pose)| at_rest(board(format!("poses[{idx}].board"), &pose.board))).collect()
        }
        Pictures::LaserPictures => lit("poses[").into_iter().map(at_rest).collect(),
        Pictures::StageViews => {
            let views = manifest.stage_views.iter().enumerate();
            let picture = |(idx, view): (usize, &capture::StageView)| Picture {
                file: board(format!("stage_views[{idx}].board"), &view.board),
                position_mm: Some(view.place().value()),
            };
            views.map(picture).collect()
        }
    })
}

fn word_for(pictures: &Pictures) -> &'static str {
    match pictures {
        Pictures::Scan(_) => "frames of that scan",
        Pictures::Boards => "board pictures",
        Pictures::LaserPictures => "laser pictures",
        Pictures::StageViews => "stage views",
    }
}
