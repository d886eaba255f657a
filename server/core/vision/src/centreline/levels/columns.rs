//! The points found, listed by column: whether they explain the light, and which of two detections of one line is kept.

use std::ops::Range;

use super::super::fast::Strip;
use super::super::{CentrelinePoint, Centrelines};
use super::marks::{Line, Mark, Place, Spot, kept, stitched, without};
use crate::params::{
    LEVEL_BAND, LEVEL_CLAIMED_FRACTION, LEVEL_FIRST_BAND, LEVEL_LEAST_LENGTH_WIDTHS, LEVEL_LEAST_LIGHT,
    LEVEL_LIT_PX, LEVEL_LIT_WIDTHS, LEVEL_NARROWEST, LEVEL_SURE, LEVEL_WIDEST_PX, MIN_SEGMENT_COLUMNS,
    STRIP_WIDTH_PX,
};

/// All marks by column; its memory is reused.
#[derive(Default)]
pub struct Columns {
    /// One column after the other.
    spots: Vec<Spot>,
    /// Index of the first spot of each column, and the number of all.
    starts: Vec<usize>,
    /// Row ranges of a strip with unexplained light, each with its rows summed over this and the preceding strips; then
    /// those of the strip before.
    left: Vec<(Range<usize>, f32)>,
    before: Vec<(Range<usize>, f32)>,
}

impl Columns {
    /// Lists the lines found in an image by column.
    pub fn index_found(&mut self, found: &Centrelines, width: usize) {
        self.index(found.segments.iter().map(|segment| segment.points.as_slice()), width, |point| (point, 1.0));
    }

    /// Lists the lines of several levels by column.
    pub fn index_lines(&mut self, lines: &[Line], width: usize) {
        self.index(lines.iter().map(Vec::as_slice), width, |mark| (&mark.point, mark.rows));
    }

    /// Lists lines, each a point per column, by column; `point` gives a point and the rows binned where it was found.
    fn index<'l, P: 'l>(
        &mut self,
        lines: impl Iterator<Item = &'l [P]> + Clone,
        width: usize,
        point: impl Fn(&P) -> (&CentrelinePoint, f32),
    ) {
        let starts = &mut self.starts;
        starts.clear();
        starts.resize(width + 2, 0);
        let column_of = |first: &P| point(first).0.u_px as usize;
        for line in lines.clone() {
            let Some(column) = line.first().map(column_of) else { continue };
            starts[column + 2..][..line.len()].iter_mut().for_each(|n_spots| *n_spots += 1);
        }
        let mut n_spots = 0;
        for start in &mut *starts {
            n_spots += *start;
            *start = n_spots;
        }
        self.spots.resize(n_spots, Spot::default());
        for (idx, line) in lines.enumerate() {
            let Some(column) = line.first().map(column_of) else { continue };
            // The next free place of each column, one further after its last spot: where the following column begins.
            for ((at, mark), next) in line.iter().enumerate().zip(&mut starts[column + 1..]) {
                let (point, rows) = point(mark);
                self.spots[*next] = Spot::of((idx, at), point, rows);
                *next += 1;
            }
        }
    }

    fn column(&self, column: usize) -> &[Spot] {
        &self.spots[self.starts[column]..self.starts[column + 1]]
    }

    /// Whether neighbouring strips hold enough unexplained light in the same rows: lit ranges higher than the lines in
    /// them. `rows`: image rows per row of the strips.
    pub fn has_unexplained_light(&mut self, strips: &[Strip], rows: usize, base_px: f32) -> bool {
        self.before.clear();
        // Cells make lit ranges higher than the light is.
        let narrow_px = (LEVEL_BAND * base_px + LEVEL_LIT_PX) * rows as f32;
        for strip in strips {
            self.left.clear();
            for lit in &strip.rows {
                let lit = lit.start * rows..lit.end * rows;
                if lit.len() as f32 <= narrow_px || self.is_explained(strip, &lit, rows as f32, base_px) {
                    continue;
                }
                let adjoining =
                    self.before.iter().filter(|(other, _)| other.start < lit.end && lit.start < other.end);
                let together_px = lit.len() as f32 + adjoining.map(|(_, px)| *px).fold(0.0, f32::max);
                if together_px >= LEVEL_LEAST_LIGHT * narrow_px {
                    return true;
                }
                self.left.push((lit, together_px));
            }
            std::mem::swap(&mut self.left, &mut self.before);
        }
        false
    }

