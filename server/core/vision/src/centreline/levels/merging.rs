//! Lines of two levels as those of one image.

use std::ops::Range;

use super::super::view::{Level, View};
use super::marks::{Line, Mark, Place, kept, stitched, without};
use super::touching::{single_lines, stretches};
use crate::params::{
    LEVEL_CLAIMED_FRACTION, LEVEL_LEAST_LENGTH_WIDTHS, LEVEL_NARROWEST, LEVEL_SURE, LEVEL_WIDEST_PX,
    MIN_SEGMENT_COLUMNS,
};

/// `lines`, found so far in `view`, merged with those of a coarser level; every crossing is kept once, from the level
/// whose band contains its width.
pub fn merged<T: Level>(lines: Vec<Line>, coarse: Vec<Line>, base_px: f32, view: &View<T>) -> Vec<Line> {
    let mut removed = Vec::new();
    let mut added = Vec::new();
    let is_own = |mark: &Mark| mark.fit(base_px) > LEVEL_NARROWEST && mark.point.width_px <= LEVEL_WIDEST_PX;
    for line in coarse.into_iter().flat_map(|line| kept(line, is_own)) {
        let others = detected_before(&lines, &line);
        let mut is_claimed = vec![false; line.len()];
        for &(at, (other, at_other)) in &others {
            is_claimed[at] |= lines[other][at_other].fit(base_px) <= LEVEL_SURE;
        }
        let is_several = |part: Range<usize>| {
            let n_claimed = is_claimed[part.clone()].iter().filter(|is_claimed| **is_claimed).count();
            n_claimed as f32 > LEVEL_CLAIMED_FRACTION * part.len() as f32
        };
        if stretches(line.len()).all(is_several) {
            continue;
        }
        for part in single_lines(&line, view).into_iter().filter(|part| !is_several(part.clone())) {
            let beaten = others.iter().filter(|(at, _)| part.contains(at) && !is_claimed[*at]);
            removed.extend(beaten.map(|(_, place)| *place));
            let mut is_claimed = is_claimed[part.clone()].iter();
            added.extend(kept(line[part].to_vec(), |_| is_claimed.next() == Some(&false)));
        }
    }
    let mut lines = without(lines, removed);
    lines.extend(added);
    let mut lines = stitched(lines);
    lines.retain(|line| line.len() >= MIN_SEGMENT_COLUMNS && !is_glow(line));
    lines
}

/// Marks of `lines` that are detections of `line` as well: the place in `line`, then theirs.
fn detected_before(lines: &[Line], line: &Line) -> Vec<(usize, Place)> {
    let first = first_column(line);
    let mut places = Vec::new();
    for (idx, other) in lines.iter().enumerate() {
        let begin = first_column(other);
        for column in first.max(begin)..(first + line.len()).min(begin + other.len()) {
            if line[column - first].is_near(&other[column - begin]) {
                places.push((column - first, (idx, column - begin)));
            }
        }
    }
    places
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
