//! Kinks of a line: where two lines were extracted as one, or a line bends sharply.

use multiversion::multiversion;
use vision::{LineDirection, Segment};

use crate::input::line_step::{largest_level_step_px, largest_step_px};
use crate::params::{
    CUT_TRIM_WIDTHS, KINK_SIGMAS, KINK_SLOPE, KINK_SPAN_WIDTHS, MIN_PIECE_POINTS, STEP_LIMIT_SIGMAS, STEP_LIMITS,
};

/// Points that are compared with the limits together: as many as vector registers hold, a few times.
const TOGETHER: usize = 32;

/// Finds the kinks in the lines of a frame, segment by segment; its memory is used again.
pub struct Kinks {
    direction: LineDirection,
    /// Full width of the frame's lines in focus, px.
    width_px: f64,
    /// Square root of the correlation length: a mean over n correlated points has the variance of one over
    /// n / correlation length independent points.
    correlation: f64,
    /// Points on either side of a bend.
    span: usize,
    limits: [StepLimit; STEP_LIMITS.len()],
    /// Per point of the segment: position across, px.
    across: Vec<f64>,
    /// Per point: 1/σ, 1/px.
    inverse_noise: Vec<f64>,
    /// Per point: the change of slope from the `span` points before it to those after it, px/px.
    bends: Vec<f64>,
    steps: Steps,
    places: Vec<usize>,
}

impl Kinks {
    /// For a frame whose lines in focus have the full width `width_px`.
    pub fn new(direction: LineDirection, width_px: f64, correlation_px: f64) -> Self {
        Self {
            direction,
            width_px,
            correlation: correlation_px.max(1.0).sqrt(),
            span: columns(KINK_SPAN_WIDTHS * width_px),
            limits: STEP_LIMITS
                .map(|(span_widths, least_widths)| StepLimit::new(width_px, span_widths, least_widths)),
            across: Vec::new(),
            inverse_noise: Vec::new(),
            bends: Vec::new(),
            steps: Steps::default(),
            places: Vec::new(),
        }
    }

    /// Index ranges between jumps, kinks and small steps; the points next to a cut belong to neither side.
    pub fn ranges_between(&mut self, segment: &Segment) -> Vec<(usize, usize)> {
        let Self { direction, width_px, correlation, span, .. } = *self;
        let points = &segment.points;
        self.across.clear();
        self.across.extend(points.iter().map(|point| point.along_across(direction).1));
        self.inverse_noise.clear();
        self.inverse_noise.extend(points.iter().map(|point| 1.0 / (point.sigma_px * correlation)));
        find_bends(&self.across, span, &mut self.bends);
        find_steps(&self.across, &self.inverse_noise, &self.limits, &mut self.steps);
        let level_step_px = largest_level_step_px(width_px);
        find_possible_cuts(&self.across, level_step_px, &self.bends, &self.steps.in_limits, &mut self.places);
        let Self { across, bends, steps: Steps { in_limits: steps, .. }, .. } = self;
        let trim = cut_trim(width_px);
        let (mut ranges, mut first) = (Vec::new(), 0);
        for &idx in &self.places {
            let point = &points[idx];
            let moved_px = (across[idx] - across[idx - 1]).abs();
            let jump = || moved_px > largest_step_px(point, width_px, direction);
            // A bend is a second difference: √6 times the noise of one point.
            let bend_sigma = || 6f64.sqrt() * point.sigma_px / span as f64;
            let kink =
                || bends[idx] > KINK_SLOPE && bends[idx] > KINK_SIGMAS * bend_sigma() && is_peak(bends, idx, span);
            let step = || steps[idx] > 1.0 && is_peak(steps, idx, span);
            if jump() || kink() || step() {
                ranges.push((first, idx.saturating_sub(trim)));
                first = idx + trim;
            }
        }
        ranges.push((first, across.len()));
        ranges.retain(|(first, end)| first < end);
        ranges
    }
}

