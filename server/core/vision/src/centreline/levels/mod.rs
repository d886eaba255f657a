//! Search for lines wider than the others of their image, in the same image with binned rows.
//!
//! Averaging two, four, eight … rows into one makes a line half, a quarter, an eighth as wide and as steep, with still
//! one crossing per column. The same extraction therefore runs again while the lines found so far do not explain the
//! light, and each level covers its own band of line widths.

mod bins;
mod marks;
mod merging;
mod survey;
mod touching;

use super::fast::{self, Memory};
use super::view::{Level, View};
use super::{Centrelines, LineDirection, Segment};
use bins::{binned, unbin};
use marks::{Line, Place, as_line, as_lines, without};
use merging::merged;
use survey::{Survey, Surveyor};

/// Search for wide lines; its memory is reused from image to image.
#[derive(Default)]
pub struct Levels {
    memory: Memory<u16>,
    /// The image with binned rows, and with half as many rows binned.
    pixels: Vec<u16>,
    finer: Vec<u16>,
    coarse: Centrelines,
    surveyor: Surveyor,
}

impl Levels {
    /// Adds wider lines to `found`, the lines of `view` that `memory` has just found, and keeps one point per column
    /// and line.
    pub fn add_wide_lines<T: Level>(&mut self, view: &View<T>, memory: &Memory<T>, found: &mut Centrelines) {
        let base_px = memory.width_px();
        let Survey { duplicates, mut is_light_unexplained } =
            self.surveyor.survey_found(found, memory.strips(), base_px);
        if !is_light_unexplained {
            return remove_points(found, &duplicates);
        }
        let mut lines = without(as_lines(found, 1.0), duplicates);
        let mut correlation = Correlation::default();
        correlation.add(found.correlation_px, &lines);
        let (mut gain, mut rows) = (1.0, 1);
        while is_light_unexplained && fast::fits(view.width, view.height / (2 * rows)) {
            let full_scale = view.full_scale * gain;
            gain *= if rows == 1 {
                binned(view.pixels, view.width, full_scale, &mut self.pixels)
            } else {
                std::mem::swap(&mut self.pixels, &mut self.finer);
                binned(&self.finer, view.width, full_scale, &mut self.pixels)
            };
            rows *= 2;
            let (height, full_scale) = (view.height / rows, view.full_scale * gain);
            // The mean of several rows.
            let hidden_noise = view.hidden_noise * gain / (rows as f32).sqrt();
            let level = View { pixels: &self.pixels, width: view.width, height, full_scale, hidden_noise };
            self.memory.search_width(base_px);
            fast::extract_sixteen(&level, &mut self.memory, &mut self.coarse);
            let points = self.coarse.segments.iter_mut().flat_map(|line| &mut line.points);
            points.for_each(|point| unbin(point, rows, gain));
            let coarse = as_lines(&self.coarse, rows as f32);
            correlation.add(self.coarse.correlation_px, &coarse);
            lines = merged(lines, coarse, base_px, view);
            let survey = self.surveyor.survey_lines(&lines, self.memory.strips(), rows, base_px);
            is_light_unexplained = survey.is_light_unexplained;
        }
        found.correlation_px = correlation.mean_px().unwrap_or(found.correlation_px);
        found.segments = lines.into_iter().map(segment_of).collect();
        found.direction = LineDirection::Rows;
        sort(&mut found.segments);
    }
}

/// Removes some points, without touching the other lines.
fn remove_points(found: &mut Centrelines, removed: &[Place]) {
    if removed.is_empty() {
        return;
    }
    let mut affected: Vec<usize> = removed.iter().map(|(line, _)| *line).collect();
    affected.sort_unstable();
    affected.dedup();
    let removed: Vec<Place> =
        removed.iter().map(|(line, at)| (affected.partition_point(|other| other < line), *at)).collect();
    let lines = affected.iter().map(|&line| as_line(&std::mem::take(&mut found.segments[line]), 1.0)).collect();
    found.segments.retain(|segment| !segment.points.is_empty());
    found.segments.extend(without(lines, removed).into_iter().map(segment_of));
    sort(&mut found.segments);
}

fn segment_of(line: Line) -> Segment {
    Segment { points: line.iter().map(|mark| mark.point).collect() }
}

/// Orders segments by their first point: along the line, then across.
fn sort(segments: &mut [Segment]) {
    let first = |segment: &Segment| (segment.points[0].u_px, segment.points[0].v_px);
    segments.sort_by(|a, b| {
        let (a, b) = (first(a), first(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
}

/// The mean correlation length of the points of several levels.
#[derive(Default)]
struct Correlation {
    sum_px: f64,
    n: usize,
}

impl Correlation {
    fn add(&mut self, correlation_px: f64, lines: &[Line]) {
        let n: usize = lines.iter().map(Vec::len).sum();
        self.sum_px += correlation_px * n as f64;
        self.n += n;
    }

    fn mean_px(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum_px / self.n as f64)
    }
}
