//! Fuses one frame's lines from several exposures of the same view: dark areas from long exposures, bright areas
//! from short ones.
//!
//! Centrelines are fused, not images: every exposure is extracted separately, so that the response of the sensor
//! need not be known. Saturated points are excluded where another exposure is not saturated. The rest is averaged
//! with weights 1/σ²; σ of the mean assumes fully correlated noise, because speckle is the same in all exposures.

use vision::{CentrelinePoint, Centrelines, LineDirection, Segment};

use crate::input::line_step::largest_step_px;
use crate::params::exposures::{DISAGREE_SIGMAS, SAME_LINE_WIDTHS};

/// The lines of one exposure.
#[derive(Debug, Clone, Copy)]
pub struct ExposureLines<'a> {
    /// Exposure time.
    pub exposure_us: f64,
    /// Its lines.
    pub centrelines: &'a Centrelines,
}

/// Number of fused points by the exposures they come from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FusionCounts {
    /// Points.
    pub n_points: usize,
    /// Points saturated in some exposure and taken from others.
    pub n_replaced: usize,
    /// Points saturated in every exposure.
    pub n_saturated: usize,
    /// Points on which exposures differ by more than 3 σ: the best of them is used, with the difference added to its σ.
    pub n_disagreeing: usize,
}

impl FusionCounts {
    /// Adds those of another frame.
    pub fn add(&mut self, other: &Self) {
        self.n_points += other.n_points;
        self.n_replaced += other.n_replaced;
        self.n_saturated += other.n_saturated;
        self.n_disagreeing += other.n_disagreeing;
    }
}

/// A point of one exposure.
#[derive(Debug, Clone, Copy)]
struct ExposurePoint {
    point: CentrelinePoint,
    exposure: usize,
    /// Its segment, numbered over all exposures.
    segment: usize,
    /// Column (row) of its line.
    column: i64,
    across_px: f64,
}

/// A point of the fused lines, and the points it was computed from.
#[derive(Debug, Clone)]
struct Fused {
    point: CentrelinePoint,
    across_px: f64,
    segments: Vec<usize>,
}

/// Fuses the lines of several exposures of one view; intensities are those of the longest exposure.
///
/// Lines of different exposures are the same line where they are closer than half their width in a column (row).
pub fn fuse_exposures(exposures: &[ExposureLines]) -> (Centrelines, FusionCounts) {
    let direction = exposures.first().map_or(LineDirection::default(), |exposed| exposed.centrelines.direction);
    let mut observed = all_points(exposures, direction);
    observed.sort_by(|a, b| a.column.cmp(&b.column).then(a.across_px.total_cmp(&b.across_px)));
    let longest_us = exposures.iter().map(|exposed| exposed.exposure_us).fold(0.0, f64::max);
    let gains: Vec<f32> = exposures.iter().map(|exposed| (longest_us / exposed.exposure_us) as f32).collect();
    let mut counts = FusionCounts::default();
    let mut chains = LineTracker { direction, ..LineTracker::default() };
    for column in observed.chunk_by(|a, b| a.column == b.column) {
        let mut fused: Vec<Fused> = without_edge_lines(lines_of_column(column))
            .iter()
            .map(|line| fused(line, &gains, &mut counts))
            .collect();
        fused.sort_by(|a, b| a.across_px.total_cmp(&b.across_px));
        chains.extend(column[0].column, fused);
    }
    let correlation_px = exposures.iter().map(|exposed| exposed.centrelines.correlation_px).fold(0.0, f64::max);
    let lit_line = exposures.first().and_then(|exposed| exposed.centrelines.lit_line);
    (Centrelines { segments: chains.segments(), direction, correlation_px, lit_line }, counts)
}

fn all_points(exposures: &[ExposureLines], direction: LineDirection) -> Vec<ExposurePoint> {
    let segments = exposures.iter().enumerate().flat_map(|(exposure, exposed)| {
        exposed.centrelines.segments.iter().map(move |segment| (exposure, segment))
    });
    let points = segments.enumerate().flat_map(|(segment, (exposure, of))| {
        let first = of.points.first().map_or(0, |point| point.along_across(direction).0.round() as i64);
        of.points.iter().enumerate().map(move |(idx, point)| ExposurePoint {
            point: *point,
            exposure,
            segment,
            column: first + idx as i64,
            across_px: point.along_across(direction).1,
        })
    });
    points.collect()
}

