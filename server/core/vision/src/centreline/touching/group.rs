//! Neighbouring courses fitted together, block by block and then column by column.

use std::ops::Range;

use super::courses::Course;
use super::fit::{Across, Member, Together};
use super::merged::End;
use crate::centreline::fast::Touching;
use crate::centreline::lines::crossing::Crossing;
use crate::centreline::lines::noise::NoiseMap;
use crate::centreline::lines::parabola::parabola;
use crate::centreline::lines::taps::WIDTH_PER_SIGMA;
use crate::centreline::view::{Level, View};
use crate::params::{
    LEVEL_MEASURED_PX2, MIN_SEGMENT_COLUMNS, TOUCHING_ASTRAY_WIDTHS, TOUCHING_BLOCK_COLUMNS as BLOCK,
    TOUCHING_CLOSEST_WIDTHS, TOUCHING_CONTINUED_BLOCKS, TOUCHING_COURSE_BLOCKS, TOUCHING_COURSE_GAP_BLOCKS,
    TOUCHING_COURSE_MEAN_DIP, TOUCHING_DIP_BLOCKS, TOUCHING_ENDS_WIDTHS, TOUCHING_LEAST_HEIGHT, TOUCHING_SIGMAS,
    TOUCHING_SMOOTH_BLOCKS, TOUCHING_WIDTH_RATIOS, TOUCHING_WINDOW_WIDTHS,
};

const PER_SIGMA: f64 = WIDTH_PER_SIGMA as f64;

/// The image in which lines are fitted.
pub struct Picture<'a, T> {
    pub view: &'a View<'a, T>,
    pub noise: &'a NoiseMap,
    /// Typical full width of the lines at half height.
    pub width_px: f64,
}

/// One line in one block.
#[derive(Debug, Clone, Copy)]
struct Node {
    v: f64,
    height: f64,
    sigma_px: f64,
}

/// Levels from one line to the next.
const DIP_LEVELS: usize = 11;

/// The light between two neighbouring lines in one block.
struct Dip {
    levels: [f64; DIP_LEVELS],
    /// Height of the lower line above the background.
    height: f64,
}

/// Whether the mean over some blocks has a minimum, deep enough and significant against the scatter of the blocks.
fn is_significant<'a>(dips: impl Iterator<Item = &'a Dip> + Clone) -> bool {
    let n = dips.clone().count() as f64;
    if n < TOUCHING_COURSE_BLOCKS as f64 {
        return false;
    }
    let mean = |k: usize| dips.clone().map(|dip| dip.levels[k]).sum::<f64>() / n;
    let inner = 2..DIP_LEVELS - 2;
    let Some(valley) = inner.min_by(|&a, &b| mean(a).total_cmp(&mean(b))) else { return false };
    let height = dips.clone().map(|dip| dip.height).sum::<f64>() / n;
    [0, DIP_LEVELS - 1].into_iter().all(|top| {
        let depths = dips.clone().map(|dip| dip.levels[top] - dip.levels[valley]);
        let depth = mean(top) - mean(valley);
        let variance = depths.map(|of_block| (of_block - depth).powi(2)).sum::<f64>() / (n - 1.0);
        depth > TOUCHING_COURSE_MEAN_DIP * height && depth > f64::from(TOUCHING_SIGMAS) * (variance / n).sqrt()
    })
}

/// Lines beside each other; `None` where a line was not found.
pub struct Group {
    first: usize,
    /// By line, then by block.
    nodes: Vec<Vec<Option<Node>>>,
}

