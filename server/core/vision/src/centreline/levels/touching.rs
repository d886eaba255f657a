//! Two lines that touch, which a coarser level takes for one, twice as wide.

use super::super::view::{Level, View};
use super::marks::{Line, Mark};
use crate::params::{
    DOUBLE_BLOCK_COLUMNS, DOUBLE_COLUMNS, DOUBLE_DIP, DOUBLE_LEAST_BLOCKS, DOUBLE_REACH_WIDTHS, DOUBLE_SIGMAS,
    DOUBLE_SMOOTH_WIDTHS,
};

/// A line of a coarser level without the stretches that are two lines beside each other: where the image itself shows two
/// tops and a valley between them that is beyond its noise and speckle.
pub fn without_doubles<T: Level>(line: Line, view: &View<T>) -> Vec<Line> {
    // The last stretch takes what is too short for one of its own.
    let n_stretches = (line.len() / DOUBLE_COLUMNS).max(1);
    let start = |stretch: usize| if stretch == n_stretches { line.len() } else { stretch * DOUBLE_COLUMNS };
    let stretches = (0..n_stretches).map(|stretch| &line[start(stretch)..start(stretch + 1)]);
    let mut pieces: Vec<Line> = Vec::new();
    let mut goes_on = false;
    for stretch in stretches {
        if is_double(stretch, view) {
            goes_on = false;
        } else if goes_on {
            pieces.last_mut().expect("it goes on").extend_from_slice(stretch);
        } else {
            pieces.push(stretch.to_vec());
            goes_on = true;
        }
    }
    pieces
}

fn is_double<T: Level>(stretch: &[Mark], view: &View<T>) -> bool {
    let width_px = stretch.iter().map(Mark::width_px).sum::<f32>() / stretch.len() as f32;
    let reach = (DOUBLE_REACH_WIDTHS * width_px) as usize;
    let n_smoothed = ((DOUBLE_SMOOTH_WIDTHS * width_px) as usize).max(1);
    // Neighbouring columns share their speckle: their means count once.
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
    let blocks: Vec<Vec<f32>> = stretch.chunks_exact(DOUBLE_BLOCK_COLUMNS).filter_map(block).collect();
    if blocks.len() < DOUBLE_LEAST_BLOCKS {
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
        n * dip > DOUBLE_DIP * (whole[top] - floor) && dip > DOUBLE_SIGMAS * (variance / n).sqrt()
    })
}
