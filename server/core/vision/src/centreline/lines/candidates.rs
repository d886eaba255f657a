//! Candidate positions of lines: local maxima of a box that is brighter than both its flanks.

use crate::params::{BOX_HEIGHT_WIDTHS, FLANK_DISTANCE_WIDTHS};

/// A position at which a column may cross a line.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Column.
    pub u: u32,
    /// Row.
    pub v: u32,
    /// Mean grey level of the box above its brighter flank.
    pub contrast: f32,
    /// Contrast over its standard deviation.
    pub snr: f32,
}

/// The boxes compared while looking for lines.
#[derive(Debug, Clone, Copy)]
pub struct Boxes {
    /// Half-height of a box: it covers `2 * half_height + 1` rows.
    pub half_height: usize,
    /// Rows from the middle of a box to the middle of either flank.
    pub flank: usize,
}

impl Boxes {
    /// Boxes for lines of this full width at half height.
    pub fn for_width(width_px: f32) -> Self {
        let half_height = (0.5 * BOX_HEIGHT_WIDTHS * width_px).round().max(1.0) as usize;
        let flank = (FLANK_DISTANCE_WIDTHS * width_px).ceil() as usize + 1;
        Self { half_height, flank }
    }

    /// Rows in a box.
    pub fn rows(&self) -> usize {
        2 * self.half_height + 1
    }
}