impl<T: Level> Picture<'_, T> {
    /// Mean grey levels of the columns of a block, moved along a slope, around some rows. `None` beyond the image.
    fn across(&self, columns: Range<usize>, slope: f64, rows: [f64; 2]) -> Option<(f64, Vec<f64>, Vec<bool>)> {
        let (from, to) = (rows[0].floor(), rows[1].ceil());
        let shift = |u: usize| (slope * (u as f64 - 0.5 * (columns.start + columns.end - 1) as f64)).round();
        let steepest = shift(columns.start).abs().max(shift(columns.end - 1).abs());
        if from - steepest < 0.0 || to + steepest >= self.view.height as f64 || columns.end > self.view.width {
            return None;
        }
        let n = columns.len() as f64;
        let (mut levels, mut is_used) =
            (vec![0.0; (to - from) as usize + 1], vec![true; (to - from) as usize + 1]);
        for u in columns.clone() {
            let first = (from + shift(u)) as usize;
            for (k, level) in levels.iter_mut().enumerate() {
                let grey = self.view.grey(u, first + k);
                *level += f64::from(grey) / n;
                is_used[k] &= grey < self.view.full_scale;
            }
        }
        Some((from, levels, is_used))
    }

    /// Fits the lines near `expected` (row by line) in one block; the width is fitted as well unless it is given.
    fn block(
        &self,
        block: usize,
        expected: &[f64],
        slope: f64,
        sigma_px: f64,
        with_width: bool,
    ) -> Option<Together> {
        let reach = TOUCHING_WINDOW_WIDTHS * PER_SIGMA * sigma_px;
        let rows = [expected[0] - reach, expected[expected.len() - 1] + reach];
        let (first_row, levels, is_used) = self.across(block * BLOCK..(block + 1) * BLOCK, slope, rows)?;
        let across = Across { first_row, levels: &levels, is_used: &is_used };
        let members = expected.iter().map(|&v| Member { v, height: 1.0 }).collect();
        let fitted = Together { members, sigma_px }.fitted(&across, with_width)?;
        let width_px = PER_SIGMA * fitted.sigma_px;
        let highest = fitted.members.iter().map(|member| member.height).fold(0.0, f64::max);
        let noise = f64::from(self.noise.at(block * BLOCK, expected[0] as usize));
        let is_usual = (TOUCHING_WIDTH_RATIOS[0] * self.width_px..TOUCHING_WIDTH_RATIOS[1] * self.width_px)
            .contains(&width_px);
        let is_near = |(member, expected): (&Member, &f64)| {
            (member.v - expected).abs() < TOUCHING_ASTRAY_WIDTHS * width_px
                && member.height > (TOUCHING_LEAST_HEIGHT * highest).max(2.0 * noise)
        };
        let is_apart = |pair: &[Member]| pair[1].v - pair[0].v > TOUCHING_CLOSEST_WIDTHS * width_px;
        let is_good = is_usual
            && fitted.members.iter().zip(expected).all(is_near)
            && fitted.members.windows(2).all(is_apart);
        is_good.then_some(fitted)
    }
}

impl Group {
    /// Fits courses together where they exist, and beyond their ends as far as they can be followed.
    pub fn fitted<T: Level>(picture: &Picture<T>, courses: &[Course]) -> Self {
        let first = courses.iter().map(|course| course.first).min().unwrap_or(0);
        let end = courses.iter().map(|course| course.blocks().end).max().unwrap_or(first);
        let first = first.saturating_sub(TOUCHING_CONTINUED_BLOCKS);
        let end = (end + TOUCHING_CONTINUED_BLOCKS).min(picture.view.width / BLOCK).max(first);
        let mut group = Self { first, nodes: vec![vec![None; end - first]; courses.len()] };
        let sigma_px = picture.width_px / PER_SIGMA;
        // First with the width of every block, then with that of its neighbourhood.
        group.fit(picture, courses, &vec![sigma_px; end - first], true);
        let widths = group.smooth_widths(sigma_px);
        group.fit(picture, courses, &widths, false);
        group.fill();
        group.remove_inseparable(picture, courses);
        group.follow(picture, &widths, false);
        group.follow(picture, &widths, true);
        group.fill();
        group
    }

    fn fit<T: Level>(&mut self, picture: &Picture<T>, courses: &[Course], sigmas: &[f64], with_width: bool) {
        for (at, &sigma_px) in sigmas.iter().enumerate() {
            let block = self.first + at;
            let mut here: Vec<(f64, usize)> =
                courses.iter().enumerate().filter_map(|(k, course)| Some((course.at(block)?, k))).collect();
            here.sort_by(|a, b| a.0.total_cmp(&b.0));
            self.nodes.iter_mut().for_each(|line| line[at] = None);
            if here.is_empty() {
                continue;
            }
            let slope =
                here.iter().map(|&(_, k)| courses[k].slope_at(block)).sum::<f64>() / (BLOCK * here.len()) as f64;
            let rows: Vec<f64> = here.iter().map(|&(v, _)| v).collect();
            if let Some(fitted) = picture.block(block, &rows, slope, sigma_px, with_width) {
                self.put(at, here.iter().map(|&(_, k)| k), &fitted);
            }
        }
    }

    fn put(&mut self, at: usize, lines: impl Iterator<Item = usize>, fitted: &Together) {
        for (line, member) in lines.zip(&fitted.members) {
            self.nodes[line][at] = Some(Node { v: member.v, height: member.height, sigma_px: fitted.sigma_px });
        }
    }

