//! The dark frame of a camera: the levels of its pixels without light, and which of them are hot.
//!
//! The mean of frames without light is split into a level common to all pixels, the fixed pattern about it, and hot
//! pixels, whose values carry no information about the light. [`DarkFrame::correct`] subtracts the pattern and replaces
//! the hot pixels. The common level is kept: without it the noise would be clipped at zero. Equations:
//! `docs/maths/dark-frame.md`.

mod average;
mod correct;
#[cfg(test)]
mod tests;

pub use average::{DarkFrameAccumulator, DarkFrameError};

use crate::LineDirection;

/// The dark frame of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct DarkFrame {
    width: usize,
    height: usize,
    statistics: DarkFrameStatistics,
    /// Deviation of every pixel from the level, rounded, row-major; 0 for hot pixels.
    pattern: Vec<i16>,
    /// Indices of the hot pixels, ascending.
    hot: Vec<u32>,
}

/// Statistics of a dark frame, in grey levels of its bit depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DarkFrameStatistics {
    /// Frames averaged.
    pub n_frames: usize,
    /// Bits per pixel: 8 or 16.
    pub bit_depth: u32,
    /// Median level of the pixels.
    pub level: f64,
    /// Temporal noise: standard deviation of a pixel from frame to frame (RMS over the pixels that are not hot).
    pub noise: f64,
    /// Standard deviation of the fixed pattern (over the pixels that are not hot, corrected for the noise of the mean).
    pub pattern: f64,
    /// A pixel is hot if its mean exceeds that of its row and column by more than this …
    pub hot_above: f64,
    /// … or if its standard deviation from frame to frame exceeds this.
    pub hot_noise_above: f64,
}

/// What is corrected in an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Correction {
    /// The pattern is subtracted and hot pixels are replaced.
    Full,
    /// Only hot pixels are replaced.
    HotPixels,
}

impl DarkFrame {
    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Its statistics.
    pub fn statistics(&self) -> &DarkFrameStatistics {
        &self.statistics
    }

    /// Columns and rows of the hot pixels, row by row.
    pub fn hot_pixels(&self) -> impl ExactSizeIterator<Item = (usize, usize)> + '_ {
        self.hot.iter().map(|&idx| (idx as usize % self.width, idx as usize / self.width))
    }

    /// Pattern and hot pixels as bytes: two per pixel, row-major, then four per hot pixel, little-endian.
    pub fn to_bytes(&self) -> Vec<u8> {
        let pattern = self.pattern.iter().flat_map(|deviation| deviation.to_le_bytes());
        pattern.chain(self.hot.iter().flat_map(|idx| idx.to_le_bytes())).collect()
    }

    /// The dark frame of `width` × `height` pixels from its statistics and the bytes of [`DarkFrame::to_bytes`]; `None`
    /// if the bytes are not those of such a frame.
    pub fn from_bytes(width: usize, height: usize, statistics: DarkFrameStatistics, bytes: &[u8]) -> Option<Self> {
        let n_pixels = width.checked_mul(height).filter(|n_pixels| *n_pixels > 0)?;
        let (pattern, hot) = bytes.split_at_checked(n_pixels.checked_mul(2)?)?;
        let pattern = pattern.as_chunks().0.iter().map(|bytes| i16::from_le_bytes(*bytes)).collect();
        let (hot, rest) = hot.as_chunks();
        let hot: Vec<u32> = hot.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        let ascending = hot.windows(2).all(|pair| pair[0] < pair[1]);
        let within = hot.last().is_none_or(|last| (*last as usize) < n_pixels);
        (rest.is_empty() && ascending && within && matches!(statistics.bit_depth, 8 | 16)).then_some(Self {
            width,
            height,
            statistics,
            pattern,
            hot,
        })
    }

    fn is_hot(&self, u: usize, v: usize) -> bool {
        self.hot.binary_search(&((v * self.width + u) as u32)).is_ok()
    }
}

/// Pairs of neighbours that may replace a hot pixel, in order of preference: first along the laser lines, where the
/// light changes little, then across.
fn neighbours(direction: LineDirection) -> [[(isize, isize); 2]; 4] {
    let (along, across) = match direction {
        LineDirection::Rows => ((1, 0), (0, 1)),
        LineDirection::Columns => ((0, 1), (1, 0)),
    };
    let pair =
        |(u, v): (isize, isize), distance: isize| [(-distance * u, -distance * v), (distance * u, distance * v)];
    [pair(along, 1), pair(along, 2), pair(across, 1), pair(across, 2)]
}
