//! Averages frames without light to a dark frame.

use std::borrow::Cow;

use remedy::Remedy;
use statistics::{SIGMA_PER_MAD, median};

use crate::dark_frame::{DarkFrame, DarkFrameStatistics};
use crate::{GreyImage, Pixels};

/// Fewest frames: the noise of a pixel must be known well enough to detect flickering pixels.
const MIN_FRAMES: usize = 8;

/// Most frames: sums of 16-bit squares stay exact far beyond this number, but more frames gain nothing.
const MAX_FRAMES: usize = 1024;

/// Side of the blocks whose medians reveal a scene.
const BLOCK_PX: usize = 32;

/// Largest difference between the medians of blocks, as a fraction of full scale: amplifier glow at exposures of
/// milliseconds is far below, a dim scene above.
const MAX_UNEVENNESS: f64 = 0.01;

/// Additional tolerance for the row and column pattern, in its standard deviations: ±3 over the blocks of a sensor, and
/// a median scatters 1.25 times as much as a mean.
const PATTERN_SIGMAS: f64 = 7.5;

/// Largest common level, as a fraction of full scale: black levels of cameras are a few per cent.
const MAX_DARK_LEVEL: f64 = 0.15;

/// Variance of rounding to integer levels.
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;

/// Largest variance due to rounding of a level between two integers.
const DITHER_VARIANCE: f64 = 0.25;

/// Why no dark frame can be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DarkFrameError {
    /// Too few or too many frames.
    #[error("a dark frame is averaged from {MIN_FRAMES} to {MAX_FRAMES} frames, not {got}")]
    Count {
        /// Frames given.
        got: usize,
    },
    /// Frames of different formats.
    #[error("the frames differ in size or bit depth")]
    Mixed,
    /// The frames show light.
    #[error("the frames are not dark: {what}")]
    Lit {
        /// What was detected.
        what: String,
    },
}

impl Remedy for DarkFrameError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::Count { .. } => "change the number of frames",
            Self::Mixed => "do not change the camera settings during the capture",
            Self::Lit { .. } => "cover the lens or darken the room, and capture it again",
        }))
    }
}

/// Sums over frames without light.
#[derive(Debug, Clone, Default)]
pub struct DarkFrameAccumulator {
    format: Option<(usize, usize, u32)>,
    n_frames: usize,
    sums: Vec<u64>,
    squares: Vec<u64>,
}

impl DarkFrameAccumulator {
    /// Adds a frame.
    ///
    /// # Errors
    /// [`DarkFrameError::Mixed`] if its format is not that of the first; [`DarkFrameError::Count`] if there are too many.
    pub fn add(&mut self, image: &GreyImage) -> Result<(), DarkFrameError> {
        let format = (image.width(), image.height(), image.bit_depth());
        if *self.format.get_or_insert(format) != format {
            return Err(DarkFrameError::Mixed);
        }
        if self.n_frames == MAX_FRAMES {
            return Err(DarkFrameError::Count { got: MAX_FRAMES + 1 });
        }
        self.n_frames += 1;
        self.sums.resize(format.0 * format.1, 0);
        self.squares.resize(format.0 * format.1, 0);
        match image.pixels() {
            Pixels::Eight(levels) => self.accumulate(levels),
            Pixels::Sixteen(levels) => self.accumulate(levels),
        }
        Ok(())
    }

    fn accumulate<L: Copy + Into<u64>>(&mut self, levels: &[L]) {
        for ((sum, squares), level) in self.sums.iter_mut().zip(&mut self.squares).zip(levels) {
            let level: u64 = (*level).into();
            *sum += level;
            *squares += level * level;
        }
    }

    /// The dark frame.
    ///
    /// # Errors
    /// [`DarkFrameError::Count`] with too few frames, [`DarkFrameError::Lit`] if they show light.
    pub fn finish(&self) -> Result<DarkFrame, DarkFrameError> {
        let n = self.n_frames as f64;
        let Some((width, height, bit_depth)) = self.format.filter(|_| self.n_frames >= MIN_FRAMES) else {
            return Err(DarkFrameError::Count { got: self.n_frames });
        };
        let full_scale = f64::from((1_u32 << bit_depth) - 1);
        let means: Vec<f64> = self.sums.iter().map(|&sum| sum as f64 / n).collect();
        let level = median_level(&mut means.clone());
        check_dark(&means, width, level, full_scale)?;
        let variance_of = |(&sum, &squares): (&u64, &u64)| {
            // Exact: both products are whole numbers below 2⁶³.
            (self.n_frames as u64 * squares - sum * sum) as f64 / (n * (n - 1.0))
        };
        let variances: Vec<f64> = self.sums.iter().zip(&self.squares).map(variance_of).collect();
        let deviates = max_normal_deviate(means.len());
        let residuals = residuals_from_rows_and_columns(&means, width);
        let spread = SIGMA_PER_MAD * median_level(&mut residuals.iter().map(|r| r.abs()).collect::<Vec<_>>());
        let typical_variance = median_level(&mut variances.clone()).max(DITHER_VARIANCE);
        let hot_above = deviates * spread.max(((typical_variance + ROUNDING_VARIANCE) / n).sqrt());
        let hot_variance = typical_variance * chi_square_ratio(n - 1.0, deviates);
        let is_hot = |idx: usize| residuals[idx] > hot_above || variances[idx] > hot_variance;
        let hot: Vec<u32> = (0..means.len()).filter(|&idx| is_hot(idx)).map(|idx| idx as u32).collect();
        let mut pattern: Vec<i16> = means.iter().map(|mean| (mean - level).round() as i16).collect();
        let (mut noise, mut spread_of_means) = (0.0, 0.0);
        for idx in 0..means.len() {
            if !is_hot(idx) {
                noise += variances[idx];
                spread_of_means += (means[idx] - level).powi(2);
            }
        }
        hot.iter().for_each(|&idx| pattern[idx as usize] = 0);
        let n_good = (means.len() - hot.len()).max(1) as f64;
        let (noise, spread_of_means) = (noise / n_good, spread_of_means / n_good);
        let statistics = DarkFrameStatistics {
            n_frames: self.n_frames,
            bit_depth,
            level,
            noise: noise.sqrt(),
            pattern: (spread_of_means - noise / n).max(0.0).sqrt(),
            hot_above,
            hot_noise_above: hot_variance.sqrt(),
        };
        Ok(DarkFrame { width, height, statistics, pattern, hot })
    }
}

