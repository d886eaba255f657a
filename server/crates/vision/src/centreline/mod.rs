//! Laser lines in an image to sub-pixel centrelines.
//!
//! Noise map → typical line width → candidates (a box brighter than both flanks) → traces linked column by column
//! → one crossing per column by Gaussian derivatives → scatter of the crossings → local parabolas along the line.
//! Positions are measured per column and averaged along the line afterwards, so that changes of intensity along the
//! line (the squares of a board) do not move it.

mod along;
mod candidates;
mod crossing;
mod ends;
mod noise;
mod scatter;
mod segments;
mod steger;
mod view;
mod width;

use crate::params::MIN_SEGMENT_COLUMNS;
use crate::{GreyImage, Pixels};
use along::{Averaged, Averager};
use candidates::{Boxes, find_candidates};
use crossing::{Crossing, Measurer};
use ends::{without_bent_ends, without_faded_ends};
use noise::NoiseMap;
use scatter::Scatter;
use segments::{link_traces, mark_clearances};
use steger::Kernels;
use view::{Level, View};
use width::typical_width_px;

/// Which way the laser lines run across the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LineDirection {
    /// Lines run along rows: one crossing per column and line.
    #[default]
    Rows,
    /// Lines run along columns: one crossing per row and line.
    Columns,
}

/// How the centre of a line is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CentrelineMethod {
    /// Gaussian derivatives, Hessian, offset along the normal (Steger 1998).
    #[default]
    Steger,
    /// Grey-level centroid, one scan column at a time: the classic.
    CentreOfGravity,
}

/// Settings of the extraction; the defaults serve any station.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CentrelineParams {
    /// How the centre is found.
    pub method: CentrelineMethod,
    /// Which way the lines run.
    pub line_direction: LineDirection,
}

/// One sub-pixel point on a laser line, in raw (distorted) sensor pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CentrelinePoint {
    /// Column.
    pub u_px: f64,
    /// Row.
    pub v_px: f64,
    /// Unit normal of the line in the image, (u, v).
    pub normal: [f64; 2],
    /// Predicted standard deviation of the position along `normal`.
    pub sigma_px: f64,
    /// Grey levels of the ridge above the local background.
    pub intensity: f32,
    /// Full width of the line at half its height, across the line.
    pub width_px: f32,
    /// Whether pixels of the line's cross-section were at full scale.
    pub saturated: bool,
}

/// A connected piece of one line: points ordered along the line (by column for [`LineDirection::Rows`],
/// by row for [`LineDirection::Columns`]), at most one per column (row), without gaps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Segment {
    /// The points, in order.
    pub points: Vec<CentrelinePoint>,
}

/// All the line pieces of one image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Centrelines {
    /// Connected pieces, ordered by their first point along the line, then across.
    pub segments: Vec<Segment>,
    /// Distance along the line, in scan columns (rows), over which neighbouring points share their noise:
    /// the mean of `n` neighbouring points has variance sigma² · min(1, correlation_px / n).
    pub correlation_px: f64,
}

/// Finds the centrelines of all laser lines in `image`.
///
/// An image without light gives no segments; that is not an error.
pub fn find_centrelines(image: &GreyImage, params: &CentrelineParams) -> Centrelines {
    match params.line_direction {
        LineDirection::Rows => along_rows(image, params.method),
        LineDirection::Columns => exchanged(along_rows(&image.transposed(), params.method)),
    }
}

fn along_rows(image: &GreyImage, method: CentrelineMethod) -> Centrelines {
    let (width, height, full_scale) = (image.width(), image.height(), image.full_scale());
    match image.pixels() {
        Pixels::Eight(pixels) => extract(View { pixels, width, height, full_scale }, method),
        Pixels::Sixteen(pixels) => extract(View { pixels, width, height, full_scale }, method),
    }
}

/// Rows become columns again.
fn exchanged(mut centrelines: Centrelines) -> Centrelines {
    for point in centrelines.segments.iter_mut().flat_map(|segment| &mut segment.points) {
        (point.u_px, point.v_px) = (point.v_px, point.u_px);
        point.normal.reverse();
    }
    centrelines
}

fn extract<T: Level>(view: View<T>, method: CentrelineMethod) -> Centrelines {
    let pixel_noise = NoiseMap::of_pixels(&view);
    let width_px = typical_width_px(&view, &pixel_noise);
    let boxes = Boxes::for_width(width_px);
    let box_noise = NoiseMap::of_boxes(&view, boxes, &pixel_noise);
    let candidates = find_candidates(&view, &box_noise, boxes, width_px);
    let mut traces = link_traces(&candidates, width_px);
    mark_clearances(&mut traces);
    let kernels = Kernels::new();
    let measurer = Measurer { view, noise: &pixel_noise, boxes, width_px, method, kernels: &kernels };
    let lines: Vec<Vec<Crossing>> = traces.iter().flat_map(|trace| pieces(&measurer.measure(trace))).collect();
    described(&lines, width_px, method, &kernels)
}

/// Cuts measured steps where the line is missing, and its blurred ends off.
fn pieces(steps: &[Option<Crossing>]) -> Vec<Vec<Crossing>> {
    steps
        .split(Option::is_none)
        .map(|run| run.iter().flatten().copied().collect::<Vec<_>>())
        .map(|run| without_faded_ends(&run).to_vec())
        .filter(|piece| piece.len() >= MIN_SEGMENT_COLUMNS)
        .collect()
}

fn described(lines: &[Vec<Crossing>], width_px: f32, method: CentrelineMethod, kernels: &Kernels) -> Centrelines {
    let along_variance_px2 = match method {
        CentrelineMethod::Steger => f64::from(kernels.along_variance_px2()),
        CentrelineMethod::CentreOfGravity => 0.0,
    };
    let scatter = Scatter::measure(lines, along_variance_px2.sqrt());
    let averager = Averager::new(width_px, &scatter, along_variance_px2);
    let mut gains = Vec::new();
    let mut segments = Vec::with_capacity(lines.len());
    for line in lines {
        let line = without_bent_ends(line, &scatter);
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
    Centrelines { segments, correlation_px: (gain * scatter.correlation_px()).max(1.0) }
}

fn point(crossing: &Crossing, fit: &Averaged) -> CentrelinePoint {
    let across = 1.0 / fit.slope.hypot(1.0);
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

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests;