/// Groups the points of one column, ordered across, by line: at most one point of each exposure.
fn lines_of_column(column: &[ExposurePoint]) -> Vec<Vec<ExposurePoint>> {
    let mut lines: Vec<Vec<ExposurePoint>> = Vec::new();
    for observed in column {
        let belongs = |line: &Vec<ExposurePoint>| {
            let last = &line[line.len() - 1];
            let reach_px = SAME_LINE_WIDTHS * f64::from(observed.point.width_px.max(last.point.width_px));
            observed.across_px - last.across_px <= reach_px
                && line.iter().all(|other| other.exposure != observed.exposure)
        };
        match lines.last_mut().filter(|line| belongs(line)) {
            Some(line) => line.push(*observed),
            None => lines.push(vec![*observed]),
        }
    }
    lines
}

/// Removes the false lines that a long exposure shows at the edges of a saturated line: they are within its width,
/// a shorter exposure shows the line itself, and the exposures with the false lines do not show it, or saturate
/// it.
fn without_edge_lines(lines: Vec<Vec<ExposurePoint>>) -> Vec<Vec<ExposurePoint>> {
    let shortest = |line: &[ExposurePoint]| line.iter().map(|observed| observed.exposure).min();
    let is_edge_line = |line: &[ExposurePoint], of: &[ExposurePoint]| {
        let near = (line[0].across_px - of[0].across_px).abs()
            < 2.0 * line.iter().chain(of).map(|observed| f64::from(observed.point.width_px)).fold(0.0, f64::max);
        let shows_line = |observed: &ExposurePoint| {
            of.iter().any(|other| other.exposure == observed.exposure && !other.point.saturated)
        };
        let apart = !line.iter().any(shows_line);
        near && apart && shortest(line) > shortest(of)
    };
    let edge_lines: Vec<bool> = lines.iter().map(|line| lines.iter().any(|of| is_edge_line(line, of))).collect();
    lines.into_iter().zip(edge_lines).filter(|(_, is_edge_line)| !is_edge_line).map(|(line, _)| line).collect()
}

fn fused(line: &[ExposurePoint], gains: &[f32], counts: &mut FusionCounts) -> Fused {
    let unsaturated: Vec<&ExposurePoint> = line.iter().filter(|observed| !observed.point.saturated).collect();
    let used: Vec<&ExposurePoint> = if unsaturated.is_empty() { line.iter().collect() } else { unsaturated };
    let best =
        used.iter().min_by(|a, b| a.point.sigma_px.total_cmp(&b.point.sigma_px)).expect("a line has points");
    let apart_px = used.iter().map(|observed| (observed.across_px - best.across_px).abs()).fold(0.0, f64::max);
    let disagrees = used.iter().any(|observed| {
        let sigma_px = observed.point.sigma_px.hypot(best.point.sigma_px);
        (observed.across_px - best.across_px).abs() > DISAGREE_SIGMAS * sigma_px
    });
    counts.n_points += 1;
    counts.n_disagreeing += usize::from(disagrees);
    counts.n_saturated += usize::from(used.iter().all(|observed| observed.point.saturated));
    counts.n_replaced += usize::from(used.len() < line.len());
    let segments = line.iter().map(|observed| observed.segment).collect();
    let intensity = |observed: &ExposurePoint| observed.point.intensity * gains[observed.exposure];
    if disagrees {
        let sigma_px = best.point.sigma_px.hypot(0.5 * apart_px);
        let point = CentrelinePoint { sigma_px, intensity: intensity(best), ..best.point };
        return Fused { point, across_px: best.across_px, segments };
    }
    let weights: Vec<f64> = used.iter().map(|observed| observed.point.sigma_px.powi(-2)).collect();
    let sum: f64 = weights.iter().sum();
    let mean = |of: &dyn Fn(&ExposurePoint) -> f64| {
        used.iter().zip(&weights).map(|(observed, weight)| of(observed) * weight).sum::<f64>() / sum
    };
    let point = CentrelinePoint {
        u_px: mean(&|observed| observed.point.u_px),
        v_px: mean(&|observed| observed.point.v_px),
        sigma_px: mean(&|observed| observed.point.sigma_px),
        intensity: mean(&|observed| f64::from(intensity(observed))) as f32,
        ..best.point
    };
    Fused { point, across_px: mean(&|observed| observed.across_px), segments }
}

/// Lines extended column by column.
#[derive(Debug, Default)]
struct LineTracker {
    column: i64,
    direction: LineDirection,
    open: Vec<Vec<Fused>>,
    done: Vec<Vec<Fused>>,
}

