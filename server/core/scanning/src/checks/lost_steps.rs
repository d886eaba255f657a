//! A watch over lost steps: the stage is not where it says from some frame on.
//!
//! Each order sees a place of the part at another position of the stage. As long as the stage is where it says, their
//! surfaces coincide. After a loss of δ along the travel, surface seen from then on lies δ off what the other orders saw
//! before: on a slope g of depth along the travel the difference in depth is g·δ, and where nothing slopes it is nothing.
//!
//! Method, frame by frame: every line is condensed to one place and depth in each of [`BIN_COLUMNS`] columns; each is held
//! against the surface that every other order saw earlier; a straight line of difference over slope, whose constant takes
//! up what the two orders disagree about anyway, gives δ of this frame and pair with its variance. Then, for every frame
//! of the last [`REACH_FRAMES`] at which the jump may have been: the mean of δ since then, against surface seen before it,
//! less the mean before it, in its standard deviations (a generalised likelihood ratio of a step in known noise).
//!
//! Blind on plates and on ramps of one slope. Known weakness: a calibration that is wrong differently over the field makes
//! δ drift; only a step is looked for.

use std::collections::VecDeque;

use nalgebra::Vector3;
use optics::{Calibration, Stage};

use crate::params::lost_steps::{
    ALARM_MM, ALARM_SIGMAS, BASELINE_FRAMES, BIN_COLUMNS, FEWEST_DIFFERENCES, FEWEST_FRAMES, MAX_SLOPE,
    NOISE_INFLATION, OUTLIER_SIGMAS, REACH_FRAMES,
};
use crate::points::profile::{Profile, ProfilePoint};

/// Steps that were lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LostSteps {
    /// The first frame, counted from 0, for which the stage was not where it said; known to a few frames.
    pub first_frame: usize,
    /// The frame with which they were noticed.
    pub noticed_frame: usize,
    /// Where the stage said that it was at `first_frame`, mm.
    pub position_mm: f64,
    /// How far it lags behind what it says since then, mm.
    pub lag_mm: f64,
    /// Standard deviation of `lag_mm`.
    pub sigma_mm: f64,
}

/// A line in one bin: place along the travel and depth in the middle of the bin, part frame.
#[derive(Debug, Clone, Copy)]
struct Sample {
    frame: usize,
    along_mm: f64,
    depth_mm: f64,
}

/// What one frame of one order says against the surface of another.
#[derive(Debug, Clone, Copy)]
struct Evidence {
    frame: usize,
    /// The last frame of which surface was used.
    reference: usize,
    pair: usize,
    lag_mm: f64,
    variance: f64,
}

/// The watch; it is told every frame of a scan in the order of travel.
#[derive(Debug)]
pub struct LostStepsWatch {
    orders: Vec<i8>,
    /// Unit vectors of the camera frame: along the travel, across it, and the depth.
    axes: [Vector3<f64>; 3],
    bin_mm: f64,
    /// Surface of each order, bin by bin from that in the middle; samples in the order of travel.
    surfaces: Vec<Vec<Vec<Sample>>>,
    positions_mm: Vec<f64>,
    evidence: VecDeque<Evidence>,
    n_frames: usize,
    /// Frames before this one are forgotten.
    since: usize,
}

impl LostStepsWatch {
    /// `None` for a station without linear stage, or with one that moves along the view.
    pub fn new(calibration: &Calibration) -> Option<Self> {
        let Some(Stage::Linear(stage)) = calibration.stage else { return None };
        let along = stage.direction;
        let depth = (Vector3::z() - along * along.z).try_normalize(1e-3)?;
        let range = calibration.depth_range_mm;
        let column_mm = 0.5 * (range.near_mm + range.far_mm) / calibration.camera.fx_px;
        let width_mm = column_mm * calibration.camera.width_px.max(calibration.camera.height_px) as f64;
        let bin_mm = column_mm * BIN_COLUMNS as f64;
        // The far end of the range shows more than its middle.
        let n_bins = (2.0 * width_mm / bin_mm).ceil() as usize;
        let orders = calibration.orders.clone();
        let surfaces = vec![vec![Vec::new(); n_bins]; orders.len()];
        Some(Self {
            orders,
            axes: [along, depth.cross(&along), depth],
            bin_mm,
            surfaces,
            positions_mm: Vec::new(),
            evidence: VecDeque::new(),
            n_frames: 0,
            since: 0,
        })
    }

