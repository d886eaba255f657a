//! The lines found, strip by strip: whether they explain the light, and which of two detections of one line is kept.

use std::ops::Range;

use super::super::fast::Strip;
use super::super::{CentrelinePoint, Centrelines};
use super::marks::{Line, Place, along_column};
use crate::params::{
    LEVEL_BAND, LEVEL_FIRST_BAND, LEVEL_LEAST_LIGHT, LEVEL_LIT_PX, LEVEL_LIT_WIDTHS, LEVEL_NEAR_WIDTHS,
    STRIP_WIDTH_PX,
};

/// A number for every column of a strip.
type Lanes = [f32; STRIP_WIDTH_PX];

/// A line in the columns of one strip; rows are infinite in columns without it.
struct LineInStrip {
    idx: usize,
    /// Index of its point in the strip's first column, if it had one there.
    first: isize,
    v_px: Lanes,
    width_px: Lanes,
    /// Width relative to the width its level searches for.
    fit: Lanes,
    /// Rows that its light covers in the strip.
    lit_px: Lanes,
    /// Range of `v_px`.
    v_range_px: [f32; 2],
    widest_px: f32,
}

/// What the lines found leave to do.
#[derive(Default)]
pub struct Survey {
    /// Points that duplicate a point of a longer line in their column.
    pub duplicates: Vec<Place>,
    /// Whether neighbouring strips hold enough unexplained light in the same rows: lit ranges higher than the lines in
    /// them.
    pub is_light_unexplained: bool,
}

/// Surveys images; its memory is reused.
#[derive(Default)]
pub struct Surveyor {
    /// Columns of each line.
    columns: Vec<Range<usize>>,
    in_strip: Vec<LineInStrip>,
    /// Row ranges of a strip with unexplained light, each with its rows summed over this and the preceding strips; then
    /// those of the strip before.
    left: Vec<(Range<usize>, f32)>,
    before: Vec<(Range<usize>, f32)>,
}

impl Surveyor {
    /// Compares the lines found in an image with the light in its strips.
    pub fn survey_found(&mut self, found: &Centrelines, strips: &[Strip], base_px: f32) -> Survey {
        let lines = found.segments.iter().map(|segment| segment.points.as_slice());
        self.survey(lines, |point| (point, 1.0), strips, 1, base_px)
    }

    /// The same for the lines of several levels; `rows`: image rows per row of the strips.
    pub fn survey_lines(&mut self, lines: &[Line], strips: &[Strip], rows: usize, base_px: f32) -> Survey {
        self.survey(lines.iter().map(Vec::as_slice), |mark| (&mark.point, mark.rows), strips, rows, base_px)
    }

    /// `point` gives a point of a line and the rows binned where it was found.
    fn survey<'l, P: 'l>(
        &mut self,
        lines: impl Iterator<Item = &'l [P]> + Clone,
        point: impl Fn(&P) -> (&CentrelinePoint, f32),
        strips: &[Strip],
        rows: usize,
        base_px: f32,
    ) -> Survey {
        let first_of = |line: &[P]| line.first().map_or(0, |first| point(first).0.u_px as usize);
        self.columns.clear();
        self.columns.extend(lines.clone().map(|line| first_of(line)..first_of(line) + line.len()));
        self.before.clear();
        let mut survey = Survey::default();
        for strip in strips {
            self.in_strip.clear();
            for (idx, (points, columns)) in lines.clone().zip(&self.columns).enumerate() {
                if columns.start < strip.u1 && strip.u0 < columns.end {
                    self.in_strip.push(LineInStrip::of(idx, points, columns.start, &point, strip, base_px));
                }
            }
            self.add_duplicates(&mut survey.duplicates);
            survey.is_light_unexplained = survey.is_light_unexplained || self.is_light_left(strip, rows, base_px);
        }
        survey
    }

    fn add_duplicates(&self, duplicates: &mut Vec<Place>) {
        let n_points = |line: &LineInStrip| self.columns[line.idx].len();
        for (idx, line) in self.in_strip.iter().enumerate() {
            for other in &self.in_strip[..idx] {
                let shorter = if n_points(other) < n_points(line) { other } else { line };
                duplicates.extend(line.columns_near(other).map(|lane| shorter.place(lane)));
            }
        }
    }

    /// Whether this strip, together with those before, has enough unexplained light.
    fn is_light_left(&mut self, strip: &Strip, rows: usize, base_px: f32) -> bool {
        // Cells make lit ranges higher than the light is.
        let narrow_px = (LEVEL_BAND * base_px + LEVEL_LIT_PX) * rows as f32;
        self.left.clear();
        for lit in &strip.rows {
            let lit = lit.start * rows..lit.end * rows;
            if lit.len() as f32 <= narrow_px || self.is_explained(strip, &lit, rows as f32) {
                continue;
            }
            let adjoining = self.before.iter().filter(|(other, _)| other.start < lit.end && lit.start < other.end);
            let together_px = lit.len() as f32 + adjoining.map(|(_, px)| *px).fold(0.0, f32::max);
            if together_px >= LEVEL_LEAST_LIGHT * narrow_px {
                return true;
            }
            self.left.push((lit, together_px));
        }
        std::mem::swap(&mut self.left, &mut self.before);
        false
    }

