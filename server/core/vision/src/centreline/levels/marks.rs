//! The lines of one or several levels, point by point.

use super::super::{CentrelinePoint, Centrelines, Segment};
use crate::params::{LEVEL_MEASURED_PX2, LEVEL_NEAR_WIDTHS, LEVEL_STITCH_WIDTHS};

/// A point, with the number of rows binned where it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// In the image.
    pub point: CentrelinePoint,
    /// Rows binned into one.
    pub rows: f32,
    /// Full width along the column as measured, area by the height of three rows, px.
    pub width_px: f32,
}

/// Marks of neighbouring columns.
pub type Line = Vec<Mark>;

/// Indices of a mark: line, position in it.
pub type Place = (usize, usize);

/// The width of a point along its column, as its image of binned rows measured it (levels search for lines of that
/// width), and its slope, from its normal and its width across the line.
#[inline(always)]
pub fn along_column(normal: [f32; 2], width_px: f32, rows: f32) -> (f32, f32) {
    let per_across = 1.0 / normal[1].abs().max(f32::MIN_POSITIVE);
    let (width_px, slope) = (width_px * per_across, normal[0].abs() * per_across);
    ((width_px * width_px + LEVEL_MEASURED_PX2 * rows * rows).sqrt(), slope)
}

impl Mark {
    /// A point found in an image with `rows` rows binned into one.
    pub fn of(point: CentrelinePoint, rows: f32) -> Self {
        let (width_px, _) = along_column(point.normal.map(|component| component as f32), point.width_px, rows);
        Self { point, rows, width_px }
    }

    /// Its width relative to the width its level searches for.
    pub fn fit(&self, base_px: f32) -> f32 {
        self.width_px / (base_px * self.rows)
    }

    /// Whether both, of one column, are detections of the same line.
    pub fn is_near(&self, other: &Self) -> bool {
        let apart_px = (self.point.v_px as f32 - other.point.v_px as f32).abs();
        apart_px < LEVEL_NEAR_WIDTHS * self.width_px.max(other.width_px)
    }
}

/// The lines of a level.
pub fn as_lines(found: &Centrelines, rows: f32) -> Vec<Line> {
    found.segments.iter().map(|segment| as_line(segment, rows)).collect()
}

/// A line of a level.
pub fn as_line(segment: &Segment, rows: f32) -> Line {
    segment.points.iter().map(|&point| Mark::of(point, rows)).collect()
}

/// The lines without some marks, split at the gaps.
pub fn without(lines: Vec<Line>, mut removed: Vec<Place>) -> Vec<Line> {
    removed.sort_unstable();
    let mut removed = removed.into_iter().peekable();
    let of_line = |(line, marks): (usize, Line)| {
        let mut at = 0;
        kept(marks, |_| {
            let is_removed = removed.peek() == Some(&(line, at));
            while removed.next_if_eq(&(line, at)).is_some() {}
            at += 1;
            !is_removed
        })
    };
    lines.into_iter().enumerate().flat_map(of_line).collect()
}

/// The marks of a line that are kept, split at the gaps.
pub fn kept(line: Line, mut is_kept: impl FnMut(&Mark) -> bool) -> Vec<Line> {
    let n_whole = line.iter().take_while(|mark| is_kept(mark)).count();
    if n_whole == line.len() {
        return if line.is_empty() { Vec::new() } else { vec![line] };
    }
    let mut pieces = vec![line[..n_whole].to_vec(), Vec::new()];
    for &mark in &line[n_whole + 1..] {
        if is_kept(&mark) {
            pieces.last_mut().expect("there is one").push(mark);
        } else if pieces.last().is_some_and(|piece| !piece.is_empty()) {
            pieces.push(Vec::new());
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

/// Joins pieces of different levels that follow each other: a line that grows wider is one line.
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
                && apart_px < LEVEL_STITCH_WIDTHS * first.width_px.max(last.width_px)
        };
        match joined.iter_mut().find(follows) {
            Some(before) => before.extend(line),
            None => joined.push(line),
        }
    }
    joined
}