impl LineTracker {
    /// Adds the points of a column: each extends the nearest line of the previous column that shares a segment with it
    /// or is close, or else starts a new one.
    fn extend(&mut self, column: i64, points: Vec<Fused>) {
        if column != self.column + 1 {
            self.done.append(&mut self.open);
        }
        self.column = column;
        let before = std::mem::take(&mut self.open);
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (at, point) in points.iter().enumerate() {
            for (chain, last) in before.iter().filter_map(|chain| chain.last()).enumerate() {
                let apart_px = (point.across_px - last.across_px).abs();
                let reach_px = largest_step_px(&point.point, point.point.width_px.into(), self.direction);
                if apart_px <= reach_px || point.segments.iter().any(|segment| last.segments.contains(segment)) {
                    pairs.push((apart_px, at, chain));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut chain_of: Vec<Option<usize>> = vec![None; points.len()];
        let mut taken = vec![false; before.len()];
        for (_, at, chain) in pairs {
            if chain_of[at].is_none() && !taken[chain] {
                (chain_of[at], taken[chain]) = (Some(chain), true);
            }
        }
        let mut before: Vec<Option<Vec<Fused>>> = before.into_iter().map(Some).collect();
        for (point, chain) in points.into_iter().zip(chain_of) {
            let mut line = chain.and_then(|chain| before[chain].take()).unwrap_or_default();
            line.push(point);
            self.open.push(line);
        }
        self.done.extend(before.into_iter().flatten());
    }

    fn segments(mut self) -> Vec<Segment> {
        self.done.append(&mut self.open);
        let points = |chain: Vec<Fused>| Segment { points: chain.into_iter().map(|fused| fused.point).collect() };
        let mut segments: Vec<Segment> = self.done.into_iter().map(points).collect();
        let first = |segment: &Segment| segment.points[0].along_across(self.direction);
        segments.sort_by(|a, b| {
            let (a, b) = (first(a), first(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        segments
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(row_px: f64, sigma_px: f64, saturated: bool) -> Segment {
        let point = |column: i32| CentrelinePoint {
            u_px: f64::from(column),
            v_px: row_px,
            normal: [0.0, 1.0],
            sigma_px,
            intensity: 40.0,
            width_px: 5.0,
            saturated,
        };
        Segment { points: (10..40).map(point).collect() }
    }

    fn fused_of(short: Vec<Segment>, long: Vec<Segment>) -> (Centrelines, FusionCounts) {
        let [short, long] = [short, long].map(|segments| Centrelines { segments, ..Centrelines::default() });
        let exposed = [(1.0, &short), (4.0, &long)];
        fuse_exposures(&exposed.map(|(exposure_us, centrelines)| ExposureLines { exposure_us, centrelines }))
    }

    #[test]
    fn agreeing_points_are_averaged_with_the_intensity_of_the_longest_exposure() {
        let (fused, counts) = fused_of(vec![line(10.0, 0.1, false)], vec![line(10.1, 0.05, false)]);
        let [segment] = &fused.segments[..] else { panic!("{} segments", fused.segments.len()) };
        assert_eq!((segment.points.len(), counts.n_points, counts.n_disagreeing), (30, 30, 0));
        let point = segment.points[7];
        assert!((point.v_px - 10.08).abs() < 1e-12 && (point.sigma_px - 0.06).abs() < 1e-12, "{point:?}");
        // Weight 4/5 on 40 levels in the longest exposure, 1/5 on 4 · 40.
        assert!((point.intensity - 64.0).abs() < 1e-4, "{point:?}");
    }

    #[test]
    fn disagreeing_points_are_counted_and_their_sigma_includes_the_difference() {
        let (fused, counts) = fused_of(vec![line(10.0, 0.05, false)], vec![line(10.6, 0.1, false)]);
        assert_eq!((counts.n_points, counts.n_disagreeing), (30, 30));
        let point = fused.segments[0].points[3];
        // Except for the last digit, which depends on the order of summation.
        assert!(point.v_px == 10.0 && (point.sigma_px - 0.05f64.hypot(0.3)).abs() < 1e-12, "{point:?}");
    }

    #[test]
    fn saturated_points_are_replaced_and_the_edges_of_a_saturated_line_are_not_lines() {
        let edge_lines = vec![line(6.5, 0.2, false), line(10.3, 0.2, true), line(13.5, 0.2, false)];
        let (fused, counts) = fused_of(vec![line(10.0, 0.05, false)], edge_lines);
        let [segment] = &fused.segments[..] else { panic!("{} segments", fused.segments.len()) };
        assert_eq!((segment.points[3].v_px, segment.points[3].saturated), (10.0, false));
        assert_eq!((counts.n_replaced, counts.n_saturated), (30, 0));
    }
}