    /// Takes note of the next frame, taken where the stage said `position_mm`; steps that it shows to be lost. What was
    /// seen before them is forgotten then.
    pub fn note(&mut self, profile: &Profile, position_mm: f64) -> Option<LostSteps> {
        let frame = self.n_frames;
        self.n_frames += 1;
        self.positions_mm.push(position_mm);
        let samples: Vec<Vec<(usize, Sample)>> =
            self.orders.iter().map(|order| self.samples(profile, *order, position_mm, frame)).collect();
        for (order, seen) in samples.iter().enumerate() {
            for other in (0..self.orders.len()).filter(|other| *other != order) {
                let pair = order * self.orders.len() + other;
                self.evidence.extend(self.held_against(seen, other, (frame, pair)));
            }
        }
        for (order, seen) in samples.into_iter().enumerate() {
            for (bin, sample) in seen {
                self.surfaces[order][bin].push(sample);
            }
        }
        let oldest = frame.saturating_sub(REACH_FRAMES + BASELINE_FRAMES);
        while self.evidence.front().is_some_and(|evidence| evidence.frame < oldest) {
            self.evidence.pop_front();
        }
        let found = self.likeliest_jump(frame);
        if let Some(found) = &found {
            self.since = found.first_frame;
            self.evidence.clear();
            let since = self.since;
            let forget = |samples: &mut Vec<Sample>| samples.retain(|sample| sample.frame >= since);
            self.surfaces.iter_mut().flatten().for_each(forget);
        }
        found
    }

    /// One order's line, condensed to the bins that it fills.
    fn samples(&self, profile: &Profile, order: i8, position_mm: f64, frame: usize) -> Vec<(usize, Sample)> {
        let n_bins = self.surfaces.first().map_or(0, Vec::len);
        let [along, across, depth] = &self.axes;
        let place = |point: &ProfilePoint| {
            let hit = &point.hit_in_camera.xyz;
            (hit.dot(across), hit.dot(along) - position_mm, hit.dot(depth))
        };
        let bin_of = |across_mm: f64| {
            let bin = (across_mm / self.bin_mm).floor() + (n_bins / 2) as f64;
            (bin >= 0.0 && bin < n_bins as f64).then_some(bin as usize)
        };
        let mut bins: Vec<(usize, Vec<[f64; 3]>)> = Vec::new();
        for point in profile.points.iter().filter(|point| point.order == order) {
            let (across_mm, along_mm, depth_mm) = place(point);
            let Some(bin) = bin_of(across_mm) else { continue };
            let from_middle = across_mm - (bin as f64 - (n_bins / 2) as f64 + 0.5) * self.bin_mm;
            match bins.last_mut() {
                Some((last, points)) if *last == bin => points.push([from_middle, along_mm, depth_mm]),
                _ => bins.push((bin, vec![[from_middle, along_mm, depth_mm]])),
            }
        }
        let condensed = |(bin, points): (usize, Vec<[f64; 3]>)| {
            let (along_mm, _) = at_middle(&points, 1)?;
            let (depth_mm, spread_mm) = at_middle(&points, 2)?;
            // A bin across an edge holds two surfaces.
            (spread_mm < 0.1 * self.bin_mm).then_some((bin, Sample { frame, along_mm, depth_mm }))
        };
        bins.into_iter().filter_map(condensed).collect()
    }

    /// How far a frame of one order lags behind the surface of `other`, by a line of differences over slopes.
    fn held_against(
        &self,
        seen: &[(usize, Sample)],
        other: usize,
        (frame, pair): (usize, usize),
    ) -> Option<Evidence> {
        let mut differences: Vec<[f64; 2]> = Vec::with_capacity(seen.len());
        let mut reference = 0;
        for (bin, sample) in seen {
            if let Some((depth_mm, slope, last)) = surface_at(&self.surfaces[other][*bin], sample.along_mm) {
                differences.push([slope, sample.depth_mm - depth_mm]);
                reference = reference.max(last);
            }
        }
        let (slope, constant, scatter) = line_through(&differences)?;
        differences.retain(|[x, y]| (y - constant - slope * x).abs() <= OUTLIER_SIGMAS * scatter);
        if differences.len() < FEWEST_DIFFERENCES {
            return None;
        }
        let (lag_mm, _, scatter) = line_through(&differences)?;
        let mean = differences.iter().map(|[x, _]| x).sum::<f64>() / differences.len() as f64;
        let spread: f64 = differences.iter().map(|[x, _]| (x - mean).powi(2)).sum();
        Some(Evidence { frame, reference, pair, lag_mm, variance: scatter.powi(2) / spread })
    }

    /// The jump that explains the last frames best, if it is beyond doubt.
    fn likeliest_jump(&self, frame: usize) -> Option<LostSteps> {
        let earliest = (self.since + FEWEST_FRAMES).max((frame + 1).saturating_sub(REACH_FRAMES));
        let latest = (frame + 1).checked_sub(FEWEST_FRAMES)?;
        let jumps = (earliest..=latest).filter_map(|first_frame| {
            let (lag_mm, sigma_mm) = self.step_at(first_frame)?;
            Some(LostSteps {
                first_frame,
                noticed_frame: frame,
                position_mm: self.positions_mm[first_frame],
                lag_mm,
                sigma_mm,
            })
        });
        let clear =
            |jump: &LostSteps| jump.lag_mm.abs() >= ALARM_MM && jump.lag_mm.abs() >= ALARM_SIGMAS * jump.sigma_mm;
        let sigmas = |jump: &LostSteps| jump.lag_mm.abs() / jump.sigma_mm;
        jumps.filter(clear).max_by(|a, b| sigmas(a).total_cmp(&sigmas(b)))
    }

