//! The lost-step watch: detects that the stage is not at its stated position from some frame on.
//!
//! Each order observes a point of the part at another position of the stage. While the stage is at its stated
//! position, the surfaces of all orders coincide. After a loss of δ along the travel, surface observed from then
//! on is shifted by δ relative to what the other orders observed before: on a slope g of depth along the travel
//! the difference in depth is g·δ, and without a slope it is zero.
//!
//! Method: every line is reduced to one position and depth in each of some columns, and compared with the surfaces that
//! the other orders observed earlier. Then, for every frame of the last [`DETECTION_FRAMES`] as a possible jump, δ is fitted
//! to all differences of the last frames, together with what is constant: deviations of the orders in each bin, and the
//! stage's scale. The largest δ in its standard deviations decides (a generalised likelihood ratio test), where these are
//! estimated from the scatter of the differences. `docs/maths/lost-steps.md`.
//!
//! Blind on plates and on ramps of constant slope, and before two orders have observed the same surface for some
//! frames.

mod series;
mod step;

use optics::{Calibration, Stage};
use statistics::median;

use crate::params::lost_steps::{
    ALARM_RELATIVE, ALARM_SIGMAS, BASELINE_FRAMES, BLIND_RELATIVE, DESIGN_EFFECT_PRIOR,
    DESIGN_EFFECT_PRIOR_FRAMES, DETECTION_FRAMES, MIN_DIFFERENCES, MIN_FRAMES, OUTLIER_SIGMAS, OWN_VARIANCE_SHARE,
    SCATTER_WIDENING,
};
use crate::params::watches::CLUSTER_TRAVEL_BINS;
use crate::watches::samples::{FrameReducer, FrameSamples, LineSampler, Sample, line_through, surface_at};
use series::{Difference, Series};
use step::{Step, Steps};

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

/// Depth of an order relative to the surface of another in a bin.
#[derive(Debug, Clone, Copy)]
struct Place {
    bin: usize,
    difference: Difference,
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
    /// Differences of pairs of orders, by pair, then bin.
    pairs: Vec<Vec<Series>>,
    positions_mm: Vec<f64>,
    /// Standard deviations of the steps searched for [`DETECTION_FRAMES`] / 2 before each frame.
    sigmas_mm: Vec<f64>,
    /// Sum of the design effects of these steps, and their number.
    design_effects: f64,
    n_design_effects: f64,
    n_frames: usize,
    /// Frames before this one are ignored.
    since: usize,
}

impl LostStepsWatch {
    /// `None` for a station without a linear stage, or with one that moves along the view.
    pub fn new(calibration: &Calibration) -> Option<Self> {
        let sampler = LineSampler::new(calibration)?;
        let surfaces = vec![vec![Vec::new(); sampler.n_bins]; sampler.orders.len()];
        let pairs = vec![vec![Series::default(); sampler.n_bins]; sampler.orders.len().pow(2)];
        Some(Self {
            sampler,
            pairs,
            stage: calibration.stage?,
            depth_mm: calibration.depth_range_mm.middle_mm(),
            surfaces,
            positions_mm: Vec::new(),
            sigmas_mm: Vec::new(),
            design_effects: 0.0,
            n_design_effects: 0.0,
            n_frames: 0,
            since: 0,
        })
    }

    /// Reduces the frames of a scan for [`LostStepsWatch::note`].
    pub fn reducer(&self) -> FrameReducer {
        FrameReducer { sampler: self.sampler.clone(), stage: self.stage, n_frames: self.n_frames }
    }

    /// Adds the next frame, with its stated stage position, and returns a loss if one is detected. Observations
    /// before the loss are then discarded.
    pub fn note(&mut self, samples: FrameSamples, position_mm: f64) -> Option<LostSteps> {
        let frame = self.n_frames;
        self.n_frames += 1;
        self.positions_mm.push(position_mm);
        for (order, of_order) in samples.iter().enumerate() {
            self.note_differences(order, of_order);
        }
        for (order, of_order) in samples.into_iter().enumerate() {
            for (bin, sample) in of_order {
                self.surfaces[order][bin].push(sample);
            }
        }
        let oldest = oldest_frame(frame);
        self.pairs.iter_mut().flatten().for_each(|series| series.forget_before(oldest));
        let found = self.judge(frame);
        if let Some(found) = &found {
            self.since = found.first_frame;
            self.pairs.iter_mut().flatten().for_each(|series| *series = Series::default());
            let since = self.since;
            let drop_older = |samples: &mut Vec<Sample>| samples.retain(|sample| sample.frame >= since);
            self.surfaces.iter_mut().flatten().for_each(drop_older);
        }
        found
    }

    /// Adds the differences of a line from the surfaces of all other orders.
    fn note_differences(&mut self, order: usize, of_order: &[(usize, Sample)]) {
        let n_orders = self.sampler.orders.len();
        let mut places: Vec<(usize, Place)> = Vec::new();
        for other in (0..n_orders).filter(|other| *other != order) {
            let pair = order * n_orders + other;
            places.extend(
                self.comparable(self.places(of_order, other), pair).into_iter().map(|place| (pair, place)),
            );
        }
        let mut n_surfaces = vec![0.0; self.sampler.n_bins];
        for (_, place) in &places {
            n_surfaces[place.bin] += 1.0;
        }
        for (pair, Place { bin, difference }) in places {
            let weight = 2.0 / (n_surfaces[bin] + 1.0);
            self.pairs[pair][bin].push(Difference { weight, ..difference });
        }
    }