    /// The median width around every block, as a standard deviation.
    fn smooth_widths(&self, otherwise: f64) -> Vec<f64> {
        let n = self.nodes.first().map_or(0, Vec::len);
        let width_at = |at: usize| self.nodes.iter().find_map(|line| line[at]).map(|node| node.sigma_px);
        let own: Vec<Option<f64>> = (0..n).map(width_at).collect();
        let all = statistics::median(&mut own.iter().flatten().copied().collect::<Vec<_>>()).unwrap_or(otherwise);
        let near = |at: usize| {
            let reach = 2 * TOUCHING_SMOOTH_BLOCKS;
            let window = at.saturating_sub(reach)..(at + reach + 1).min(n);
            let mut some: Vec<f64> = own[window].iter().flatten().copied().collect();
            if some.len() < TOUCHING_SMOOTH_BLOCKS { all } else { statistics::median(&mut some).unwrap_or(all) }
        };
        (0..n).map(near).collect()
    }

    /// Interpolates short gaps: blocks in which the fit failed.
    fn fill(&mut self) {
        for line in &mut self.nodes {
            let known: Vec<usize> = (0..line.len()).filter(|&at| line[at].is_some()).collect();
            for pair in known.windows(2).filter(|pair| pair[1] - pair[0] <= TOUCHING_SMOOTH_BLOCKS) {
                let (Some(a), Some(b)) = (line[pair[0]], line[pair[1]]) else { continue };
                let gap = (pair[1] - pair[0]) as f64;
                let inner = line[pair[0] + 1..pair[1]].iter_mut();
                for (k, node) in inner.enumerate() {
                    let part = (k + 1) as f64 / gap;
                    let between = |a: f64, b: f64| a + part * (b - a);
                    *node = Some(Node {
                        v: between(a.v, b.v),
                        height: between(a.height, b.height),
                        sigma_px: between(a.sigma_px, b.sigma_px),
                    });
                }
            }
        }
    }

    /// Removes neighbours between which there is no significant minimum.
    fn remove_inseparable<T: Level>(&mut self, picture: &Picture<T>, courses: &[Course]) {
        let n = self.nodes.first().map_or(0, Vec::len);
        let mut removed = Vec::new();
        for upper in 0..courses.len() {
            for lower in 0..courses.len() {
                if courses[upper].is_separate && courses[lower].is_separate {
                    continue;
                }
                let dips: Vec<Option<Dip>> = (0..n).map(|at| self.dip(picture, at, upper, lower)).collect();
                let inseparable = (0..n).filter(|&at| {
                    let near = at.saturating_sub(TOUCHING_DIP_BLOCKS)..(at + TOUCHING_DIP_BLOCKS + 1).min(n);
                    dips[at].is_some() && !is_significant(dips[near].iter().flatten())
                });
                removed.extend(inseparable.flat_map(|at| [(upper, at), (lower, at)]));
            }
        }
        removed.into_iter().for_each(|(line, at)| self.nodes[line][at] = None);
    }

    /// The light from one line to the next below it in a block; `None` where they are not neighbours.
    fn dip<T: Level>(&self, picture: &Picture<T>, at: usize, upper: usize, lower: usize) -> Option<Dip> {
        let block = self.first + at;
        let (a, slope, _) = self.smooth_at(upper, block)?;
        let (b, other_slope, _) = self.smooth_at(lower, block)?;
        let (height_a, height_b) = (self.nodes[upper][at]?.height, self.nodes[lower][at]?.height);
        let is_between = |line: &Vec<Option<Node>>| line[at].is_some_and(|node| a < node.v && node.v < b);
        if b <= a || self.nodes.iter().enumerate().any(|(k, line)| k != upper && k != lower && is_between(line)) {
            return None;
        }
        let columns = block * BLOCK..(block + 1) * BLOCK;
        let (first, levels, _) = picture.across(columns, 0.5 * (slope + other_slope), [a - 1.0, b + 1.0])?;
        let level_at = |v: f64| {
            let place = (v - first).clamp(0.0, (levels.len() - 2) as f64);
            let part = place - place.floor();
            (1.0 - part) * levels[place as usize] + part * levels[place as usize + 1]
        };
        let levels = std::array::from_fn(|k| level_at(a + (b - a) * k as f64 / (DIP_LEVELS - 1) as f64));
        Some(Dip { levels, height: height_a.min(height_b) })
    }