    /// The step of the lag at a frame and its standard deviation, over all pairs of orders.
    fn step_at(&self, first_frame: usize) -> Option<(f64, f64)> {
        let n_pairs = self.orders.len() * self.orders.len();
        let (mut before, mut after) = (vec![Mean::default(); n_pairs], vec![Mean::default(); n_pairs]);
        for evidence in &self.evidence {
            if evidence.frame < first_frame {
                before[evidence.pair].add(evidence);
            } else if evidence.reference < first_frame {
                after[evidence.pair].add(evidence);
            }
        }
        let (mut weighted, mut weight) = (0.0, 0.0);
        for (before, after) in before.iter().zip(&after) {
            let (Some((was_mm, was_variance)), Some((is_mm, is_variance))) = (before.value(), after.value())
            else {
                continue;
            };
            let variance = was_variance + is_variance;
            weighted += (is_mm - was_mm) / variance;
            weight += 1.0 / variance;
        }
        (weight > 0.0).then(|| (weighted / weight, (1.0 / weight).sqrt() * NOISE_INFLATION))
    }
}

/// The mean of evidence of one pair.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    n: usize,
    weighted: f64,
    weight: f64,
}

impl Mean {
    fn add(&mut self, evidence: &Evidence) {
        self.n += 1;
        self.weighted += evidence.lag_mm / evidence.variance;
        self.weight += 1.0 / evidence.variance;
    }

    fn value(&self) -> Option<(f64, f64)> {
        (self.n >= FEWEST_FRAMES).then(|| (self.weighted / self.weight, 1.0 / self.weight))
    }
}

/// Coordinate `which` in the middle of a bin by a straight line across it, and how far points scatter about that line;
/// `None` for a bin that is not filled.
fn at_middle(points: &[[f64; 3]], which: usize) -> Option<(f64, f64)> {
    if 4 * points.len() < 3 * BIN_COLUMNS {
        return None;
    }
    let pairs: Vec<[f64; 2]> = points.iter().map(|point| [point[0], point[which]]).collect();
    let (_, constant, scatter) = line_through(&pairs)?;
    Some((constant, scatter))
}

/// Slope, constant and scatter of the straight line through points; `None` for fewer than three, or all at one place.
fn line_through(points: &[[f64; 2]]) -> Option<(f64, f64, f64)> {
    let n = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
    let (mean_x, mean_y) =
        (points.iter().map(|p| p[0]).sum::<f64>() / n, points.iter().map(|p| p[1]).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|p| (p[0] - mean_x).powi(2)).sum();
    if spread <= f64::EPSILON {
        return None;
    }
    let slope = points.iter().map(|p| (p[0] - mean_x) * (p[1] - mean_y)).sum::<f64>() / spread;
    let constant = mean_y - slope * mean_x;
    let squares: f64 = points.iter().map(|p| (p[1] - constant - slope * p[0]).powi(2)).sum();
    Some((slope, constant, (squares / (n - 2.0)).sqrt()))
}

/// Depth and slope of a surface at a place along the travel, and the last frame that they stand on; `None` where it is not
/// smooth, or was not seen.
fn surface_at(samples: &[Sample], along_mm: f64) -> Option<(f64, f64, usize)> {
    let (first, last) = (samples.first()?, samples.last()?);
    let rising = last.along_mm > first.along_mm;
    let is_before = |sample: &Sample| (sample.along_mm < along_mm) == rising;
    let after = samples.partition_point(is_before);
    let around = samples.get(after.checked_sub(2)?..after + 2)?;
    let [a, b, c, d] = around else { return None };
    // Frames that follow each other, so that nothing lies between.
    if d.frame != a.frame + 3 {
        return None;
    }
    let slope_of = |from: &Sample, to: &Sample| (to.depth_mm - from.depth_mm) / (to.along_mm - from.along_mm);
    let (middle, slope) = (slope_of(b, c), slope_of(a, d));
    let is_smooth = [slope_of(a, b), middle, slope_of(c, d)].iter().all(|one| (one - slope).abs() <= MAX_SLOPE);
    if !(is_smooth && slope.abs() <= MAX_SLOPE) {
        return None;
    }
    Some((b.depth_mm + middle * (along_mm - b.along_mm), slope, d.frame))
}
