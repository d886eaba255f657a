//! The lost-step watch: detects that the stage is not at its stated position from some frame on.
//!
//! Each order observes a point of the part at another position of the stage. While the stage is at its stated
//! position, the surfaces of all orders coincide. After a loss of δ along the travel, surface observed from then
//! on is shifted by δ relative to what the other orders observed before: on a slope g of depth along the travel
//! the difference in depth is g·δ, and without a slope it is zero.
//!
//! Method, frame by frame: every line is reduced to one position and depth in each of some columns; each is
//! compared with the surface that every other order observed earlier, minus the baseline difference of the two in
//! that column; a straight line fitted to difference over slope gives δ of this frame and pair with its variance.
//! Then, for every frame of the last [`DETECTION_FRAMES`] as a possible jump: the mean of δ since then, against
//! surface observed before it, minus the mean before it, in its standard deviations (a generalised likelihood
//! ratio test for a step in known noise).
//!
//! Blind on plates and on ramps of constant slope, and before two orders have observed the same surface for some
//! frames.

use std::collections::VecDeque;

use optics::{Calibration, Stage, StagePosition};
use statistics::median;

use crate::params::lost_steps::{
    ALARM_RELATIVE, ALARM_SIGMAS, BASELINE_FRAMES, BLIND_RELATIVE, DETECTION_FRAMES, MIN_BASELINE_DIFFERENCES,
    MIN_DIFFERENCES, MIN_FRAMES, MIN_SLOPE_SPREAD, NOISE_INFLATION, OUTLIER_SIGMAS,
};
use crate::points::profile::Profile;
use crate::watches::samples::{FrameSamples, LineSampler, Sample, line_through, surface_at};

/// Lost steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LostSteps {
    /// The first frame, counted from 0, at which the stage was not at its stated position; known to a few frames.
    pub first_frame: usize,
    /// The frame at which the loss was detected.
    pub detected_frame: usize,
    /// The stated stage position at `first_frame`, mm.
    pub position_mm: f64,
    /// Lag behind the stated position since then, mm.
    pub lag_mm: f64,
    /// Standard deviation of `lag_mm`.
    pub sigma_mm: f64,
}

/// The lag of one frame of one order relative to the surface of another.
#[derive(Debug, Clone, Copy)]
struct Evidence {
    frame: usize,
    /// The last frame of the surface used.
    reference: usize,
    pair: usize,
    lag_mm: f64,
    variance: f64,
}

/// Depth of an order relative to the surface of another in a bin.
#[derive(Debug, Clone, Copy)]
struct DepthDifference {
    bin: usize,
    slope: f64,
    depth_mm: f64,
    /// The last frame of the surface used.
    reference: usize,
}

/// Recent depth differences of a pair of orders in a bin, as the baseline of later ones.
#[derive(Debug, Clone, Default)]
struct Baseline(VecDeque<(usize, f64)>);

impl Baseline {
    fn note(&mut self, frame: usize, depth_mm: f64) {
        self.0.push_back((frame, depth_mm));
        let oldest = frame.saturating_sub(DETECTION_FRAMES + BASELINE_FRAMES);
        while self.0.front().is_some_and(|(at, _)| *at < oldest) {
            self.0.pop_front();
        }
    }

    /// Their mean, without the last [`DETECTION_FRAMES`] before `frame`, which may contain a jump; `None` if there
    /// are too few.
    fn mean(&self, frame: usize) -> Option<f64> {
        let (mut n, mut sum) = (0, 0.0);
        for (_, depth_mm) in self.0.iter().take_while(|(at, _)| at + DETECTION_FRAMES <= frame) {
            n += 1;
            sum += depth_mm;
        }
        (n >= MIN_BASELINE_DIFFERENCES).then(|| sum / f64::from(n))
    }
}

/// The watch; it needs every frame of a scan in the order of travel.
#[derive(Debug)]
pub struct LostStepsWatch {
    sampler: LineSampler,
    stage: Stage,
    /// Depth in the middle of the calibrated range.
    depth_mm: f64,
    /// Surface of each order by bin; samples in the order of travel.
    surfaces: Vec<Vec<Vec<Sample>>>,
    /// Baseline differences of pairs of orders, by pair, then bin.
    baselines: Vec<Vec<Baseline>>,
    positions_mm: Vec<f64>,
    evidence: VecDeque<Evidence>,
    /// Standard deviations of the steps searched for [`DETECTION_FRAMES`] / 2 before each frame.
    sigmas_mm: Vec<f64>,
    n_frames: usize,
    /// Frames before this one are ignored.
    since: usize,
}

