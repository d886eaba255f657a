//! Where two lines run into each other: beyond, the search finds one line between them, which is neither.

use crate::centreline::{CentrelinePoint, Segment};
use crate::params::{MIN_SEGMENT_COLUMNS, TOUCHING_CLOSEST_WIDTHS, TOUCHING_MERGED_WIDTHS};

/// Columns without a merged point after which the lines are separate again.
const CLEAR_COLUMNS: usize = 16;
/// Smallest change of the distance per column, in widths, of lines that cross and do not just touch.
const CROSSING_WIDTHS_PER_COLUMN: f64 = 0.008;

/// Two neighbouring lines where they were last seen separately.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// First column beyond.
    pub u: usize,
    /// Whether the columns beyond are those to the right.
    pub is_forward: bool,
    /// Middle of the two there, its rows per column away from the end.
    pub middle: [f64; 2],
    /// Their distance there and its change per column away from the end.
    pub distance: [f64; 2],
    /// Full width of one of them at half height along the column, px.
    pub width_px: f64,
}

/// Removes the points of lines that consist of two beyond their `ends`.
pub fn without_merged(segments: Vec<Segment>, ends: &[End], width: usize) -> Vec<Segment> {
    let mut columns: Vec<Vec<(usize, usize)>> = vec![Vec::new(); width];
    for (line, segment) in segments.iter().enumerate() {
        for (at, point) in segment.points.iter().enumerate() {
            columns[point.u_px as usize].push((line, at));
        }
    }
    let mut is_merged: Vec<Vec<bool>> = segments.iter().map(|segment| vec![false; segment.points.len()]).collect();
    for end in ends {
        let (mut middle, mut n_clear) = (end.middle[0], 0);
        for step in 0.. {
            let u = if end.is_forward { end.u.checked_add(step) } else { end.u.checked_sub(step) };
            let Some(column) = u.and_then(|u| columns.get(u)) else { break };
            let distance = end.distance[0] + end.distance[1] * step as f64;
            let crosses = end.distance[1] < -CROSSING_WIDTHS_PER_COLUMN * end.width_px;
            let overlap = crosses && distance.abs() < TOUCHING_CLOSEST_WIDTHS * end.width_px;
            let expected = middle;
            let near = |&&(line, at): &&(usize, usize)| {
                (segments[line].points[at].v_px - expected).abs() < 0.5 * end.width_px
            };
            middle += end.middle[1];
            let nearest = column
                .iter()
                .find(near)
                .filter(|&&(line, at)| overlap || is_wide(&segments[line].points[at], end.width_px));
            match nearest {
                Some(&(line, at)) => {
                    is_merged[line][at] = true;
                    middle = segments[line].points[at].v_px + end.middle[1];
                    n_clear = 0;
                }
                None if overlap => {}
                None => n_clear += 1,
            }
            if n_clear > CLEAR_COLUMNS {
                break;
            }
        }
    }
    let mut kept = Vec::new();
    for (segment, is_merged) in segments.into_iter().zip(is_merged) {
        let pairs: Vec<(CentrelinePoint, bool)> = segment.points.into_iter().zip(is_merged).collect();
        let runs = pairs.chunk_by(|a, b| a.1 == b.1).filter(|run| !run[0].1);
        let runs = runs.filter(|run| run.len() >= MIN_SEGMENT_COLUMNS || run.len() == pairs.len());
        kept.extend(runs.map(|run| Segment { points: run.iter().map(|(point, _)| *point).collect() }));
    }
    kept
}

fn is_wide(point: &CentrelinePoint, width_px: f64) -> bool {
    f64::from(point.width_px) > TOUCHING_MERGED_WIDTHS * width_px * point.normal[1].abs()
}