/// Number of points excluded on either side of a cut. `width_px`: width of lines in focus.
pub fn cut_trim(width_px: f64) -> usize {
    (CUT_TRIM_WIDTHS * width_px).round().max(1.0) as usize
}

/// A length along the line in whole scan columns (rows), at least as many as a slope needs.
fn columns(length_px: f64) -> usize {
    (length_px.round() as usize).max(MIN_PIECE_POINTS - 1)
}

/// Limit for a step between lines fitted to points on either side.
struct StepLimit {
    /// Points on either side.
    span: usize,
    /// Smallest step, in σ of a point.
    sigmas: f64,
    /// Smallest step, px.
    least_px: f64,
}

impl StepLimit {
    fn new(width_px: f64, span_widths: f64, least_widths: f64) -> Self {
        let span = columns(span_widths * width_px);
        let n = span as f64;
        // Variance of a least-squares line of n points half a point beyond its last, in that of a point; twice that of a
        // step.
        let end_variance = 1.0 / n + 3.0 * n / (n * n - 1.0);
        let sigmas = STEP_LIMIT_SIGMAS * (2.0 * end_variance).sqrt();
        Self { span, sigmas, least_px: least_widths * width_px }
    }
}

/// Steps of a line from one point to the next.
#[derive(Default)]
struct Steps {
    /// Per point: distance between the line fitted to the points before it and the line fitted to those from it on, in limits.
    in_limits: Vec<f64>,
    /// Running sums of positions and of positions × index.
    sums: Vec<f64>,
    moments: Vec<f64>,
}

/// Per point: the change of slope from the `span` points before it to those after it, px/px.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn find_bends(across: &[f64], span: usize, bends: &mut Vec<f64>) {
    bends.clear();
    bends.resize(across.len(), 0.0);
    if let (Some(here), Some(ahead)) = (across.get(span..), across.get(2 * span..)) {
        let around = across.iter().zip(here).zip(ahead);
        for (bend, ((behind, here), ahead)) in bends[span..].iter_mut().zip(around) {
            *bend = ((ahead - here) - (here - behind)).abs() / span as f64;
        }
    }
}

/// The steps of a line.
///
/// The lines are computed from running sums; `inverse_noise` holds 1/σ of every point, 1/px.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn find_steps(across: &[f64], inverse_noise: &[f64], limits: &[StepLimit], steps: &mut Steps) {
    let Steps { in_limits, sums, moments } = steps;
    let (mut sum, mut moment) = (0.0, 0.0);
    for list in [&mut *sums, &mut *moments] {
        list.clear();
        list.resize(across.len() + 1, 0.0);
    }
    for (place, ((y, sum_to), moment_to)) in across.iter().zip(&mut sums[1..]).zip(&mut moments[1..]).enumerate() {
        sum += y - across[0];
        moment += place as f64 * (y - across[0]);
        (*sum_to, *moment_to) = (sum, moment);
    }
    in_limits.clear();
    in_limits.resize(across.len(), 0.0f64);
    for &StepLimit { span, sigmas, least_px } in limits {
        if across.len() < 2 * span {
            continue;
        }
        let n = across.len() + 1 - 2 * span;
        let of = |offset: usize| (&sums[offset..offset + n], &moments[offset..offset + n]);
        let [first, middle, last] = [of(0), of(span), of(2 * span)];
        let (constant, slope) = end_weights(span);
        let (by_noise, by_least) = (1.0 / sigmas, 1.0 / least_px);
        for (i, step) in in_limits[span..span + n].iter_mut().enumerate() {
            // The line through the points before, half a point beyond the last: Σ (α + β j) y over j = 0 … span − 1.
            let (before, moment) = (middle.0[i] - first.0[i], middle.1[i] - first.1[i]);
            let ends = constant * before + slope * (moment - i as f64 * before);
            // The line through the points after, half a point before the first, counted backwards.
            let (after, moment) = (last.0[i] - middle.0[i], last.1[i] - middle.1[i]);
            let starts = constant * after + slope * ((i + 2 * span - 1) as f64 * after - moment);
            *step = step.max((ends - starts).abs() * (by_noise * inverse_noise[span + i]).min(by_least));
        }
    }
}

