//! Approximate courses of lines so close to each other that the search merges or misses them: maxima of the light in
//! blocks of four columns, linked along the lines.

use std::ops::Range;

use super::peaks::peaks;
use crate::centreline::fast::Strip;
use crate::centreline::lines::noise::NoiseMap;
use crate::centreline::view::{Level, View};
use crate::params::{
    LINK_HEADING_COLUMNS, TOUCHING_BLOCK_COLUMNS as BLOCK, TOUCHING_COURSE_BLOCKS, TOUCHING_COURSE_DIP,
    TOUCHING_COURSE_GAP_BLOCKS, TOUCHING_COURSE_GATE_WIDTHS, TOUCHING_COURSE_SMOOTH_WIDTHS, TOUCHING_COURSE_SNR,
    TOUCHING_WINDOW_WIDTHS,
};

/// Rows of a line at the middles of consecutive blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// First block.
    pub first: usize,
    /// Row in each block.
    pub v: Vec<f64>,
    /// Whether the minimum beside it has been found significant over all of its columns.
    pub is_separate: bool,
}

impl Course {
    /// Blocks.
    pub fn blocks(&self) -> Range<usize> {
        self.first..self.first + self.v.len()
    }

    /// Row in a block, if it lies within the course.
    pub fn at(&self, block: usize) -> Option<f64> {
        self.v.get(block.checked_sub(self.first)?).copied()
    }

    /// Rows per block over the blocks around one.
    pub fn slope_at(&self, block: usize) -> f64 {
        const REACH: usize = 3;
        let from = block.saturating_sub(REACH).max(self.first);
        let to = (block + REACH).min(self.first + self.v.len() - 1);
        match (self.at(from), self.at(to)) {
            (Some(a), Some(b)) if to > from => (b - a) / (to - from) as f64,
            _ => 0.0,
        }
    }

    /// The parts, long enough for a course, whose blocks and rows are not `removed`.
    pub fn without(&self, removed: impl Fn(usize, f64) -> bool) -> Vec<Self> {
        let kept: Vec<usize> =
            self.blocks().filter(|&block| !removed(block, self.v[block - self.first])).collect();
        let runs = kept.chunk_by(|a, b| a + 1 == *b).filter(|run| run.len() >= TOUCHING_COURSE_BLOCKS);
        let part = |run: &[usize]| {
            let v = self.v[run[0] - self.first..][..run.len()].to_vec();
            Self { first: run[0], v, is_separate: self.is_separate }
        };
        runs.map(part).collect()
    }

    /// Continues with a later course; blocks between them are interpolated.
    pub fn append(&mut self, later: &Self) {
        let (last, next) = (self.v[self.v.len() - 1], later.v[0]);
        let n = later.first - self.blocks().end;
        let step = (next - last) / (n + 1) as f64;
        self.v.extend((1..=n).map(|k| last + step * k as f64));
        self.v.extend(&later.v);
        self.is_separate &= later.is_separate;
    }

    /// Number of blocks in which another course is nearer than `px`.
    pub fn n_near(&self, other: &Self, px: f64) -> usize {
        let near = |block: &usize| self.at(*block).zip(other.at(*block)).is_some_and(|(a, b)| (a - b).abs() < px);
        self.blocks().filter(near).count()
    }
}

/// A course that may still grow.
struct Open {
    course: Course,
    heading: f64,
    n_seen: usize,
}

impl Open {
    fn expected(&self, block: usize) -> f64 {
        let last = self.course.first + self.course.v.len() - 1;
        self.course.v[self.course.v.len() - 1] + self.heading * (block - last) as f64
    }

    fn grow(&mut self, block: usize, v: f64) {
        let last_v = self.course.v[self.course.v.len() - 1];
        let n = block + 1 - (self.course.first + self.course.v.len());
        let slope = (v - last_v) / (n + 1) as f64;
        self.course.v.extend((1..=n).map(|k| last_v + slope * k as f64));
        self.course.v.push(v);
        self.n_seen += 1;
        let n_steps = (self.course.v.len() - 1).clamp(1, LINK_HEADING_COLUMNS);
        self.heading += (slope - self.heading) / n_steps as f64;
    }
}

