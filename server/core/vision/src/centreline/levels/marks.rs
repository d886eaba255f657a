//! The lines of one or several levels, point by point.

use super::super::{CentrelinePoint, Centrelines};
use crate::params::{LEVEL_NEAR_WIDTHS, LEVEL_STITCH_WIDTHS};

/// A point and how many rows were averaged where it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// In the image.
    pub point: CentrelinePoint,
    /// Rows in one.
    pub rows: f32,
}

/// Marks of neighbouring columns.
pub type Line = Vec<Mark>;

/// A mark among lines: line, place in it.
pub type Place = (usize, usize);

impl Mark {
    /// Full width at half height along the column, px.
    pub fn width_px(&self) -> f32 {
        self.point.width_px / self.point.normal[1].abs().max(f64::from(f32::MIN_POSITIVE)) as f32
    }

    /// Its width as a share of that its level is made for.
    pub fn fit(&self, base_px: f32) -> f32 {
        self.width_px() / (base_px * self.rows)
    }

    /// Whether both, of one column, are looks at the same line.
    pub fn is_near(&self, other: &Self) -> bool {
        let apart_px = (self.point.v_px - other.point.v_px).abs() as f32;
        apart_px < LEVEL_NEAR_WIDTHS * self.width_px().max(other.width_px())
    }
}

/// The lines of a level.
pub fn as_lines(found: &Centrelines, rows: f32) -> Vec<Line> {
    let line = |points: &[CentrelinePoint]| points.iter().map(|&point| Mark { point, rows }).collect();
    found.segments.iter().map(|segment| line(&segment.points)).collect()
}

/// The lines without some marks, in pieces without gaps.
pub fn without(lines: Vec<Line>, gone: &[Place]) -> Vec<Line> {
    let mut is_gone: Vec<Vec<bool>> = lines.iter().map(|line| vec![false; line.len()]).collect();
    gone.iter().for_each(|&(line, at)| is_gone[line][at] = true);
    let pieces = lines.into_iter().zip(is_gone).flat_map(|(line, is_gone)| {
        let mut is_gone = is_gone.into_iter();
        kept(line, |_| !is_gone.next().expect("one per mark"))
    });
    pieces.collect()
}

/// What is kept of a line, in pieces without gaps.
pub fn kept(line: Line, mut is_kept: impl FnMut(&Mark) -> bool) -> Vec<Line> {
    let mut pieces = vec![Vec::new()];
    for mark in line {
        if is_kept(&mark) {
            pieces.last_mut().expect("there is one").push(mark);
        } else if pieces.last().is_some_and(|piece| !piece.is_empty()) {
            pieces.push(Vec::new());
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

/// Pieces of different levels that follow each other joined: a line that grows wider is one line.
pub fn stitched(mut lines: Vec<Line>) -> Vec<Line> {
    lines.sort_by(|a, b| {
        a[0].point.u_px.total_cmp(&b[0].point.u_px).then(a[0].point.v_px.total_cmp(&b[0].point.v_px))
    });
    let mut joined: Vec<Line> = Vec::new();
    for line in lines {
        let first = line[0];
        let follows = |other: &&mut Line| {
            let last = other[other.len() - 1];
            let slope = -(last.point.normal[0] / last.point.normal[1]);
            let apart_px = (first.point.v_px - last.point.v_px - slope).abs() as f32;
            last.rows != first.rows
                && first.point.u_px == last.point.u_px + 1.0
                && apart_px < LEVEL_STITCH_WIDTHS * first.width_px().max(last.width_px())
        };
        match joined.iter_mut().find(follows) {
            Some(before) => before.extend(line),
            None => joined.push(line),
        }
    }
    joined
}
