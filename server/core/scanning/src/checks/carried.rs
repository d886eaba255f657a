//! Labels that a line carries across a step without other evidence (`docs/maths/labelling.md`, "Carried labels").

use std::ops::Range;

use crate::input::line_widths::Width;
use crate::params::{
    OPEN_FRACTION, STEP_BLUR_WIDTHS, STEP_CONFIRMED_FRACTION, STEP_MIN_POINTS, STEP_MIN_WIDTHS, STEP_SIGMAS,
    STEP_WINDOW_WIDTHS, WIDTH_WINDOW_WIDTHS,
};

/// A point of a run: consecutive points of one line with one label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunPoint {
    /// Position along the line, px.
    pub along_px: f64,
    /// Position across the lines, px.
    pub across_px: f64,
    /// Standard deviation of one point, times the square root of the number of points that share their noise, px.
    pub noise_px: f64,
    /// Full width of the line at half its height, px.
    pub width_px: f64,
    /// Whether another order has observed the surface it lies on.
    pub is_confirmed: bool,
    /// Whether the lines above and below admit another order.
    pub is_open: bool,
    /// Which label the width of the line fits.
    pub width: Width,
}

impl RunPoint {
    /// Whether a repeated observation, the ranks or its width support its label.
    pub fn is_held(&self) -> bool {
        self.is_confirmed || !self.is_open || self.width == Width::Own
    }

    /// Number of columns in so many line widths.
    pub fn columns(&self, widths: f64) -> usize {
        (widths * self.width_px).ceil() as usize
    }
}

/// The stretches of a run, by index, whose label is supported only by continuity: they lie beyond a step, no other
/// order has observed them, and the ranks admit another label. They include the points smoothed across the step.
/// Without any repeated observation the longest stretch is kept.
pub fn carried_stretches(run: &[RunPoint]) -> Vec<Range<usize>> {
    let steps = steps(run);
    if steps.is_empty() {
        return Vec::new();
    }
    let starts = std::iter::once(0).chain(steps.iter().map(|step| step.end));
    let ends = steps.iter().map(|step| step.start).chain(std::iter::once(run.len()));
    let stretches: Vec<Range<usize>> = starts.zip(ends).map(|(start, end)| start..end.max(start)).collect();
    let share = |stretch: &Range<usize>, holds: fn(&RunPoint) -> bool| {
        run[stretch.clone()].iter().filter(|point| holds(point)).count() as f64 / stretch.len().max(1) as f64
    };
    let is_confirmed =
        |stretch: &Range<usize>| share(stretch, |point| point.is_confirmed) >= STEP_CONFIRMED_FRACTION;
    let longest = stretches.iter().map(Range::len).max().unwrap_or(0);
    let none_confirmed = !stretches.iter().any(is_confirmed);
    let carried = |stretch: &Range<usize>| {
        let is_kept = is_confirmed(stretch) || none_confirmed && stretch.len() == longest;
        !is_kept && !stretch.is_empty() && share(stretch, |point| point.is_open) > OPEN_FRACTION
    };
    let with_smoothed_ends = |idx: usize| {
        let before = idx.checked_sub(1).map_or(0, |before| stretches[before].end);
        before..stretches.get(idx + 1).map_or(run.len(), |next| next.start)
    };
    (0..stretches.len()).filter(|&idx| carried(&stretches[idx])).map(with_smoothed_ends).collect()
}

/// The stretches of a run, by index, that are neither rejected nor supported, and not connected to a supported
/// point: their line was cut at one of their ends, or they are the whole run. `rejected`: per point, whether it is
/// rejected. `cut`: whether the line continues before and after the run with another label or none.
pub fn unsupported_stretches(run: &[RunPoint], rejected: &[bool], cut: [bool; 2]) -> Vec<Range<usize>> {
    let is_unsupported = |idx: usize| !rejected[idx] && !run[idx].is_held();
    let mut unsupported = Vec::new();
    let mut first = 0;
    while first < run.len() {
        let end = first + (first..run.len()).take_while(|&idx| is_unsupported(idx)).count();
        if first < end {
            let is_cut_before = if first == 0 { cut[0] } else { rejected[first - 1] };
            let is_cut_after = if end == run.len() { cut[1] } else { rejected[end] };
            let is_whole_run = first == 0 && end == run.len();
            if is_cut_before || is_cut_after || is_whole_run {
                unsupported.push(first..end);
            }
        }
        first = end.max(first + 1);
    }
    unsupported
}