    /// Continues all lines together beyond their last common block, forwards or backwards, extrapolating linearly.
    fn follow<T: Level>(&mut self, picture: &Picture<T>, sigmas: &[f64], backwards: bool) {
        let n = sigmas.len();
        let in_order = |step: usize| if backwards { n - 1 - step } else { step };
        let Some(last) =
            (0..n).rev().find(|&step| self.nodes.iter().filter(|l| l[in_order(step)].is_some()).count() > 1)
        else {
            return;
        };
        let lines: Vec<usize> =
            (0..self.nodes.len()).filter(|&k| self.nodes[k][in_order(last)].is_some()).collect();
        let mut n_failed = 0;
        for step in last + 1..n.min(last + 1 + TOUCHING_CONTINUED_BLOCKS) {
            let at = in_order(step);
            let extrapolated = |&k: &usize| {
                let known = (step.saturating_sub(2 * TOUCHING_SMOOTH_BLOCKS)..step)
                    .filter_map(|before| Some((before as f64 - step as f64, self.nodes[k][in_order(before)]?.v)));
                straight(known).map(|(v, slope)| (v, slope, k))
            };
            let mut expected: Vec<(f64, f64, usize)> = lines.iter().filter_map(extrapolated).collect();
            expected.sort_by(|a, b| a.0.total_cmp(&b.0));
            if expected.len() < 2 || n_failed > TOUCHING_COURSE_GAP_BLOCKS {
                break;
            }
            let rows: Vec<f64> = expected.iter().map(|&(v, _, _)| v).collect();
            let sign = if backwards { -1.0 } else { 1.0 };
            let slope =
                sign * expected.iter().map(|&(_, slope, _)| slope).sum::<f64>() / (BLOCK * rows.len()) as f64;
            n_failed += 1;
            if let Some(fitted) = picture.block(self.first + at, &rows, slope, sigmas[at], false) {
                n_failed = 0;
                self.put(at, expected.iter().map(|&(_, _, k)| k), &fitted);
            }
        }
    }

    /// Row of a line at a column, averaged along the line, and its slope; with its mean height.
    fn smooth_at(&self, line: usize, block: usize) -> Option<(f64, f64, f64)> {
        let at = block.checked_sub(self.first)?;
        let nodes = self.nodes.get(line)?;
        (*nodes.get(at)?)?;
        let window = at.saturating_sub(TOUCHING_SMOOTH_BLOCKS)..(at + TOUCHING_SMOOTH_BLOCKS + 1).min(nodes.len());
        let known: Vec<(f64, Node)> =
            window.filter_map(|k| nodes[k].map(|node| (k as f64 - at as f64, node))).collect();
        let height = known.iter().map(|(_, node)| node.height).sum::<f64>() / known.len() as f64;
        let points = || known.iter().map(|(x, node)| (*x, node.v, 1.0));
        let fit = if known.len() >= 6 { parabola(points()) } else { None };
        let (v, slope) = match fit {
            Some(fit) => (fit.at(0.0).0, 0.5 * (fit.at(1.0).0 - fit.at(-1.0).0)),
            None => straight(points().map(|(x, v, _)| (x, v)))?,
        };
        Some((v, slope / BLOCK as f64, height))
    }

    /// The crossings of every column, line by line, in pieces without gaps.
    pub fn crossings<T: Level>(&self, picture: &Picture<T>) -> Vec<Touching> {
        let n = self.nodes.first().map_or(0, Vec::len);
        let mut pieces: Vec<Touching> = Vec::new();
        let mut open: Vec<Option<usize>> = vec![None; self.nodes.len()];
        for at in 0..n {
            let block = self.first + at;
            let here: Vec<(usize, (f64, f64, f64), f64)> = (0..self.nodes.len())
                .filter_map(|line| Some((line, self.smooth_at(line, block)?, self.nodes[line][at]?.sigma_px)))
                .collect();
            for u in block * BLOCK..(block + 1) * BLOCK {
                let found = if here.len() > 1 { self.column(picture, u, &here) } else { None };
                for (line, open) in open.iter_mut().enumerate() {
                    let own = found.as_ref().and_then(|found| found.iter().find(|(of, ..)| *of == line));
                    let Some((_, crossing, is_saturated)) = own else {
                        *open = None;
                        continue;
                    };
                    let piece = *open.get_or_insert_with(|| {
                        pieces.push(Touching { first_u: u, crossings: Vec::new(), saturated: Vec::new() });
                        pieces.len() - 1
                    });
                    pieces[piece].crossings.push(*crossing);
                    pieces[piece].saturated.push(*is_saturated);
                }
            }
        }
        pieces.retain(|piece| piece.crossings.len() >= MIN_SEGMENT_COLUMNS);
        pieces
    }

