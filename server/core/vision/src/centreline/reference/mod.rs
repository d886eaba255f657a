//! The straightforward extraction: every step over the whole image, one crossing at a time.
//!
//! The fast one is compared with it. Noise map → typical line width → candidates (a box brighter than both flanks)
//! → traces linked column by column → one crossing per column by Gaussian derivatives → scatter of the crossings →
//! local parabolas along the line. It also holds the classic centroid, which nobody needs to be fast.

pub mod along;
pub mod candidates;
pub mod crossing;
pub mod ends;
pub mod noise;
pub mod scatter;
pub mod segments;
pub mod steger;
pub mod traces;
pub mod width;

use super::view::{Level, View};
use super::{CentrelineMethod, CentrelinePoint, Centrelines, LineDirection, Segment};
use crate::params::MIN_SEGMENT_COLUMNS;
use along::{Averaged, Averager};
use candidates::{Boxes, find_candidates};
use crossing::{Crossing, Measurer};
use ends::{without_bent_ends, without_faded_ends};
use noise::NoiseMap;
use scatter::{Differences, Scatter};
use segments::{Linker, mark_clearances};
use steger::Kernels;
use width::typical_width_px;

/// Finds the lines of one image, by either method.
pub fn extract<T: Level>(view: View<T>, method: CentrelineMethod) -> Centrelines {
    let pixel_noise = NoiseMap::of_pixels(&view);
    let width_px = typical_width_px(&view, &pixel_noise);
    let boxes = Boxes::for_width(width_px);
    let box_noise = NoiseMap::of_boxes(&view, boxes, &pixel_noise);
    let candidates = find_candidates(&view, &box_noise, boxes, width_px);
    let mut linker = Linker::default();
    let traces = linker.link(&candidates, width_px);
    mark_clearances(traces);
    let kernels = Kernels::new();
    let measurer = Measurer { view, noise: &pixel_noise, boxes, width_px, method, kernels: &kernels };
    let lines: Vec<Vec<Crossing>> = traces.iter().flat_map(|trace| pieces(&measurer.measure(trace))).collect();
    described(&lines, width_px, method, &kernels)
}

/// Cuts measured steps where the line is missing, and its blurred ends off.
pub fn pieces(steps: &[Option<Crossing>]) -> Vec<Vec<Crossing>> {
    steps
        .split(Option::is_none)
        .map(|run| run.iter().flatten().copied().collect::<Vec<_>>())
        .map(|run| run[without_faded_ends(&run.as_slice())].to_vec())
        .filter(|piece| piece.len() >= MIN_SEGMENT_COLUMNS)
        .collect()
}

fn described(lines: &[Vec<Crossing>], width_px: f32, method: CentrelineMethod, kernels: &Kernels) -> Centrelines {
    let along_variance_px2 = match method {
        CentrelineMethod::Steger => f64::from(kernels.along_variance_px2()),
        CentrelineMethod::CentreOfGravity => 0.0,
    };
    let each = lines.iter().map(Vec::as_slice);
    let scatter = Scatter::measure(each, along_variance_px2.sqrt(), &mut Differences::default());
    let averager = Averager::new(width_px, &scatter, along_variance_px2);
    let mut gains = Vec::new();
    let mut segments = Vec::with_capacity(lines.len());
    for line in lines {
        let line = &line[without_bent_ends(&line.as_slice(), &scatter)];
        let averaged = averager.average(line, &scatter);
        let points = line.iter().zip(&averaged).map(|(crossing, fit)| {
            let raw_variance = scatter.variance(crossing);
            match method {
                CentrelineMethod::Steger => {
                    gains.push(raw_variance / fit.variance);
                    point(crossing, fit)
                }
                CentrelineMethod::CentreOfGravity => {
                    gains.push(1.0);
                    point(crossing, &Averaged { v: crossing.v, variance: raw_variance, ..*fit })
                }
            }
        });
        segments.push(Segment { points: points.collect() });
    }
    // A fit that keeps the mean keeps the noise at long waves: variance × correlation length is conserved.
    let gain = median(&mut gains).unwrap_or(1.0);
    let correlation_px = (gain * scatter.correlation_px()).max(1.0);
    Centrelines { segments, direction: LineDirection::Rows, correlation_px }
}

/// A crossing as the averaging along the line places it.
pub fn point(crossing: &Crossing, fit: &Averaged) -> CentrelinePoint {
    let across = 1.0 / (1.0 + fit.slope * fit.slope).sqrt();
    CentrelinePoint {
        u_px: crossing.u as f64,
        v_px: fit.v,
        normal: [-fit.slope * across, across],
        sigma_px: fit.variance.sqrt() * across,
        intensity: crossing.intensity,
        width_px: crossing.width_px * across as f32,
        saturated: crossing.saturated,
    }
}

/// Median; `None` of nothing.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