/// Courses in strips with unexplained light, given as (strip, rows) in order.
pub fn courses<T: Level>(
    view: &View<T>,
    noise: &NoiseMap,
    strips: &[Strip],
    unexplained: &[(usize, Range<usize>)],
    width_px: f32,
) -> Vec<Course> {
    let gate = f64::from((TOUCHING_COURSE_GATE_WIDTHS * width_px).max(2.0));
    let (mut open, mut done): (Vec<Open>, Vec<Open>) = (Vec::new(), Vec::new());
    for ranges in unexplained.chunk_by(|a, b| a.0 == b.0) {
        let strip = &strips[ranges[0].0];
        for u0 in (strip.u0..strip.u1).step_by(BLOCK).filter(|u0| u0 + BLOCK <= strip.u1) {
            let block = u0 / BLOCK;
            let nodes: Vec<f64> =
                ranges.iter().flat_map(|(_, rows)| nodes(view, noise, u0, rows, width_px)).collect();
            let is_stale =
                |open: &Open| open.course.first + open.course.v.len() + TOUCHING_COURSE_GAP_BLOCKS < block;
            done.extend(open.extract_if(.., |open| is_stale(open)));
            link(&mut open, &nodes, block, gate);
        }
    }
    done.append(&mut open);
    done.retain(|open| {
        open.course.v.len() >= TOUCHING_COURSE_BLOCKS && 3 * open.n_seen >= 2 * open.course.v.len()
    });
    done.into_iter().map(|open| open.course).collect()
}

/// Continues the nearest courses; the other nodes begin new ones.
fn link(open: &mut Vec<Open>, nodes: &[f64], block: usize, gate: f64) {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (course, one) in open.iter().enumerate() {
        let expected = one.expected(block);
        for (node, v) in nodes.iter().enumerate() {
            let miss = (v - expected).abs();
            if miss < gate {
                pairs.push((miss, course, node));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut is_taken, mut is_grown) = (vec![false; nodes.len()], vec![false; open.len()]);
    for (_, course, node) in pairs {
        if !is_taken[node] && !is_grown[course] {
            (is_taken[node], is_grown[course]) = (true, true);
            open[course].grow(block, nodes[node]);
        }
    }
    let first = nodes.iter().zip(is_taken).filter(|(_, taken)| !taken);
    open.extend(first.map(|(&v, _)| Open {
        course: Course { first: block, v: vec![v], is_separate: false },
        heading: 0.0,
        n_seen: 1,
    }));
}

/// Rows of the maxima in the block of columns that begins at `u0`.
fn nodes<T: Level>(view: &View<T>, noise: &NoiseMap, u0: usize, lit: &Range<usize>, width_px: f32) -> Vec<f64> {
    let margin = (TOUCHING_WINDOW_WIDTHS as f32 * width_px).ceil() as usize;
    let window = lit.start.saturating_sub(margin)..(lit.end + margin).min(view.height);
    let mean = |v: usize| view.row(v)[u0..u0 + BLOCK].iter().map(|level| level.grey()).sum::<f32>() / BLOCK as f32;
    let profile: Vec<f32> = window.clone().map(mean).collect();
    let reach = (TOUCHING_COURSE_SMOOTH_WIDTHS * width_px) as usize;
    let (smooth, per_noise) = smoothed(&profile, reach);
    let floor = smooth.iter().copied().fold(f32::INFINITY, f32::min);
    let sigma = noise.at(u0, (lit.start + lit.end) / 2) * per_noise / (BLOCK as f32).sqrt();
    let tops = peaks(&smooth, floor, TOUCHING_COURSE_SNR * sigma, TOUCHING_COURSE_DIP);
    let inside =
        tops.into_iter().filter(|&top| top > 0 && top + 1 < smooth.len() && lit.contains(&(window.start + top)));
    inside.map(|top| (window.start + top) as f64 + vertex(&smooth[top - 1..top + 2])).collect()
}

/// A triangular mean over `reach` rows on either side, and the noise it leaves.
fn smoothed(profile: &[f32], reach: usize) -> (Vec<f32>, f32) {
    let weights: Vec<f32> = (0..=2 * reach).map(|k| (reach + 1 - k.abs_diff(reach)) as f32).collect();
    let sum: f32 = weights.iter().sum();
    let at = |middle: usize| {
        let level = |k: usize| profile[(middle + k).saturating_sub(reach).min(profile.len() - 1)];
        weights.iter().enumerate().map(|(k, weight)| weight * level(k)).sum::<f32>() / sum
    };
    let squares: f32 = weights.iter().map(|weight| weight * weight).sum();
    ((0..profile.len()).map(at).collect(), squares.sqrt() / sum)
}

/// Position of the maximum of a parabola through three levels, relative to the middle one.
fn vertex(three: &[f32]) -> f64 {
    let (a, b, c) = (three[0], three[1], three[2]);
    let bend = a - 2.0 * b + c;
    if bend < 0.0 { f64::from((0.5 * (a - c) / bend).clamp(-0.5, 0.5)) } else { 0.0 }
}