impl LostStepsWatch {
    /// `None` for a station without a linear stage, or with one that moves along the view.
    pub fn new(calibration: &Calibration) -> Option<Self> {
        let sampler = LineSampler::new(calibration)?;
        let surfaces = vec![vec![Vec::new(); sampler.n_bins]; sampler.orders.len()];
        let baselines = vec![vec![Baseline::default(); sampler.n_bins]; sampler.orders.len().pow(2)];
        Some(Self {
            sampler,
            baselines,
            stage: calibration.stage?,
            depth_mm: calibration.depth_range_mm.middle_mm(),
            surfaces,
            positions_mm: Vec::new(),
            evidence: VecDeque::new(),
            sigmas_mm: Vec::new(),
            n_frames: 0,
            since: 0,
        })
    }

    /// Adds the next frame, with its stated stage position, and returns a loss if one is detected. Observations
    /// before the loss are then discarded.
    pub fn note(&mut self, profile: &Profile, position_mm: f64) -> Option<LostSteps> {
        let motion = self.stage.motion(StagePosition::LinearMm(position_mm))?;
        let samples = self.sampler.samples(&profile.points, &motion, position_mm, self.n_frames);
        self.note_samples(samples, position_mm)
    }

    /// [`LostStepsWatch::note`] for a frame that is already reduced to samples.
    pub(crate) fn note_samples(&mut self, samples: FrameSamples, position_mm: f64) -> Option<LostSteps> {
        let frame = self.n_frames;
        self.n_frames += 1;
        self.positions_mm.push(position_mm);
        let n_orders = self.sampler.orders.len();
        for (order, of_order) in samples.iter().enumerate() {
            for other in (0..n_orders).filter(|other| *other != order) {
                let pair = order * n_orders + other;
                let differences = self.differences(of_order, other);
                self.evidence.extend(self.lag_evidence(&differences, (frame, pair)));
                for difference in differences {
                    self.baselines[pair][difference.bin].note(frame, difference.depth_mm);
                }
            }
        }
        for (order, of_order) in samples.into_iter().enumerate() {
            for (bin, sample) in of_order {
                self.surfaces[order][bin].push(sample);
            }
        }
        let oldest = frame.saturating_sub(DETECTION_FRAMES + BASELINE_FRAMES);
        while self.evidence.front().is_some_and(|evidence| evidence.frame < oldest) {
            self.evidence.pop_front();
        }
        let middle = (frame + 1).checked_sub(DETECTION_FRAMES / 2);
        self.sigmas_mm.extend(middle.and_then(|at| self.step_at(at)).map(|(_, sigma_mm)| sigma_mm));
        let found = self.likeliest_jump(frame);
        if let Some(found) = &found {
            self.since = found.first_frame;
            self.evidence.clear();
            self.baselines.iter_mut().flatten().for_each(|baseline| baseline.0.clear());
            let since = self.since;
            let drop_older = |samples: &mut Vec<Sample>| samples.retain(|sample| sample.frame >= since);
            self.surfaces.iter_mut().flatten().for_each(drop_older);
        }
        found
    }

    /// Depths of one order relative to the surface of `other`, bin by bin.
    fn differences(&self, of_order: &[(usize, Sample)], other: usize) -> Vec<DepthDifference> {
        let difference = |(bin, sample): &(usize, Sample)| {
            let place = surface_at(&self.surfaces[other][*bin], sample.along_mm)?;
            let depth_mm = sample.depth_mm - place.depth_mm;
            Some(DepthDifference { bin: *bin, slope: place.slope, depth_mm, reference: place.last_frame })
        };
        of_order.iter().filter_map(difference).collect()
    }

