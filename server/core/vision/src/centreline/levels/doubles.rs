//! Two lines that touch, which a coarser level takes for one, twice as wide.

use super::super::view::{Level, View};
use super::marks::{Line, Mark};
use super::pairs::{Light, is_pair};
use crate::params::{
    DOUBLE_BLOCK_COLUMNS, DOUBLE_COLUMNS, DOUBLE_DIP, DOUBLE_LEAST_BLOCKS, DOUBLE_REACH_WIDTHS, DOUBLE_SIGMAS,
    DOUBLE_SMOOTH_WIDTHS, PAIR_REACH_WIDTHS,
};

/// A line in parts.
#[derive(Default)]
pub struct Parts {
    /// One line each.
    pub single: Vec<Line>,
    /// Two lines each.
    pub double: Vec<Line>,
}

/// Splits a line into the stretches that are one line and those that are two beside each other: where
/// the image itself, of a coarse line, shows two tops and a valley between them that is beyond its noise and speckle, or a shape that is
/// that of two lines of the typical width `base_px` (as measured) rather than of one wide line.
pub fn split_doubles<T: Level>(line: Line, view: &View<T>, base_px: f32) -> Parts {
    // The last stretch takes what is too short for one of its own.
    let n_stretches = (line.len() / DOUBLE_COLUMNS).max(1);
    let start = |stretch: usize| if stretch == n_stretches { line.len() } else { stretch * DOUBLE_COLUMNS };
    let stretches = (0..n_stretches).map(|stretch| &line[start(stretch)..start(stretch + 1)]);
    let mut parts = Parts::default();
    let mut goes_on = false;
    for stretch in stretches {
        let has_valley = stretch[0].rows > 1.0 && is_double(stretch, view);
        if has_valley || is_clear(stretch) && is_pair(&light_of(stretch, view), base_px) {
            goes_on = false;
            parts.double.push(stretch.to_vec());
        } else if goes_on {
            parts.single.last_mut().expect("it goes on").extend_from_slice(stretch);
        } else {
            parts.single.push(stretch.to_vec());
            goes_on = true;
        }
    }
    parts
}

/// Whether the light is below full scale: clipped light is flat, whatever it is.
fn is_clear(stretch: &[Mark]) -> bool {
    4 * stretch.iter().filter(|mark| mark.point.saturated).count() < stretch.len()
}

/// Sums over [`DOUBLE_BLOCK_COLUMNS`] columns of the rows on either side of a line. Neighbouring columns share their
/// speckle: their means count once.
fn blocks<T: Level>(stretch: &[Mark], view: &View<T>, reach: usize) -> Vec<Vec<f32>> {
    let block = |columns: &[Mark]| -> Option<Vec<f32>> {
        let mut sums = vec![0.0f32; 2 * reach + 1];
        for mark in columns {
            let first = (mark.point.v_px.round() as usize).checked_sub(reach)?;
            if first + sums.len() > view.height {
                return None;
            }
            let column = mark.point.u_px as usize;
            sums.iter_mut().enumerate().for_each(|(row, sum)| *sum += view.row(first + row)[column].grey());
        }
        Some(sums)
    };
    stretch.chunks_exact(DOUBLE_BLOCK_COLUMNS).filter_map(block).collect()
}

fn sum_of(blocks: &[Vec<f32>]) -> Vec<f32> {
    let mut whole = vec![0.0f32; blocks.first().map_or(0, Vec::len)];
    blocks.iter().for_each(|block| whole.iter_mut().zip(block).for_each(|(sum, level)| *sum += level));
    whole
}

/// The mean profile of a stretch.
fn light_of<T: Level>(stretch: &[Mark], view: &View<T>) -> Light {
    let across_px = |mark: &Mark| mark.point.width_px / mark.point.normal[1].abs().max(0.1) as f32;
    let width_px = stretch.iter().map(across_px).sum::<f32>() / stretch.len() as f32;
    let blocks = blocks(stretch, view, (PAIR_REACH_WIDTHS * width_px) as usize);
    let profile = if blocks.len() < DOUBLE_LEAST_BLOCKS { Vec::new() } else { sum_of(&blocks) };
    Light { profile, width_px }
}

fn is_double<T: Level>(stretch: &[Mark], view: &View<T>) -> bool {
    let width_px = stretch.iter().map(Mark::width_px).sum::<f32>() / stretch.len() as f32;
    let reach = (DOUBLE_REACH_WIDTHS * width_px) as usize;
    let n_smoothed = ((DOUBLE_SMOOTH_WIDTHS * width_px) as usize).max(1);
    let smoothed = |block: Vec<f32>| block.windows(n_smoothed).map(|rows| rows.iter().sum()).collect();
    let blocks: Vec<Vec<f32>> = blocks(stretch, view, reach).into_iter().map(smoothed).collect();
    if blocks.len() < DOUBLE_LEAST_BLOCKS {
        return false;
    }
    let whole = sum_of(&blocks);
    let top = |rows: std::ops::Range<usize>| rows.max_by(|&a, &b| whole[a].total_cmp(&whole[b]));
    let half = whole.len() / 2;
    let (Some(above), Some(below)) = (top(0..half), top(half..whole.len())) else { return false };
    let Some(valley) = (above..=below).min_by(|&a, &b| whole[a].total_cmp(&whole[b])) else { return false };
    let floor = whole.iter().copied().fold(f32::INFINITY, f32::min);
    [above, below].into_iter().all(|top| {
        let dips = || blocks.iter().map(|block| block[top] - block[valley]);
        let n = blocks.len() as f32;
        let dip = dips().sum::<f32>() / n;
        let variance = dips().map(|of_block| (of_block - dip).powi(2)).sum::<f32>() / (n - 1.0);
        n * dip > DOUBLE_DIP * (whole[top] - floor) && dip > DOUBLE_SIGMAS * (variance / n).sqrt()
    })
}
