//! Lines of two levels as those of one image.

use super::marks::{Line, Mark, Place, Spot, kept, stitched, without};
use crate::params::{
    LEVEL_CLAIMED_FRACTION, LEVEL_LEAST_LENGTH_WIDTHS, LEVEL_NARROWEST, LEVEL_SURE, LEVEL_WIDEST_PX,
    MIN_SEGMENT_COLUMNS,
};

/// `lines`, found so far, merged with those of a coarser level; every crossing is kept once, from the level whose band
/// contains its width. `single`: splits a coarse line into the parts that are a single line.
pub fn merged(lines: Vec<Line>, coarse: Vec<Line>, base_px: f32, single: impl Fn(Line) -> Vec<Line>) -> Vec<Line> {
    let mut removed = Vec::new();
    let mut added = Vec::new();
    let is_own =
        |mark: &Mark| mark.spot().fit(base_px) > LEVEL_NARROWEST && mark.point.width_px <= LEVEL_WIDEST_PX;
    for line in coarse.into_iter().flat_map(|line| kept(line, is_own)).flat_map(single) {
        let others = near(&lines, &line);
        let is_claimed =
            |others: &Vec<(Place, Spot)>| others.iter().any(|(_, other)| other.fit(base_px) <= LEVEL_SURE);
        let claimed: Vec<bool> = others.iter().map(is_claimed).collect();
        let n_claimed = claimed.iter().filter(|claimed| **claimed).count();
        if n_claimed as f32 > LEVEL_CLAIMED_FRACTION * line.len() as f32 {
            continue;
        }
        let beaten = others.iter().zip(&claimed).filter(|(_, claimed)| !**claimed);
        removed.extend(beaten.flat_map(|(others, _)| others.iter().map(|(place, _)| *place)));
        let mut claimed = claimed.into_iter();
        added.extend(kept(line, |_| !claimed.next().expect("one per mark")));
    }
    let mut lines = without(lines, &removed);
    lines.extend(added);
    let mut lines = stitched(lines);
    lines.retain(|line| line.len() >= MIN_SEGMENT_COLUMNS && !is_glow(line));
    lines
}

/// For every mark of `line`, the marks of `lines` in its column that are detections of the same line.
fn near(lines: &[Line], line: &Line) -> Vec<Vec<(Place, Spot)>> {
    let first = first_column(line);
    let beside: Vec<(usize, usize)> = lines
        .iter()
        .enumerate()
        .map(|(idx, other)| (idx, first_column(other)))
        .filter(|&(idx, begin)| begin < first + line.len() && first < begin + lines[idx].len())
        .collect();
    let near_one = |(column, mark): (usize, &Mark)| {
        let spot = mark.spot();
        let here = beside.iter().filter_map(|&(idx, begin)| {
            let at = column.checked_sub(begin)?;
            Some(((idx, at), lines[idx].get(at)?.spot()))
        });
        here.filter(|(_, other)| other.is_near(&spot)).collect()
    };
    (first..).zip(line).map(near_one).collect()
}

fn first_column(line: &Line) -> usize {
    line.first().map_or(0, |mark| mark.point.u_px as usize)
}

/// Whether a line detected at a coarser level is too short for its width: a glow, not a line.
fn is_glow(line: &Line) -> bool {
    let widths_px: f32 = line.iter().map(|mark| mark.point.width_px).sum();
    let n_columns = line.len() as f32;
    line.iter().any(|mark| mark.rows > 1.0) && n_columns * n_columns < LEVEL_LEAST_LENGTH_WIDTHS * widths_px
}
