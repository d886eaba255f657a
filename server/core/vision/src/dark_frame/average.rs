//! From frames without light to a dark frame.

use std::borrow::Cow;

use remedy::Remedy;
use statistics::median;

use crate::dark_frame::{DarkFigures, DarkFrame};
use crate::{GreyImage, Pixels};

/// Fewest frames: the noise of a pixel must be known well enough to find those that flicker.
const FEWEST_FRAMES: usize = 8;

/// Most frames: sums of 16-bit squares stay exact far beyond, but no more is gained.
const MOST_FRAMES: usize = 1024;

/// Side of the blocks whose medians show a scene.
const BLOCK_PX: usize = 32;

/// Largest difference between the medians of blocks, share of full scale: a sensor's glow at exposures of milliseconds is
/// far below, a dim scene above.
const EVEN_WITHIN: f64 = 0.01;

/// By how many standard deviations the median of a block may further deviate because of the pattern of its rows and columns:
/// ±3 over the blocks of a sensor, and a median scatters 1.25 times as much as a mean.
const PATTERN_DEVIATES: f64 = 7.5;

/// Largest common level, share of full scale: black levels of cameras are a few percent.
const DARK_BELOW: f64 = 0.15;

/// Standard deviation of a median absolute deviation of 1, for a normal distribution.
const SIGMA_PER_MAD: f64 = 1.4826;

/// Variance of rounding to whole levels.
const ROUNDING: f64 = 1.0 / 12.0;

/// Largest variance that rounding alone makes of a constant level between two whole ones.
const FLIPPING: f64 = 0.25;

/// Why frames give no dark frame.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DarkFrameError {
    /// Too few or too many frames.
    #[error("a dark frame is averaged from {FEWEST_FRAMES} to {MOST_FRAMES} frames, not {got}")]
    Count {
        /// Frames given.
        got: usize,
    },
    /// Frames of different formats.
    #[error("the frames differ in size or bit depth")]
    Mixed,
    /// They show something.
    #[error("the frames are not dark: {what}")]
    Lit {
        /// What was seen.
        what: String,
    },
}

impl Remedy for DarkFrameError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::Count { .. } => "take another number of frames",
            Self::Mixed => "do not change the camera's settings meanwhile",
            Self::Lit { .. } => "cover the lens with its cap, or darken the room, and take it again",
        }))
    }
}

/// Sums over frames without light.
#[derive(Debug, Clone, Default)]
pub struct DarkFrames {
    format: Option<(usize, usize, u32)>,
    n_frames: usize,
    sums: Vec<u64>,
    squares: Vec<u64>,
}