    /// Where neighbouring lines that come closer were last seen separately.
    pub fn ends(&self) -> Vec<End> {
        let n = self.nodes.first().map_or(0, Vec::len);
        let mut ends = Vec::new();
        let both = |at: usize, a: usize, b: usize| self.nodes[a][at].is_some() && self.nodes[b][at].is_some();
        for a in 0..self.nodes.len() {
            for b in a + 1..self.nodes.len() {
                let own = (0..n).filter(|&at| both(at, a, b));
                for at in own {
                    let beyond = [(at + 1, true), (at.wrapping_sub(1), false)];
                    let free = beyond.into_iter().filter(|&(next, _)| next >= n || !both(next, a, b));
                    ends.extend(free.filter_map(|(_, is_forward)| self.end(at, [a, b], is_forward)));
                }
            }
        }
        ends
    }

    fn end(&self, at: usize, [a, b]: [usize; 2], is_forward: bool) -> Option<End> {
        let block = self.first + at;
        let (va, slope_a, _) = self.smooth_at(a, block)?;
        let (vb, slope_b, _) = self.smooth_at(b, block)?;
        let width_px = PER_SIGMA * self.nodes[a][at]?.sigma_px;
        let sign = if is_forward { 1.0 } else { -1.0 };
        let order = (vb - va).signum();
        let distance = [(vb - va).abs(), sign * order * (slope_b - slope_a)];
        let u = if is_forward { (block + 1) * BLOCK } else { (block * BLOCK).checked_sub(1)? };
        let is_closing = distance[0] < TOUCHING_ENDS_WIDTHS * width_px && distance[1] < 0.0;
        is_closing.then_some(End {
            u,
            is_forward,
            middle: [0.5 * (va + vb), 0.5 * sign * (slope_a + slope_b)],
            distance,
            width_px,
        })
    }

    /// The crossings of one column.
    fn column<T: Level>(
        &self,
        picture: &Picture<T>,
        u: usize,
        here: &[(usize, (f64, f64, f64), f64)],
    ) -> Option<Vec<(usize, Crossing, bool)>> {
        let from_middle = u as f64 - ((u / BLOCK * BLOCK) as f64 + 0.5 * (BLOCK - 1) as f64);
        let mut lines: Vec<(usize, Member)> = here
            .iter()
            .map(|&(line, (v, slope, height), _)| (line, Member { v: v + slope * from_middle, height }))
            .collect();
        lines.sort_by(|a, b| a.1.v.total_cmp(&b.1.v));
        let sigma_px = here[0].2;
        let reach = TOUCHING_WINDOW_WIDTHS * PER_SIGMA * sigma_px;
        let rows = [lines[0].1.v - reach, lines[lines.len() - 1].1.v + reach];
        let (first_row, levels, is_used) = picture.across(u..u + 1, 0.0, rows)?;
        let across = Across { first_row, levels: &levels, is_used: &is_used };
        let together = Together { members: lines.iter().map(|(_, member)| *member).collect(), sigma_px };
        let shifts = together.shifts(&across)?;
        let noise = f64::from(picture.noise.at(u, rows[0].max(0.0) as usize));
        let width_px = PER_SIGMA * sigma_px;
        let crossing = |(&(line, member), shift): (&(usize, Member), &super::fit::Shift)| {
            let near = (member.v - first_row).round();
            let is_saturated = (-1..=1).any(|k| is_used.get((near + f64::from(k)) as usize) == Some(&false));
            let crossing = Crossing {
                v: member.v + shift.shift.clamp(-0.5 * width_px, 0.5 * width_px),
                camera_variance: noise * noise * shift.per_noise,
                speckle_variance: shift.per_speckle,
                intensity: shift.height.max(0.0) as f32,
                width_px: (width_px * width_px + f64::from(LEVEL_MEASURED_PX2)).sqrt() as f32,
            };
            (line, crossing, is_saturated)
        };
        Some(lines.iter().zip(&shifts).map(crossing).collect())
    }
}

/// Value at 0 and slope of a line through points; `None` without two of them.
fn straight(points: impl Iterator<Item = (f64, f64)>) -> Option<(f64, f64)> {
    let (mut n, mut x1, mut x2, mut y1, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (x, y) in points {
        (n, x1, x2, y1, xy) = (n + 1.0, x1 + x, x2 + x * x, y1 + y, xy + x * y);
    }
    let determinant = n * x2 - x1 * x1;
    (determinant > 1e-9).then(|| ((x2 * y1 - x1 * xy) / determinant, (n * xy - x1 * y1) / determinant))
}