    /// Adds the standard deviation of the step [`DETECTION_FRAMES`] / 2 before a frame to those of the scan, and looks for
    /// a significant one.
    fn judge(&mut self, frame: usize) -> Option<LostSteps> {
        let steps = Steps::new(&self.pairs, self.sampler.orders.len(), self.depth_mm)?;
        let in_the_middle = (frame + 1).checked_sub(DETECTION_FRAMES / 2).and_then(|at| steps.at(at));
        let of_step =
            in_the_middle.and_then(|step| Some((step.independent_sigma_mm(), self.design_effect(&step)?)));
        if let Some((independent_mm, own)) = of_step {
            self.design_effects += own;
            self.n_design_effects += 1.0;
            self.sigmas_mm.push(independent_mm * self.widening(own));
        }
        self.likeliest_jump(&steps, frame)
    }

    /// Depths of one order relative to the surface of `other`, bin by bin.
    fn places(&self, of_order: &[(usize, Sample)], other: usize) -> Vec<Place> {
        let place = |(bin, sample): &(usize, Sample)| {
            let surface = surface_at(&self.surfaces[other][*bin], sample.along_mm)?;
            let difference = Difference {
                frame: sample.frame,
                reference: surface.last_frame,
                travel_mm: sample.position_mm - surface.position_mm,
                slope: surface.slope,
                depth_mm: sample.depth_mm - surface.depth_mm,
                weight: 1.0,
            };
            Some(Place { bin: *bin, difference })
        };
        of_order.iter().filter_map(place).collect()
    }

    /// Those on the same surface, relative to the mean of the frame: a common change of depth is not a lag.
    fn comparable(&self, mut places: Vec<Place>, pair: usize) -> Vec<Place> {
        let points = |places: &[Place]| -> Vec<[f64; 2]> {
            let depth_mm =
                |place: &Place| place.difference.depth_mm - self.pairs[pair][place.bin].mean_mm().unwrap_or(0.0);
            places.iter().map(|place| [place.difference.slope, depth_mm(place)]).collect()
        };
        let Some((slope, constant, scatter)) = line_through(&points(&places)) else { return Vec::new() };
        let residuals: Vec<f64> = points(&places).iter().map(|[x, y]| (y - constant - slope * x).abs()).collect();
        let mut kept = residuals.iter().map(|residual| *residual <= OUTLIER_SIGMAS * scatter);
        places.retain(|_| kept.next().unwrap_or(false));
        if places.len() < MIN_DIFFERENCES {
            return Vec::new();
        }
        let n = places.len() as f64;
        let slope = places.iter().map(|place| place.difference.slope).sum::<f64>() / n;
        let depth_mm = places.iter().map(|place| place.difference.depth_mm).sum::<f64>() / n;
        for Place { difference, .. } in &mut places {
            difference.slope -= slope;
            difference.depth_mm -= depth_mm;
        }
        places
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
    fn likeliest_jump(&self, steps: &Steps<'_>, frame: usize) -> Option<LostSteps> {
        let earliest = (self.since + MIN_FRAMES).max((frame + 1).saturating_sub(DETECTION_FRAMES));
        let latest = (frame + 1).checked_sub(MIN_FRAMES)?;
        let alarm_mm = ALARM_RELATIVE * self.depth_mm;
        let is_blind = |sigma_mm: f64| ALARM_SIGMAS * sigma_mm > BLIND_RELATIVE * self.depth_mm;
        let jumps = (earliest..=latest).filter_map(|first_frame| {
            let step = steps.at(first_frame)?;
            let is_clear =
                |sigma_mm: f64| step.lag_mm.abs() >= alarm_mm && step.lag_mm.abs() >= ALARM_SIGMAS * sigma_mm;
            // Its own scatter takes longer.
            if !is_clear(step.independent_sigma_mm() * self.widening(0.0)) {
                return None;
            }
            let sigma_mm = self.sigma_mm(&step).filter(|&sigma_mm| is_clear(sigma_mm) && !is_blind(sigma_mm))?;
            Some(LostSteps {
                first_frame,
                detected_frame: frame,
                position_mm: self.positions_mm[first_frame],
                lag_mm: step.lag_mm,
                sigma_mm,
            })
        });
        let sigmas = |jump: &LostSteps| jump.lag_mm.abs() / jump.sigma_mm;
        jumps.max_by(|a, b| sigmas(a).total_cmp(&sigmas(b)))
    }

    /// Standard deviation of a step; `None` if too few bins determine it.
    fn sigma_mm(&self, step: &Step<'_>) -> Option<f64> {
        Some(step.independent_sigma_mm() * self.widening(self.design_effect(step)?))
    }

    /// By how much the standard deviation of a step exceeds that of independent differences; `own`: its design effect.
    fn widening(&self, own: f64) -> f64 {
        let expected = DESIGN_EFFECT_PRIOR_FRAMES * DESIGN_EFFECT_PRIOR;
        let of_scan = (self.design_effects + expected) / (self.n_design_effects + DESIGN_EFFECT_PRIOR_FRAMES);
        SCATTER_WIDENING * of_scan.max(OWN_VARIANCE_SHARE * own).sqrt()
    }

    /// [`Step::design_effect`] in this scan.
    fn design_effect(&self, step: &Step<'_>) -> Option<f64> {
        let oldest = oldest_frame(self.n_frames - 1);
        step.design_effect((oldest, &self.positions_mm[oldest..]), CLUSTER_TRAVEL_BINS * self.sampler.bin_mm)
    }
}

/// The first frame whose differences are still known at a frame.
fn oldest_frame(frame: usize) -> usize {
    frame.saturating_sub(DETECTION_FRAMES + BASELINE_FRAMES)
}
