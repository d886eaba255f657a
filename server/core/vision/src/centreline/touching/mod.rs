//! Lines so close to each other that the search merges or misses them: fitted together.
//!
//! Their courses come from maxima of the light that no line found so far explains, and from wide lines whose profile
//! has two maxima. Neighbouring courses are fitted together, first in blocks of four columns, which gives their common
//! width, then column by column, with the noise of each crossing; the averaging along the line is that of all lines.

mod courses;
mod fit;
mod group;
mod merged;
mod peaks;

use std::ops::Range;

use super::fast::{self, Memory, Strip, Touching};
use super::view::{Level, View};
use super::{CentrelinePoint, Centrelines, Segment};
use crate::params::{
    LEVEL_NEAR_WIDTHS, MIN_SEGMENT_COLUMNS, TOUCHING_BLOCK_COLUMNS as BLOCK, TOUCHING_CLOSEST_WIDTHS,
    TOUCHING_CONTINUED_BLOCKS, TOUCHING_COURSE_BLOCKS, TOUCHING_NEIGHBOUR_WIDTHS, TOUCHING_TOGETHER_WIDTHS,
};
pub use courses::Course;
use courses::courses;
use group::{Group, Picture};
use merged::{End, without_merged};

/// Adds lines that touch others to `found`. `unexplained`: rows, by strip, with light that the lines found do not
/// explain; `split`: the two courses of every wide line whose profile has two maxima.
pub fn add_touching_lines<T: Level>(
    view: &View<T>,
    memory: &Memory<T>,
    unexplained: &[(usize, Range<usize>)],
    split: Vec<Course>,
    found: &mut Centrelines,
) {
    let width_px = f64::from(memory.width_px());
    let near = near_each_other(&found.segments, TOUCHING_NEIGHBOUR_WIDTHS * width_px);
    if unexplained.is_empty() && split.is_empty() && near.is_empty() {
        return;
    }
    let strips: &[Strip] = memory.strips();
    let of_light = courses(view, memory.noise(), strips, unexplained, memory.width_px());
    let mut all: Vec<Course> = Vec::new();
    for course in split.into_iter().chain(of_light).chain(near) {
        // Of several courses of one line, what the earlier ones do not cover.
        let new = course.without(|block, v| {
            all.iter().any(|other| other.at(block).is_some_and(|other| (other - v).abs() < 0.6 * width_px))
        });
        all.extend(new);
    }
    let all = continued(all, width_px);
    let picture = Picture { view, noise: memory.noise(), width_px };
    let fitted: Vec<Group> = groups(&all, TOUCHING_TOGETHER_WIDTHS * width_px)
        .into_iter()
        .filter(|group| group.len() > 1)
        .map(|group| Group::fitted(&picture, &group))
        .collect();
    let pieces = single(fitted.iter().flat_map(|group| group.crossings(&picture)).collect(), width_px);
    if pieces.is_empty() {
        return;
    }
    let (segments, correlation_px) = fast::averaged(&pieces, memory.width_px());
    if found.segments.is_empty() {
        found.correlation_px = correlation_px;
    }
    let ends: Vec<End> = fitted.iter().flat_map(Group::ends).collect();
    replace(found, segments, &ends, view.width);
}

/// The courses of lines found separately that are close to each other, where they are.
fn near_each_other(segments: &[Segment], near_px: f64) -> Vec<Course> {
    let span = |segment: &Segment| {
        let first = segment.points[0].u_px as usize;
        first..first + segment.points.len()
    };
    let mut is_near: Vec<Vec<bool>> = vec![Vec::new(); segments.len()];
    for (a, upper) in segments.iter().enumerate() {
        for (b, lower) in segments.iter().enumerate().skip(a + 1) {
            let (of_a, of_b) = (span(upper), span(lower));
            let both = of_a.start.max(of_b.start)..of_a.end.min(of_b.end);
            let is_close =
                |u: usize| (upper.points[u - of_a.start].v_px - lower.points[u - of_b.start].v_px).abs() < near_px;
            for block in both.start.div_ceil(BLOCK)..both.end / BLOCK {
                if is_close(block * BLOCK) {
                    for (line, of_line) in [(a, &of_a), (b, &of_b)] {
                        is_near[line].resize(segments[line].points.len() / BLOCK + 1, false);
                        is_near[line][block - of_line.start.div_ceil(BLOCK)] = true;
                    }
                }
            }
        }
    }
    let of_line = |(segment, is_near): (&Segment, Vec<bool>)| {
        let rows: Vec<f64> = segment.points.iter().map(|point| point.v_px).collect();
        let [course, _] = beside(span(segment).start, &rows, [0.0; 2]);
        let first = course.first;
        course.without(|block, _| !is_near.get(block - first).is_some_and(|&near| near))
    };
    segments.iter().zip(is_near).filter(|(_, is_near)| !is_near.is_empty()).flat_map(of_line).collect()
}

/// Courses joined that continue each other.
fn continued(mut courses: Vec<Course>, width_px: f64) -> Vec<Course> {
    courses.sort_by_key(|course| course.first);
    let mut whole: Vec<Course> = Vec::new();
    for course in courses {
        let miss = |before: &Course| {
            let gap = (course.first + 1).checked_sub(before.blocks().end)?;
            let last = before.v[before.v.len() - 1];
            let expected = last + before.slope_at(before.blocks().end - 1) * gap as f64;
            let miss = (course.v[0] - expected).abs();
            (gap > 0 && gap <= TOUCHING_CONTINUED_BLOCKS && miss < 0.5 * width_px).then_some(miss)
        };
        let nearest = whole.iter_mut().filter_map(|before| Some((miss(before)?, before)));
        match nearest.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, before)) => before.append(&course),
            None => whole.push(course),
        }
    }
    whole
}

