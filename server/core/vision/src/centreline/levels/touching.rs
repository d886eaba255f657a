//! Two touching lines, which a coarser level detects as one line of twice the width.

use std::ops::Range;

use super::super::view::{Level, View};
use super::marks::Mark;
use crate::params::{
    TOUCHING_BLOCK_COLUMNS, TOUCHING_COLUMNS, TOUCHING_DIP, TOUCHING_LEAST_BLOCKS, TOUCHING_REACH_WIDTHS,
    TOUCHING_SIGMAS, TOUCHING_SMOOTH_WIDTHS,
};

/// The stretches of a line that are tested one by one; the last one includes a remainder that is too short for another.
pub fn stretches(n_columns: usize) -> impl Iterator<Item = Range<usize>> {
    let n = (n_columns / TOUCHING_COLUMNS).max(1);
    let start = move |stretch: usize| if stretch == n { n_columns } else { stretch * TOUCHING_COLUMNS };
    (0..n).map(move |stretch| start(stretch)..start(stretch + 1))
}

/// The parts of a line of a coarser level between the stretches that are two adjacent lines: where the profile in the
/// image itself has two maxima with a minimum between them, significant against noise and speckle.
pub fn single_lines<T: Level>(line: &[Mark], view: &View<T>) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    for stretch in stretches(line.len()).filter(|stretch| !is_touching_pair(&line[stretch.clone()], view)) {
        match parts.last_mut() {
            Some(before) if before.end == stretch.start => before.end = stretch.end,
            _ => parts.push(stretch),
        }
    }
    parts
}

fn is_touching_pair<T: Level>(stretch: &[Mark], view: &View<T>) -> bool {
    let width_px = stretch.iter().map(|mark| mark.width_px).sum::<f32>() / stretch.len() as f32;
    let reach = (TOUCHING_REACH_WIDTHS * width_px) as usize;
    let n_smoothed = ((TOUCHING_SMOOTH_WIDTHS * width_px) as usize).max(1);
    // Neighbouring columns share their speckle: the mean of a block counts once.
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
        Some(sums.windows(n_smoothed).map(|rows| rows.iter().sum()).collect())
    };
    let blocks: Vec<Vec<f32>> = stretch.chunks_exact(TOUCHING_BLOCK_COLUMNS).filter_map(block).collect();
    if blocks.len() < TOUCHING_LEAST_BLOCKS {
        return false;
    }
    let mut whole = vec![0.0f32; blocks[0].len()];
    blocks.iter().for_each(|block| whole.iter_mut().zip(block).for_each(|(sum, level)| *sum += level));
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
        n * dip > TOUCHING_DIP * (whole[top] - floor) && dip > TOUCHING_SIGMAS * (variance / n).sqrt()
    })
}