/// Refuses frames that are too bright or unevenly bright.
fn check_dark(means: &[f64], width: usize, level: f64, full_scale: f64) -> Result<(), DarkFrameError> {
    let percent = |levels: f64| 100.0 * levels / full_scale;
    if level > MAX_DARK_LEVEL * full_scale {
        let what = format!("their level is {:.1} % of full scale", percent(level));
        return Err(DarkFrameError::Lit { what });
    }
    let height = means.len() / width;
    let (mut darkest, mut brightest) = (f64::INFINITY, f64::NEG_INFINITY);
    for top in (0..height).step_by(BLOCK_PX) {
        for left in (0..width).step_by(BLOCK_PX) {
            let rows = top..(top + BLOCK_PX).min(height);
            let mut block: Vec<f64> = rows
                .flat_map(|v| &means[v * width + left..v * width + (left + BLOCK_PX).min(width)])
                .copied()
                .collect();
            let level = median_level(&mut block);
            (darkest, brightest) = (darkest.min(level), brightest.max(level));
        }
    }
    let pattern = neighbour_scatter(&rows_of(means, width)) + neighbour_scatter(&columns_of(means, width));
    let explained = PATTERN_SIGMAS * pattern / (BLOCK_PX as f64).sqrt();
    if brightest - darkest > MAX_UNEVENNESS * full_scale + explained {
        let what =
            format!("some areas are brighter than others by {:.1} % of full scale", percent(brightest - darkest));
        return Err(DarkFrameError::Lit { what });
    }
    Ok(())
}

/// Median of every row.
fn rows_of(means: &[f64], width: usize) -> Vec<f64> {
    means.chunks_exact(width).map(|row| median_level(&mut row.to_vec())).collect()
}

/// The median of every column.
fn columns_of(means: &[f64], width: usize) -> Vec<f64> {
    let column = |u: usize| means.iter().skip(u).step_by(width).copied().collect::<Vec<_>>();
    (0..width).map(|u| median_level(&mut column(u))).collect()
}

/// Robust standard deviation of a pattern from the differences of neighbours, between which a scene changes little.
fn neighbour_scatter(levels: &[f64]) -> f64 {
    let mut steps: Vec<f64> = levels.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    SIGMA_PER_MAD * median_level(&mut steps) / std::f64::consts::SQRT_2
}

fn median_level(levels: &mut [f64]) -> f64 {
    median(levels).unwrap_or_default()
}

/// Deviation of every pixel from the medians of its row and its column: row and column patterns of the readout are
/// subtracted, not treated as hot pixels.
fn residuals_from_rows_and_columns(means: &[f64], width: usize) -> Vec<f64> {
    let mut rest = means.to_vec();
    for row in rest.chunks_exact_mut(width) {
        let level = median_level(&mut row.to_vec());
        row.iter_mut().for_each(|mean| *mean -= level);
    }
    for u in 0..width {
        let level = median_level(&mut rest.iter().skip(u).step_by(width).copied().collect::<Vec<_>>());
        rest.iter_mut().skip(u).step_by(width).for_each(|mean| *mean -= level);
    }
    rest
}

/// The normal deviate exceeded by the largest of `n` good pixels with a probability of one half: `z ≈ √(2 ln n) − (ln
/// ln n + ln 4π) / 2√(2 ln n)`, plus 0.5 for the scatter of the maximum.
fn max_normal_deviate(n: usize) -> f64 {
    let log = (n.max(16) as f64).ln();
    let first = (2.0 * log).sqrt();
    first - (log.ln() + (4.0 * std::f64::consts::PI).ln()) / (2.0 * first) + 0.5
}

/// Ratio of a sample variance with `freedom` degrees of freedom to the true one, at the quantile of that normal deviate
/// (Wilson and Hilferty 1931, PNAS 17, 684).
fn chi_square_ratio(freedom: f64, deviate: f64) -> f64 {
    let c = 2.0 / (9.0 * freedom);
    (1.0 - c + deviate * c.sqrt()).powi(3)
}
