//! Correction of an image by a dark frame.

use crate::dark_frame::{Correction, DarkFrame, neighbours};
use crate::{GreyImage, LevelsMut, LineDirection};

impl DarkFrame {
    /// Corrects an image whose top-left pixel is column `left`, row `top` of the dark frame. `None`, with the image
    /// unchanged, if it is not within the dark frame, or if the pattern is to be subtracted and the bit depths differ.
    ///
    /// A pixel at full scale is kept: it is saturated. `direction`: direction of the laser lines, along which hot
    /// pixels are preferably replaced.
    pub fn correct(
        &self,
        image: &mut GreyImage,
        (left, top): (usize, usize),
        direction: LineDirection,
        wanted: Correction,
    ) -> Option<()> {
        let (width, height) = (image.width(), image.height());
        if left + width > self.width || top + height > self.height {
            return None;
        }
        if wanted == Correction::Full && image.bit_depth() != self.statistics.bit_depth {
            return None;
        }
        match image.levels_mut() {
            LevelsMut::Eight(levels) => self.correct_levels(levels, width, (left, top), direction, wanted),
            LevelsMut::Sixteen(levels) => self.correct_levels(levels, width, (left, top), direction, wanted),
        }
        Some(())
    }

    fn correct_levels<L: Level>(
        &self,
        levels: &mut [L],
        width: usize,
        (left, top): (usize, usize),
        direction: LineDirection,
        wanted: Correction,
    ) {
        if wanted == Correction::Full {
            for (v, row) in levels.chunks_exact_mut(width).enumerate() {
                let start = (top + v) * self.width + left;
                L::subtract(row, &self.pattern[start..start + width]);
            }
        }
        let height = levels.len() / width;
        for (u, v) in self.hot_pixels() {
            let within = (left..left + width).contains(&u) && (top..top + height).contains(&v);
            if within
                && let Some(level) = self.replacement(levels, (width, height), (left, top), (u, v), direction)
            {
                levels[(v - top) * width + u - left] = level;
            }
        }
    }

    /// Mean of the nearest pair of good neighbours, otherwise of the good ones within two pixels; `None` if there are
    /// none.
    fn replacement<L: Level>(
        &self,
        levels: &[L],
        (width, height): (usize, usize),
        (left, top): (usize, usize),
        (u, v): (usize, usize),
        direction: LineDirection,
    ) -> Option<L> {
        let good = |(du, dv): (isize, isize)| {
            let (u, v) = (u.checked_add_signed(du)?, v.checked_add_signed(dv)?);
            let (column, row) = (u.checked_sub(left)?, v.checked_sub(top)?);
            (column < width && row < height && !self.is_hot(u, v))
                .then(|| u32::from(levels[row * width + column].into()))
        };
        for [one, other] in neighbours(direction) {
            if let (Some(one), Some(other)) = (good(one), good(other)) {
                return Some(L::from_u32((one + other).div_ceil(2)));
            }
        }
        let around = (-2..=2).flat_map(|dv| (-2..=2).map(move |du| (du, dv)));
        let (sum, n) = around.filter_map(good).fold((0, 0), |(sum, n), level| (sum + level, n + 1));
        (n > 0).then(|| L::from_u32((sum + n / 2) / n))
    }
}

/// A grey level.
trait Level: Copy + Into<u16> {
    /// From a number that is within its range.
    fn from_u32(level: u32) -> Self;
    /// Subtracts a pattern from a row; pixels at full scale are kept.
    fn subtract(row: &mut [Self], pattern: &[i16]);
}

impl Level for u8 {
    fn from_u32(level: u32) -> Self {
        level as u8
    }

    fn subtract(row: &mut [Self], pattern: &[i16]) {
        for (level, deviation) in row.iter_mut().zip(pattern) {
            let corrected = i16::from(*level).saturating_sub(*deviation).clamp(0, 255) as u8;
            *level = if *level == Self::MAX { Self::MAX } else { corrected };
        }
    }
}

impl Level for u16 {
    fn from_u32(level: u32) -> Self {
        level as u16
    }

    fn subtract(row: &mut [Self], pattern: &[i16]) {
        for (level, deviation) in row.iter_mut().zip(pattern) {
            let corrected = (i32::from(*level) - i32::from(*deviation)).clamp(0, i32::from(Self::MAX)) as u16;
            *level = if *level == Self::MAX { Self::MAX } else { corrected };
        }
    }
}