    fn is_explained(&self, strip: &Strip, lit: &Range<usize>, rows: f32, base_px: f32) -> bool {
        let lit_px = lit.start as f32..lit.end as f32;
        let explained_px = |spot: &Spot| {
            LEVEL_LIT_WIDTHS * spot.width_px + spot.slope * STRIP_WIDTH_PX as f32 + LEVEL_LIT_PX * rows
        };
        // The image itself measures slightly wider lines as well as a level would, and every level costs time.
        let widest = if rows > 1.0 { LEVEL_BAND } else { LEVEL_FIRST_BAND };
        let is_explained = |column: &usize| {
            let spots = self.column(*column).iter();
            let own = spots.filter(|spot| lit_px.contains(&spot.v_px) && spot.fit(base_px) <= widest);
            own.map(explained_px).sum::<f32>() >= lit.len() as f32
        };
        let half = (strip.u1 - strip.u0).div_ceil(2);
        (strip.u0..strip.u1).filter(is_explained).take(half).count() == half
    }

    /// Marks of `found` that duplicate a mark of a longer line in their column.
    pub fn duplicates(&self, found: &Centrelines) -> Vec<Place> {
        let mut seconds = Vec::new();
        let n_points = |place: &Place| found.segments[place.0].points.len();
        for column in self.starts.windows(2).map(|ends| &self.spots[ends[0]..ends[1]]) {
            for (idx, spot) in column.iter().enumerate() {
                for other in column[..idx].iter().filter(|other| other.is_near(spot)) {
                    let (place, other) = (spot.place, other.place);
                    seconds.push(if n_points(&other) < n_points(&place) { other } else { place });
                }
            }
        }
        seconds
    }

    /// `lines`, found so far, merged with those of a coarser level; every crossing is kept once, from the level whose
    /// band contains its width. `single`: splits a coarse line into the parts that are a single line.
    pub fn merged(
        &self,
        lines: Vec<Line>,
        coarse: Vec<Line>,
        base_px: f32,
        single: impl Fn(Line) -> Vec<Line>,
    ) -> Vec<Line> {
        let mut removed = Vec::new();
        let mut added = Vec::new();
        let is_own =
            |mark: &Mark| mark.spot().fit(base_px) > LEVEL_NARROWEST && mark.point.width_px <= LEVEL_WIDEST_PX;
        for line in coarse.into_iter().flat_map(|line| kept(line, is_own)).flat_map(single) {
            let near = |mark: &Mark| -> Vec<&Spot> {
                let spot = mark.spot();
                self.column(mark.point.u_px as usize).iter().filter(|other| other.is_near(&spot)).collect()
            };
            let others: Vec<Vec<&Spot>> = line.iter().map(near).collect();
            let is_claimed = |others: &Vec<&Spot>| others.iter().any(|other| other.fit(base_px) <= LEVEL_SURE);
            let claimed: Vec<bool> = others.iter().map(is_claimed).collect();
            let n_claimed = claimed.iter().filter(|claimed| **claimed).count();
            if n_claimed as f32 > LEVEL_CLAIMED_FRACTION * line.len() as f32 {
                continue;
            }
            let beaten = others.iter().zip(&claimed).filter(|(_, claimed)| !**claimed);
            removed.extend(beaten.flat_map(|(others, _)| others.iter().map(|other| other.place)));
            let mut claimed = claimed.into_iter();
            added.extend(kept(line, |_| !claimed.next().expect("one per mark")));
        }
        let mut lines = without(lines, &removed);
        lines.extend(added);
        let mut lines = stitched(lines);
        lines.retain(|line| line.len() >= MIN_SEGMENT_COLUMNS && !is_glow(line));
        lines
    }
}

/// Whether a line detected at a coarser level is too short for its width: a glow, not a line.
fn is_glow(line: &Line) -> bool {
    let widths_px: f32 = line.iter().map(|mark| mark.point.width_px).sum();
    let n_columns = line.len() as f32;
    line.iter().any(|mark| mark.rows > 1.0) && n_columns * n_columns < LEVEL_LEAST_LENGTH_WIDTHS * widths_px
}