impl DarkFrames {
    /// Adds a frame.
    ///
    /// # Errors
    /// [`DarkFrameError::Mixed`] if its format is not that of the first; [`DarkFrameError::Count`] if there are too many.
    pub fn add(&mut self, image: &GreyImage) -> Result<(), DarkFrameError> {
        let format = (image.width(), image.height(), image.bit_depth());
        if *self.format.get_or_insert(format) != format {
            return Err(DarkFrameError::Mixed);
        }
        if self.n_frames == MOST_FRAMES {
            return Err(DarkFrameError::Count { got: MOST_FRAMES + 1 });
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
        let Some((width, height, bit_depth)) = self.format.filter(|_| self.n_frames >= FEWEST_FRAMES) else {
            return Err(DarkFrameError::Count { got: self.n_frames });
        };
        let full_scale = f64::from((1_u32 << bit_depth) - 1);
        let means: Vec<f64> = self.sums.iter().map(|&sum| sum as f64 / n).collect();
        let level = middle(&mut means.clone());
        check_dark(&means, width, level, full_scale)?;
        let variance_of = |(&sum, &squares): (&u64, &u64)| {
            // Exact: both products are whole numbers below 2⁶³.
            (self.n_frames as u64 * squares - sum * sum) as f64 / (n * (n - 1.0))
        };
        let variances: Vec<f64> = self.sums.iter().zip(&self.squares).map(variance_of).collect();
        let deviates = chance_deviate(means.len());
        let residuals = beyond_rows_and_columns(&means, width);
        let spread = SIGMA_PER_MAD * middle(&mut residuals.iter().map(|r| r.abs()).collect::<Vec<_>>());
        let typical_variance = middle(&mut variances.clone()).max(FLIPPING);
        let hot_above = deviates * spread.max(((typical_variance + ROUNDING) / n).sqrt());
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
        let figures = DarkFigures {
            n_frames: self.n_frames,
            bit_depth,
            level,
            noise: noise.sqrt(),
            pattern: (spread_of_means - noise / n).max(0.0).sqrt(),
            hot_above,
            hot_noise_above: hot_variance.sqrt(),
        };
        Ok(DarkFrame { width, height, figures, pattern, hot })
    }
}

/// Refuses frames of a scene: too bright, or with places that are brighter than others.
fn check_dark(means: &[f64], width: usize, level: f64, full_scale: f64) -> Result<(), DarkFrameError> {
    let percent = |levels: f64| 100.0 * levels / full_scale;
    if level > DARK_BELOW * full_scale {
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
            let level = middle(&mut block);
            (darkest, brightest) = (darkest.min(level), brightest.max(level));
        }
    }
    let pattern = scatter_of_neighbours(&rows_of(means, width)) + scatter_of_neighbours(&columns_of(means, width));
    let explained = PATTERN_DEVIATES * pattern / (BLOCK_PX as f64).sqrt();
    if brightest - darkest > EVEN_WITHIN * full_scale + explained {
        let what = format!(
            "parts of them are brighter than others by {:.1} % of full scale",
            percent(brightest - darkest)
        );
        return Err(DarkFrameError::Lit { what });
    }
    Ok(())
}

/// The median of every row.
fn rows_of(means: &[f64], width: usize) -> Vec<f64> {
    means.chunks_exact(width).map(|row| middle(&mut row.to_vec())).collect()
}

/// The median of every column.
fn columns_of(means: &[f64], width: usize) -> Vec<f64> {
    let column = |u: usize| means.iter().skip(u).step_by(width).copied().collect::<Vec<_>>();
    (0..width).map(|u| middle(&mut column(u))).collect()
}

/// Standard deviation of values from one to the next: that of a pattern, since a scene changes little between neighbours.
fn scatter_of_neighbours(levels: &[f64]) -> f64 {
    let mut steps: Vec<f64> = levels.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    SIGMA_PER_MAD * middle(&mut steps) / std::f64::consts::SQRT_2
}

fn middle(levels: &mut [f64]) -> f64 {
    median(levels).unwrap_or_default()
}

/// Deviation of every pixel from the medians of its row and its column: lines of readout amplifiers are a pattern to be
/// subtracted, not rows of hot pixels.
fn beyond_rows_and_columns(means: &[f64], width: usize) -> Vec<f64> {
    let mut rest = means.to_vec();
    for row in rest.chunks_exact_mut(width) {
        let level = middle(&mut row.to_vec());
        row.iter_mut().for_each(|mean| *mean -= level);
    }
    for u in 0..width {
        let level = middle(&mut rest.iter().skip(u).step_by(width).copied().collect::<Vec<_>>());
        rest.iter_mut().skip(u).step_by(width).for_each(|mean| *mean -= level);
    }
    rest
}

/// The normal deviate that one of `n` good pixels exceeds with a probability of one half:
/// `z ≈ √(2 ln n) − (ln ln n + ln 4π) / 2√(2 ln n)`, rounded up by the constant's spread.
fn chance_deviate(n: usize) -> f64 {
    let log = (n.max(16) as f64).ln();
    let first = (2.0 * log).sqrt();
    first - (log.ln() + (4.0 * std::f64::consts::PI).ln()) / (2.0 * first) + 0.5
}

/// Ratio of a sample variance with `freedom` degrees of freedom to the true one, exceeded like that normal deviate
/// (Wilson and Hilferty 1931, PNAS 17, 684).
fn chi_square_ratio(freedom: f64, deviate: f64) -> f64 {
    let c = 2.0 / (9.0 * freedom);
    (1.0 - c + deviate * c.sqrt()).powi(3)
}