/// The points of a run, by index, whose line width fits another label better, extended along the line by the length
/// over which widths are averaged. Ranges may overlap.
pub fn rejected_by_width(run: &[RunPoint]) -> Vec<Range<usize>> {
    let around = |idx: usize| {
        let reach = run[idx].columns(WIDTH_WINDOW_WIDTHS);
        idx.saturating_sub(reach)..(idx + reach + 1).min(run.len())
    };
    (0..run.len()).filter(|&idx| run[idx].width == Width::Rival).map(around).collect()
}

/// Steps of the run: the points over which the extraction smooths a step, in ascending order and disjoint.
fn steps(run: &[RunPoint]) -> Vec<Range<usize>> {
    let sums = RunningSums::new(run);
    let mut heights: Vec<f64> = (0..run.len()).map(|at| step_in_limits(run, &sums, at)).collect();
    let mut middles = Vec::new();
    while let Some(middle) = (0..run.len()).max_by(|&a, &b| heights[a].total_cmp(&heights[b])) {
        if heights[middle] <= 1.0 {
            break;
        }
        middles.push(middle);
        // The same step is detected as long as one of the two fitted lines crosses it.
        let window = run[middle].columns(STEP_WINDOW_WIDTHS + STEP_BLUR_WIDTHS);
        heights[middle.saturating_sub(window)..(middle + window + 1).min(run.len())].fill(0.0);
    }
    middles.sort_unstable();
    let mut end = 0;
    let smoothed = |middle: usize| {
        let blur = run[middle].columns(STEP_BLUR_WIDTHS);
        let start = middle.saturating_sub(blur).max(end);
        end = (middle + blur).clamp(start, run.len());
        start..end
    };
    middles.into_iter().map(smoothed).collect()
}

/// Distance at a point between the lines fitted before and after it, relative to the smallest step detected; 0
/// where one of them has too few points.
fn step_in_limits(run: &[RunPoint], sums: &RunningSums, at: usize) -> f64 {
    let (window, blur) = (run[at].columns(STEP_WINDOW_WIDTHS), run[at].columns(STEP_BLUR_WIDTHS));
    let (Some(end), start) = (at.checked_sub(blur / 2), (at + blur.div_ceil(2)).min(run.len())) else {
        return 0.0;
    };
    // Both lines have the same length, so that the effect of a bend cancels.
    let n_points = window.min(end).min(run.len() - start);
    if n_points < STEP_MIN_POINTS {
        return 0.0;
    }
    let (before, after) = (sums.line(end - n_points..end), sums.line(start..start + n_points));
    let [along_px, _] = from_first(run, at);
    let value = |line: &Line| line.across_px + line.slope * (along_px - line.along_px);
    let variance = |line: &Line| 1.0 / n_points as f64 + (along_px - line.along_px).powi(2) / line.spread;
    let noise_px = run[at].noise_px * (variance(&before) + variance(&after)).sqrt();
    (value(&before) - value(&after)).abs() / (STEP_MIN_WIDTHS * run[at].width_px).max(STEP_SIGMAS * noise_px)
}

/// Position of a point along and across the lines relative to the first of its run, px.
fn from_first(run: &[RunPoint], at: usize) -> [f64; 2] {
    [run[at].along_px - run[0].along_px, run[at].across_px - run[0].across_px]
}

/// Sums over the points before each point of a run: along, across, along², along · across, relative to its first point.
struct RunningSums(Vec<[f64; 4]>);

impl RunningSums {
    fn new(run: &[RunPoint]) -> Self {
        let mut sums = [0.0; 4];
        let mut before = Vec::with_capacity(run.len() + 1);
        before.push(sums);
        for at in 0..run.len() {
            let [along, across] = from_first(run, at);
            let added = [along, across, along * along, along * across];
            sums.iter_mut().zip(added).for_each(|(sum, value)| *sum += value);
            before.push(sums);
        }
        Self(before)
    }

    /// The least-squares line through some points.
    fn line(&self, points: Range<usize>) -> Line {
        let n = points.len() as f64;
        let (first, last) = (self.0[points.start], self.0[points.end]);
        let [along, across, squares, products] = std::array::from_fn(|idx| last[idx] - first[idx]);
        // A single point gives slope zero.
        let spread = f64::max(squares - along * along / n, 1.0);
        Line {
            along_px: along / n,
            across_px: across / n,
            slope: (products - along * across / n) / spread,
            spread,
        }
    }
}

