//! The frames of a replay in their order, from memory or from their source.

use std::sync::Arc;

use capture::CaptureError;
use vision::{GreyImage, Pixels};

use super::file::File;
use super::folder::Folder;
use super::{ReplayConfig, ReplayError, ReplaySource};
use crate::params::PRELOAD_LIMIT_BYTES;
use crate::{PixelFormat, StageKind};

/// Source of frames.
pub trait Source: Send {
    /// Its name.
    fn name(&self) -> String;

    /// Kind of the stage.
    fn stage(&self) -> StageKind;

    /// Writes frame `idx` into `target`.
    ///
    /// # Errors
    /// If it cannot be read.
    fn read_into(&self, idx: usize, target: &mut GreyImage) -> Result<(), ReplayError>;

    /// Index of the first frame identical to this one.
    fn same_as(&self, idx: usize) -> usize;
}

/// Metadata of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RecordedFrame {
    /// Stage position, in its unit.
    pub position_mm: Option<f64>,
    /// Exposure time; 0 if unknown.
    pub exposure_us: f64,
    /// Exposures lost before it when it was recorded.
    pub lost_before: u64,
}

/// The frames of a replay.
pub struct Recording {
    source: Box<dyn Source>,
    frames: Vec<RecordedFrame>,
    /// All images, if they were preloaded; `None` where a background shows another scene, which reading reports.
    preloaded: Option<Vec<Option<Arc<GreyImage>>>>,
    size_px: (usize, usize),
    format: PixelFormat,
}

impl Recording {
    /// Lists the requested frames and reads the first, or all.
    pub fn open(config: &ReplayConfig) -> Result<Self, ReplayError> {
        let (source, frames): (Box<dyn Source>, _) = match &config.played {
            ReplaySource::Folder { folder, images } => {
                let (folder, frames) = Folder::open(folder, images)?;
                (Box::new(folder), frames)
            }
            ReplaySource::Recording(path) => {
                let (file, frames) = File::open(path)?;
                (Box::new(file), frames)
            }
        };
        let first = first_image(&*source, frames.len())?;
        let format = if first.bit_depth() == 8 { PixelFormat::Mono8 } else { PixelFormat::Mono16 };
        let size_px = (first.width(), first.height());
        let preloaded = if config.preload { Some(preload(&*source, frames.len(), &first)?) } else { None };
        Ok(Self { source, frames, preloaded, size_px, format })
    }

    /// Number of frames.
    pub fn n_frames(&self) -> usize {
        self.frames.len()
    }

    /// Name of the recording.
    pub fn name(&self) -> String {
        self.source.name()
    }

    /// Kind of the stage.
    pub fn stage(&self) -> StageKind {
        self.source.stage()
    }

    /// Columns and rows of every frame.
    pub fn size_px(&self) -> (usize, usize) {
        self.size_px
    }

    /// Format of every frame.
    pub fn format(&self) -> PixelFormat {
        self.format
    }

    /// Metadata of frame `idx`.
    pub fn frame(&self, idx: usize) -> RecordedFrame {
        self.frames[idx]
    }

    /// Stage position of the first frame.
    pub fn first_position_mm(&self) -> Option<f64> {
        self.frames[0].position_mm
    }

    /// Stage positions, frame by frame; empty if they were not recorded.
    pub fn positions_mm(&self) -> Vec<f64> {
        self.frames.iter().filter_map(|frame| frame.position_mm).collect()
    }

    /// Whether the stage moved upwards while the frames were taken.
    pub fn ascends(&self) -> bool {
        let last_mm = self.frames.last().and_then(|frame| frame.position_mm);
        last_mm >= self.first_position_mm()
    }

    /// The frame taken nearest to `position_mm`, the first of several; `None` if positions were not recorded.
    pub fn nearest(&self, position_mm: f64) -> Option<usize> {
        let off_mm = |at: Option<f64>| Some((at? - position_mm).abs());
        let distances =
            self.frames.iter().enumerate().filter_map(|(idx, frame)| Some((idx, off_mm(frame.position_mm)?)));
        distances.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(idx, _)| idx)
    }

    /// Writes frame `idx` into `target`, reusing its memory if possible.
    pub fn read_into(&self, idx: usize, target: &mut GreyImage) -> Result<(), ReplayError> {
        match self.preloaded.as_ref().and_then(|preloaded| preloaded[idx].as_ref()) {
            Some(image) => copy(image, target),
            None => self.source.read_into(idx, target)?,
        }
        Ok(())
    }
}

/// A placeholder image.
fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel is an image")
}

/// Copies an image into `target`, reusing its memory.
pub fn copy(source: &GreyImage, target: &mut GreyImage) {
    const NOT_EMPTY: &str = "an image has at least one pixel";
    let (width, height) = (source.width(), source.height());
    match source.pixels() {
        Pixels::Eight(pixels) => target.eight_mut(width, height).expect(NOT_EMPTY).copy_from_slice(pixels),
        Pixels::Sixteen(pixels) => target.sixteen_mut(width, height).expect(NOT_EMPTY).copy_from_slice(pixels),
    }
}

/// A frame; `None` if its background shows another scene, so that it cannot be subtracted.
fn comparable(source: &dyn Source, idx: usize) -> Result<Option<GreyImage>, ReplayError> {
    let mut image = blank();
    match source.read_into(idx, &mut image) {
        Ok(()) => Ok(Some(image)),
        Err(ReplayError::Capture(CaptureError::BackgroundMismatch { .. })) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The first frame with a suitable background.
fn first_image(source: &dyn Source, n_frames: usize) -> Result<GreyImage, ReplayError> {
    for idx in 0..n_frames {
        if let Some(image) = comparable(source, idx)? {
            return Ok(image);
        }
    }
    // The error of the first frame.
    let mut image = blank();
    source.read_into(0, &mut image)?;
    Ok(image)
}

/// All frames; identical ones are stored once.
fn preload(
    source: &dyn Source,
    n_frames: usize,
    first: &GreyImage,
) -> Result<Vec<Option<Arc<GreyImage>>>, ReplayError> {
    let n_different = (0..n_frames).filter(|idx| source.same_as(*idx) == *idx).count();
    let frame_bytes = first.width() * first.height() * (first.bit_depth() as usize / 8);
    let size_bytes = frame_bytes.saturating_mul(n_different);
    if size_bytes > PRELOAD_LIMIT_BYTES {
        return Err(ReplayError::TooLargeToPreload { size_bytes });
    }
    let mut images: Vec<Option<Arc<GreyImage>>> = Vec::with_capacity(n_frames);
    for idx in 0..n_frames {
        let same = source.same_as(idx);
        let image = match images.get(same) {
            Some(image) => image.clone(),
            None => comparable(source, idx)?.map(Arc::new),
        };
        images.push(image);
    }
    Ok(images)
}