    /// Whether in half of the columns the lines cover as many rows as are lit.
    fn is_explained(&self, strip: &Strip, lit: &Range<usize>, rows: f32) -> bool {
        let (from_px, to_px) = (lit.start as f32, lit.end as f32);
        // The image itself measures slightly wider lines as well as a level would, and every level costs time.
        let widest = if rows > 1.0 { LEVEL_BAND } else { LEVEL_FIRST_BAND };
        let mut explained_px = [0.0; STRIP_WIDTH_PX];
        let is_beside = |line: &&LineInStrip| line.v_range_px[0] < to_px && from_px <= line.v_range_px[1];
        for line in self.in_strip.iter().filter(is_beside) {
            let (v_px, fit, lit_px) = (&line.v_px, &line.fit, &line.lit_px);
            for lane in 0..STRIP_WIDTH_PX {
                let is_own = (from_px <= v_px[lane]) & (v_px[lane] < to_px) & (fit[lane] <= widest);
                explained_px[lane] += if is_own { lit_px[lane] + LEVEL_LIT_PX * rows } else { 0.0 };
            }
        }
        let n_explained = explained_px.iter().filter(|px| **px >= lit.len() as f32).count();
        n_explained >= (strip.u1 - strip.u0).div_ceil(2)
    }
}

impl LineInStrip {
    /// The part in a strip of a line that begins in column `first_u`.
    fn of<P>(
        idx: usize,
        points: &[P],
        first_u: usize,
        point: impl Fn(&P) -> (&CentrelinePoint, f32),
        strip: &Strip,
        base_px: f32,
    ) -> Self {
        let first = strip.u0 as isize - first_u as isize;
        let (skipped, begin) = (first.min(0).unsigned_abs(), first.max(0) as usize);
        let here = &points[begin..points.len().min(begin + (strip.u1 - strip.u0) - skipped)];
        let mut v_px = [f32::INFINITY; STRIP_WIDTH_PX];
        let [mut along, mut width_px, mut fit, mut lit_px] = [[0.0f32; STRIP_WIDTH_PX]; 4];
        let [mut across, mut binned] = [[1.0f32; STRIP_WIDTH_PX]; 2];
        for (lane, here) in (skipped..).zip(here) {
            let (point, rows) = point(here);
            v_px[lane] = point.v_px as f32;
            (along[lane], across[lane]) = (point.normal[0] as f32, point.normal[1] as f32);
            (width_px[lane], binned[lane]) = (point.width_px, rows);
        }
        for lane in 0..STRIP_WIDTH_PX {
            let (width, slope) = along_column([along[lane], across[lane]], width_px[lane], binned[lane]);
            width_px[lane] = width;
            fit[lane] = width / (base_px * binned[lane]);
            lit_px[lane] = LEVEL_LIT_WIDTHS * width + slope * STRIP_WIDTH_PX as f32;
        }
        let lower = |a: f32, b: f32| if b < a { b } else { a };
        let higher = |a: f32, b: f32| if b > a { b } else { a };
        let highest_px = reduced(v_px.map(|v_px| if v_px.is_finite() { v_px } else { f32::NEG_INFINITY }), higher);
        let (v_range_px, widest_px) = ([reduced(v_px, lower), highest_px], reduced(width_px, higher));
        Self { idx, first, v_px, width_px, fit, lit_px, v_range_px, widest_px }
    }

    /// Its point in a column of the strip.
    fn place(&self, lane: usize) -> Place {
        (self.idx, (self.first + lane as isize) as usize)
    }

    /// The columns in which it and another line are detections of the same line.
    fn columns_near(&self, other: &Self) -> impl Iterator<Item = usize> {
        let reach_px = LEVEL_NEAR_WIDTHS * self.widest_px.max(other.widest_px);
        let apart_px = (self.v_range_px[0] - other.v_range_px[1]).max(other.v_range_px[0] - self.v_range_px[1]);
        let some = if apart_px < reach_px { STRIP_WIDTH_PX } else { 0 };
        (0..some).filter(|&lane| {
            let width_px = self.width_px[lane].max(other.width_px[lane]);
            (self.v_px[lane] - other.v_px[lane]).abs() < LEVEL_NEAR_WIDTHS * width_px
        })
    }
}

/// One number from those of all columns, half with half: in a chain each step waits for the one before.
#[inline(always)]
fn reduced(mut lanes: Lanes, pick: impl Fn(f32, f32) -> f32) -> f32 {
    let mut n = STRIP_WIDTH_PX;
    while n > 1 {
        n /= 2;
        for lane in 0..n {
            lanes[lane] = pick(lanes[lane], lanes[lane + n]);
        }
    }
    lanes[0]
}
