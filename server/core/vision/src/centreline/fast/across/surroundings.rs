//! Measurements around a crossing before its ridge is located: background, height, area, width.

use super::block::{Block, Image, Lanes};
use super::pieces::WIDTH_PER_AREA;
use super::window::{LANES, Window};
use crate::centreline::fast::lanes::Numbers;
use crate::centreline::lines::candidates::Boxes;
use crate::centreline::view::{Level, Sum};
use crate::params::{CLEARANCE_MIN_WIDTHS, FLANK_STEP_EVEN, FLANK_STEP_MAX, WIDTH_MIN_PX};

/// Measurements of a window before the ridge is located.
pub struct Surroundings {
    pub background: Lanes,
    pub background_slope: Lanes,
    pub is_even: [bool; LANES],
    pub clearance_px: Lanes,
    pub plausible: [bool; LANES],
    pub height: Lanes,
    pub area: Lanes,
    pub saturated: [bool; LANES],
}

/// Background, height and area of every crossing. Where one flank lies outside the image, the other is used for both.
#[inline(always)]
pub fn surroundings<T: Level>(image: &Image<T>, block: &Block, window: &Window<T>) -> Surroundings {
    let Boxes { half_height: half, flank } = image.boxes;
    let n_rows = image.boxes.rows() as f32;
    let half_area = flank - half - 1;
    let n_light = (2 * half_area + 1) as f32;
    let above = sum_of(window.rows(-(flank as isize), half));
    let below = sum_of(window.rows(flank as isize, half));
    let top = sum_of(window.rows(0, 1));
    let light = sum_of(window.rows(0, half_area));
    let rows: [&[T; LANES]; 3] = [window.row(-1), window.row(0), window.row(1)];
    let mut seen = Surroundings {
        background: [0.0; LANES],
        background_slope: [0.0; LANES],
        is_even: [false; LANES],
        clearance_px: [0.0; LANES],
        plausible: [false; LANES],
        height: [0.0; LANES],
        area: [0.0; LANES],
        saturated: [false; LANES],
    };
    for i in 0..LANES {
        seen.saturated[i] = rows[0][i].max(rows[1][i]).max(rows[2][i]).grey() >= image.view.full_scale;
    }
    let per_row = 1.0 / n_rows;
    let per_distance = 1.0 / (2.0 * flank as f32);
    let v = block.places.v;
    let (first, last) = (flank as u32, (image.view.height - flank) as u32);
    for i in 0..LANES {
        let (above, below) = (above[i] * per_row, below[i] * per_row);
        let above = if v[i] < first { below } else { above };
        let below = if v[i] >= last { above } else { below };
        let difference = below - above;
        let even = difference.abs() < FLANK_STEP_EVEN * block.contrast[i];
        let background = 0.5 * (above + below);
        seen.plausible[i] = difference.abs() <= FLANK_STEP_MAX * block.contrast[i];
        seen.is_even[i] = even;
        seen.background_slope[i] = if even { difference * per_distance } else { 0.0 };
        let clearance_px = block.clearance_px[i];
        seen.clearance_px[i] = if even { clearance_px } else { clearance_px.min(flank as f32) };
        seen.background[i] = background;
        seen.height[i] = top[i] * (1.0 / 3.0) - background;
        seen.area[i] = light[i] - n_light * background;
    }
    seen
}

impl Surroundings {
    /// Width of the block's lines along the column, and the smallest clearance among those that can be measured.
    #[inline(always)]
    pub fn width_and_clearance(&self, n: usize, typical_px: f32) -> (f32, f32) {
        let (mut area, mut height, mut clearance_px) = ([0.0f32; LANES], [0.0f32; LANES], [f32::INFINITY; LANES]);
        for i in 0..LANES {
            let counts = self.plausible[i] & (i < n);
            area[i] = if counts { self.area[i].max(0.0) } else { 0.0 };
            height[i] = if counts { self.height[i].max(0.0) } else { 0.0 };
            let clear = counts & (self.clearance_px[i] >= CLEARANCE_MIN_WIDTHS * WIDTH_MIN_PX);
            clearance_px[i] = if clear { self.clearance_px[i] } else { f32::INFINITY };
        }
        let (area, height) = (Numbers(area).sum(), Numbers(height).sum());
        let width_px = if height > 0.0 { WIDTH_PER_AREA * area / height } else { typical_px };
        (width_px.clamp(WIDTH_MIN_PX, 2.0 * typical_px), Numbers(clearance_px).least())
    }
}

#[inline(always)]
fn sum_of<'a, T: Level + 'a>(rows: impl Iterator<Item = &'a [T; LANES]>) -> Lanes {
    let mut sum = [T::Sum::default(); LANES];
    for row in rows {
        (0..LANES).for_each(|i| sum[i] = sum[i].plus(row[i].sum()));
    }
    let mut numbers = [0.0; LANES];
    for i in 0..LANES {
        numbers[i] = sum[i].number();
    }
    numbers
}