/// A line, by its centre relative to the first point of the run.
struct Line {
    along_px: f64,
    across_px: f64,
    slope: f64,
    spread: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run of 200 points with speckle of 0.1 px, observed by another order except in `unconfirmed`, and `height_px`
    /// higher from `from` on.
    fn run(height_px: f64, from: usize, unconfirmed: Range<usize>) -> Vec<RunPoint> {
        let point = |idx: usize| RunPoint {
            along_px: idx as f64,
            across_px: 300.0 + 0.02 * idx as f64 + if idx >= from { height_px } else { 0.0 },
            noise_px: 0.1,
            width_px: 5.0,
            is_confirmed: !unconfirmed.contains(&idx),
            is_open: true,
            width: Width::Unclear,
        };
        (0..200).map(point).collect()
    }

    #[test]
    fn points_beyond_a_step_need_a_repeated_observation() {
        let carried = &carried_stretches(&run(1.5, 170, 160..200));
        let [carried] = &carried[..] else { panic!("{carried:?}") };
        assert!((160..=170).contains(&carried.start) && carried.end == 200, "{carried:?}");
        assert_eq!(carried_stretches(&run(1.5, 170, 0..0)), []);
        assert_eq!(carried_stretches(&run(0.2, 170, 160..200)), [], "a step within the noise");
    }

    #[test]
    fn ranks_that_admit_one_order_support_a_label() {
        let mut held = run(1.5, 170, 160..200);
        held.iter_mut().for_each(|point| point.is_open = false);
        assert_eq!(carried_stretches(&held), []);
    }

    #[test]
    fn a_stretch_depends_on_its_supported_neighbours_unless_its_line_was_cut() {
        let (inside, at_the_end) = (run(0.0, 0, 60..90), run(0.0, 0, 170..200));
        let nothing = [false; 200];
        let unsupported = |run: &[RunPoint], rejected: &[bool], cut: [bool; 2]| -> Vec<(usize, usize)> {
            unsupported_stretches(run, rejected, cut).iter().map(|stretch| (stretch.start, stretch.end)).collect()
        };
        assert_eq!(unsupported(&inside, &nothing, [true; 2]), []);
        assert_eq!(unsupported(&at_the_end, &nothing, [true, false]), []);
        assert_eq!(unsupported(&at_the_end, &nothing, [false, true]), [(170, 200)]);
        let mut rejected = nothing;
        rejected[55..60].fill(true);
        assert_eq!(unsupported(&inside, &rejected, [false; 2]), [(60, 90)]);
        assert_eq!(unsupported(&run(0.0, 0, 0..200), &nothing, [false; 2]), [(0, 200)], "nothing is supported");
        let mut ranked = run(0.0, 0, 0..200);
        ranked.iter_mut().for_each(|point| point.is_open = false);
        assert_eq!(unsupported(&ranked, &nothing, [true; 2]), [], "the ranks support it");
    }

    #[test]
    fn points_whose_width_fits_another_label_are_rejected_over_the_averaging_length() {
        let mut run = run(0.0, 0, 0..200);
        (120..130).for_each(|idx| run[idx].width = Width::Rival);
        let rejected: Vec<usize> = rejected_by_width(&run).into_iter().flatten().collect();
        assert_eq!((rejected.iter().min(), rejected.iter().max()), (Some(&112), Some(&137)));
        run[120].width = Width::Own;
        assert!(run[120].is_held() && !run[119].is_held(), "119 was not observed again");
    }

    #[test]
    fn a_bend_is_not_a_step() {
        let mut bent = run(0.0, 0, 100..200);
        // A radius of 500 px.
        bent.iter_mut().for_each(|point| point.across_px += 0.001 * (point.along_px - 100.0).powi(2));
        assert_eq!(carried_stretches(&bent), []);
    }

    #[test]
    fn without_any_repeated_observation_the_longest_stretch_is_kept() {
        let carried = &carried_stretches(&run(3.0, 60, 0..200));
        let [carried] = &carried[..] else { panic!("{carried:?}") };
        assert!(carried.start == 0 && (60..=72).contains(&carried.end), "{carried:?}");
    }
}