    /// Lag of a frame of one order behind the surface of another, from a line fitted to differences over slopes.
    /// The baseline difference in a bin is subtracted: errors of the calibration are constant in the image while
    /// the part moves.
    fn lag_evidence(&self, found: &[DepthDifference], (frame, pair): (usize, usize)) -> Option<Evidence> {
        let mut reference = 0;
        let mut differences: Vec<[f64; 2]> = Vec::with_capacity(found.len());
        for difference in found {
            let Some(baseline_mm) = self.baselines[pair][difference.bin].mean(frame) else { continue };
            differences.push([difference.slope, difference.depth_mm - baseline_mm]);
            reference = reference.max(difference.reference);
        }
        let (slope, constant, scatter) = line_through(&differences)?;
        differences.retain(|[x, y]| (y - constant - slope * x).abs() <= OUTLIER_SIGMAS * scatter);
        if differences.len() < MIN_DIFFERENCES {
            return None;
        }
        let (lag_mm, _, scatter) = line_through(&differences)?;
        let mean = differences.iter().map(|[x, _]| x).sum::<f64>() / differences.len() as f64;
        let spread: f64 = differences.iter().map(|[x, _]| (x - mean).powi(2)).sum();
        if spread < MIN_SLOPE_SPREAD.powi(2) * differences.len() as f64 {
            return None;
        }
        Some(Evidence { frame, reference, pair, lag_mm, variance: scatter.powi(2) / spread })
    }

    /// The smallest loss that would have been detected in most frames, mm; `None` if it is large or known for too
    /// few frames: no slopes, or too little overlap of the orders.
    pub fn smallest_detectable_mm(&self) -> Option<f64> {
        if self.sigmas_mm.len() < DETECTION_FRAMES {
            return None;
        }
        let alarm_mm = ALARM_RELATIVE * self.depth_mm;
        let smallest_mm =
            median(&mut self.sigmas_mm.clone()).map(|sigma_mm| alarm_mm.max(ALARM_SIGMAS * sigma_mm));
        smallest_mm.filter(|smallest_mm| *smallest_mm <= BLIND_RELATIVE * self.depth_mm)
    }

    /// The jump that best explains the last frames, if it is significant.
    fn likeliest_jump(&self, frame: usize) -> Option<LostSteps> {
        let earliest = (self.since + MIN_FRAMES).max((frame + 1).saturating_sub(DETECTION_FRAMES));
        let latest = (frame + 1).checked_sub(MIN_FRAMES)?;
        let jumps = (earliest..=latest).filter_map(|first_frame| {
            let (lag_mm, sigma_mm) = self.step_at(first_frame)?;
            Some(LostSteps {
                first_frame,
                detected_frame: frame,
                position_mm: self.positions_mm[first_frame],
                lag_mm,
                sigma_mm,
            })
        });
        let alarm_mm = ALARM_RELATIVE * self.depth_mm;
        let clear =
            |jump: &LostSteps| jump.lag_mm.abs() >= alarm_mm && jump.lag_mm.abs() >= ALARM_SIGMAS * jump.sigma_mm;
        let sigmas = |jump: &LostSteps| jump.lag_mm.abs() / jump.sigma_mm;
        jumps.filter(clear).max_by(|a, b| sigmas(a).total_cmp(&sigmas(b)))
    }

    /// The step of the lag at a frame and its standard deviation, over all pairs of orders.
    fn step_at(&self, first_frame: usize) -> Option<(f64, f64)> {
        let n_pairs = self.sampler.orders.len().pow(2);
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
            let (Some((before_mm, before_variance)), Some((after_mm, after_variance))) =
                (before.value(), after.value())
            else {
                continue;
            };
            // If lags scatter more than stated, so do their means.
            let variance = (before_variance + after_variance) * before.excess(after);
            weighted += (after_mm - before_mm) / variance;
            weight += 1.0 / variance;
        }
        (weight > 0.0).then(|| (weighted / weight, (1.0 / weight).sqrt() * NOISE_INFLATION))
    }
}

/// The mean of the evidence of one pair.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    n: usize,
    weighted: f64,
    weight: f64,
    squares: f64,
}

impl Mean {
    fn add(&mut self, evidence: &Evidence) {
        self.n += 1;
        self.weighted += evidence.lag_mm / evidence.variance;
        self.weight += 1.0 / evidence.variance;
        self.squares += evidence.lag_mm.powi(2) / evidence.variance;
    }

    /// Ratio of the scatter about this mean and another to the stated one, at least 1.
    fn excess(&self, other: &Self) -> f64 {
        let chi_square = |mean: &Self| mean.squares - mean.weighted.powi(2) / mean.weight;
        let degrees_of_freedom = (self.n + other.n).saturating_sub(2).max(1);
        ((chi_square(self) + chi_square(other)) / degrees_of_freedom as f64).max(1.0)
    }

    fn value(&self) -> Option<(f64, f64)> {
        (self.n >= MIN_FRAMES).then(|| (self.weighted / self.weight, 1.0 / self.weight))
    }
}