/// Points from the second on that may be cuts, which are nearly none: the line moves by more than `level_step_px`, its bend
/// is above [`KINK_SLOPE`], or its step above a limit.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn find_possible_cuts(across: &[f64], level_step_px: f64, bends: &[f64], steps: &[f64], places: &mut Vec<usize>) {
    places.clear();
    let Some(n) = across.len().checked_sub(1) else { return };
    let (from, to, bends, steps) = (&across[..n], &across[1..], &bends[1..], &steps[1..]);
    let is_above = |from: f64, to: f64, bend: f64, step: f64| {
        ((to - from).abs() > level_step_px) | (bend > KINK_SLOPE) | (step > 1.0)
    };
    for first in (0..n).step_by(TOGETHER) {
        let end = (first + TOGETHER).min(n);
        let moves = from[first..end].iter().zip(&to[first..end]);
        let of_points = moves.zip(bends[first..end].iter().zip(&steps[first..end]));
        let is_any_above = of_points
            .fold(false, |is_any, ((from, to), (bend, step))| is_any | is_above(*from, *to, *bend, *step));
        if is_any_above {
            let possible = (first..end).filter(|&idx| is_above(from[idx], to[idx], bends[idx], steps[idx]));
            places.extend(possible.map(|idx| idx + 1));
        }
    }
}

/// Weight of point i of n in the value of their least-squares line half a point beyond the last: α + β i.
fn end_weights(n: usize) -> (f64, f64) {
    let count = n as f64;
    let slope = 6.0 / (count * count - 1.0);
    (1.0 / count - 0.5 * (count - 1.0) * slope, slope)
}

/// Whether `idx` is the strongest bend within a span; the first of equals.
fn is_peak(bends: &[f64], idx: usize, span: usize) -> bool {
    let from = idx.saturating_sub(span);
    let to = (idx + span + 1).min(bends.len());
    bends[from..idx].iter().all(|other| *other < bends[idx])
        && bends[idx..to].iter().all(|other| *other <= bends[idx])
}

#[cfg(test)]
mod tests {
    use vision::CentrelinePoint;

    use super::*;

    const WIDTH_PX: f64 = 6.0;

    /// A line of `n` points whose height above its first is `height_px`.
    fn line(n: usize, height_px: impl Fn(usize) -> f64) -> Segment {
        let point = |at: usize| CentrelinePoint {
            u_px: at as f64,
            v_px: 200.0 + height_px(at),
            normal: [0.0, 1.0],
            sigma_px: 0.02,
            width_px: WIDTH_PX as f32,
            ..CentrelinePoint::UNWRITTEN
        };
        Segment { points: (0..n).map(point).collect() }
    }

    #[test]
    fn jumps_bends_and_steps_are_cut_whatever_was_read_before() {
        let level = line(300, |_| 0.0);
        let jump = line(300, |at| if at < 150 { 0.0 } else { 20.0 });
        let bend = line(200, |at| (at as f64 - 100.0).abs());
        let step = line(257, |at| if at < 90 { 0.0 } else { 1.5 });
        let new = || Kinks::new(LineDirection::Rows, WIDTH_PX, 2.0);
        let mut kinks = new();
        for (segment, cut) in [(&level, None), (&jump, Some(150)), (&bend, Some(100)), (&step, Some(90))] {
            let ranges = kinks.ranges_between(segment);
            assert_eq!(ranges, new().ranges_between(segment), "cut {cut:?}");
            let is_cut = |cut| ranges.iter().all(|(first, end)| !(*first..*end).contains(&cut));
            assert!(cut.map_or(ranges == [(0, 300)], is_cut), "cut {cut:?}: {ranges:?}");
            let n_kept: usize = ranges.iter().map(|(first, end)| end - first).sum();
            assert!(n_kept + 20 > segment.points.len(), "cut {cut:?}: {ranges:?}");
        }
        assert_eq!(kinks.ranges_between(&line(1, |_| 0.0)), [(0, 1)]);
    }
}