/// Courses near each other over enough blocks, group by group.
fn groups(courses: &[Course], near_px: f64) -> Vec<Vec<Course>> {
    let mut group_of: Vec<usize> = (0..courses.len()).collect();
    for a in 0..courses.len() {
        for b in 0..a {
            if courses[a].n_near(&courses[b], near_px) >= TOUCHING_COURSE_BLOCKS {
                let (from, to) = (group_of[a], group_of[b]);
                group_of.iter_mut().filter(|group| **group == from).for_each(|group| *group = to);
            }
        }
    }
    let of = |group: usize| {
        let own = courses.iter().zip(&group_of).filter(|(_, of)| **of == group);
        own.map(|(course, _)| course.clone()).collect()
    };
    (0..courses.len()).map(of).collect()
}

/// Pieces without the columns in which a longer one is at the same place.
fn single(mut pieces: Vec<Touching>, width_px: f64) -> Vec<Touching> {
    pieces.sort_by_key(|piece| std::cmp::Reverse(piece.crossings.len()));
    let mut kept: Vec<Touching> = Vec::new();
    for piece in pieces {
        let is_new = |k: &usize| {
            let (u, v) = (piece.first_u + k, piece.crossings[*k].v);
            let at =
                |other: &Touching| other.crossings.get(u.checked_sub(other.first_u)?).map(|crossing| crossing.v);
            !kept.iter().filter_map(at).any(|other| (other - v).abs() < TOUCHING_CLOSEST_WIDTHS * width_px)
        };
        let new: Vec<usize> = (0..piece.crossings.len()).filter(is_new).collect();
        let runs = new.chunk_by(|a, b| a + 1 == *b).filter(|run| run.len() >= MIN_SEGMENT_COLUMNS);
        let parts: Vec<Touching> = runs.map(|run| piece.part(run[0]..run[run.len() - 1] + 1)).collect();
        kept.extend(parts);
    }
    kept
}

/// Adds `segments` to those found, and removes the points found at or between them and beyond their `ends`.
fn replace(found: &mut Centrelines, segments: Vec<Vec<CentrelinePoint>>, ends: &[End], width: usize) {
    let mut rows: Vec<Vec<[f32; 2]>> = vec![Vec::new(); width];
    for point in segments.iter().flatten() {
        rows[point.u_px as usize].push([point.v_px as f32, point.width_px / point.normal[1].abs() as f32]);
    }
    rows.iter_mut().for_each(|rows| rows.sort_by(|a, b| a[0].total_cmp(&b[0])));
    let is_replaced = |point: &CentrelinePoint| {
        let (rows, v) = (&rows[point.u_px as usize], point.v_px as f32);
        let is_between = |pair: &[[f32; 2]]| {
            let [[a, width_px], [b, _]] = [pair[0], pair[1]];
            (a..b).contains(&v) && b - a < TOUCHING_TOGETHER_WIDTHS as f32 * width_px
        };
        rows.iter().any(|[row, width_px]| (row - v).abs() < LEVEL_NEAR_WIDTHS * width_px)
            || rows.windows(2).any(is_between)
    };
    let old = std::mem::take(&mut found.segments);
    for segment in old {
        let runs = segment.points.chunk_by(|a, b| is_replaced(a) == is_replaced(b));
        let kept = runs.filter(|run| !is_replaced(&run[0]) && run.len() >= MIN_SEGMENT_COLUMNS);
        found.segments.extend(kept.map(|run| Segment { points: run.to_vec() }));
    }
    found.segments = without_merged(std::mem::take(&mut found.segments), ends, width);
    found.segments.extend(segments.into_iter().map(|points| Segment { points }));
    joined(&mut found.segments);
}

/// Joins segments that continue each other, and sorts them.
fn joined(segments: &mut Vec<Segment>) {
    let by_first = |a: &Segment, b: &Segment| {
        let (a, b) = (&a.points[0], &b.points[0]);
        a.u_px.total_cmp(&b.u_px).then(a.v_px.total_cmp(&b.v_px))
    };
    segments.sort_by(by_first);
    let mut whole: Vec<Segment> = Vec::new();
    for segment in segments.drain(..) {
        let first = segment.points[0];
        let goes_on = |before: &&mut Segment| {
            let last = before.points[before.points.len() - 1];
            let expected = last.v_px - last.normal[0] / last.normal[1];
            let apart_px = (first.v_px - expected).abs() as f32;
            last.u_px + 1.0 == first.u_px && apart_px < 0.3 * first.width_px.max(last.width_px).max(3.0)
        };
        match whole.iter_mut().find(goes_on) {
            Some(before) => before.points.extend(segment.points),
            None => whole.push(segment),
        }
    }
    *segments = whole;
}

/// Two courses beside a line, `offsets` rows from it; `rows` are those of its columns from `first_u` on.
pub fn beside(first_u: usize, rows: &[f64], offsets: [f64; 2]) -> [Course; 2] {
    let first = first_u.div_ceil(BLOCK);
    let skipped = first * BLOCK - first_u;
    let middles: Vec<f64> = rows[skipped.min(rows.len())..]
        .chunks_exact(BLOCK)
        .map(|rows| rows.iter().sum::<f64>() / BLOCK as f64)
        .collect();
    offsets.map(|offset| Course { first, v: middles.iter().map(|v| v + offset).collect(), is_separate: true })
}
