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
}

/// Marks of neighbouring columns.
pub type Line = Vec<Mark>;

/// Indices of a mark: line, position in it.
pub type Place = (usize, usize);

/// A mark along its column: where it is, and what light it explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Row.
    pub v_px: f32,
    /// Full width along the column as measured, area by the height of three rows, px.
    pub width_px: f32,
    /// Rows per column, absolute value.
    pub slope: f32,
    /// Rows binned into one.
    pub rows: f32,
}

impl Spot {
    /// Its width relative to the width its level searches for.
    pub fn fit(&self, base_px: f32) -> f32 {
        self.width_px / (base_px * self.rows)
    }

    /// Whether both, of one column, are detections of the same line.
    pub fn is_near(&self, other: &Self) -> bool {
        (self.v_px - other.v_px).abs() < LEVEL_NEAR_WIDTHS * self.width_px.max(other.width_px)
    }
}

/// The width of a point along its column, as its image of binned rows measured it (levels search for lines of that
/// width), and its slope, from its normal and its width across the line.
#[inline(always)]
pub fn along_column(normal: [f32; 2], width_px: f32, rows: f32) -> (f32, f32) {
    let per_across = 1.0 / normal[1].abs().max(f32::MIN_POSITIVE);
    let (width_px, slope) = (width_px * per_across, normal[0].abs() * per_across);
    ((width_px * width_px + LEVEL_MEASURED_PX2 * rows * rows).sqrt(), slope)
}

impl Mark {
    /// Full width at half height along the column, px.
    pub fn width_px(&self) -> f32 {
        self.spot().width_px
    }

    /// Along its column.
    pub fn spot(&self) -> Spot {
        let Self { point, rows } = self;
        let normal = point.normal.map(|component| component as f32);
        let (width_px, slope) = along_column(normal, point.width_px, *rows);
        Spot { v_px: point.v_px as f32, width_px, slope, rows: *rows }
    }
}

/// The lines of a level.
pub fn as_lines(found: &Centrelines, rows: f32) -> Vec<Line> {
    found.segments.iter().map(|segment| as_line(segment, rows)).collect()
}

/// A line of a level.
pub fn as_line(segment: &Segment, rows: f32) -> Line {
    segment.points.iter().map(|&point| Mark { point, rows }).collect()
}

/// The lines without some marks, split at the gaps.
pub fn without(lines: Vec<Line>, removed: &[Place]) -> Vec<Line> {
    let mut is_removed: Vec<Vec<bool>> = lines.iter().map(|line| vec![false; line.len()]).collect();
    removed.iter().for_each(|&(line, at)| is_removed[line][at] = true);
    let pieces = lines.into_iter().zip(is_removed).flat_map(|(line, is_removed)| {
        let mut is_removed = is_removed.into_iter();
        kept(line, |_| !is_removed.next().expect("one per mark"))
    });
    pieces.collect()
}

/// The marks of a line that are kept, split at the gaps.
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
                && apart_px < LEVEL_STITCH_WIDTHS * first.width_px().max(last.width_px())
        };
        match joined.iter_mut().find(follows) {
            Some(before) => before.extend(line),
            None => joined.push(line),
        }
    }
    joined
}
