//! One crossing of a column and a line: position by either method, width, intensity, and what its noise is made of.

use super::candidates::Boxes;
use super::noise::NoiseMap;
use super::scatter::{LANES, ThirdDifferences};
use super::steger::{Approach, Kernels, Ridge, WIDTH_PER_SIGMA};
use super::traces::Trace;
use super::width::crossing_width_px;
use crate::centreline::CentrelineMethod;
use crate::centreline::view::{Level, View};
use crate::params::{
    BORDER_WIDTHS, CENTROID_HALF_HEIGHT_WIDTHS, CLEARANCE_KERNEL_WIDTH, CLEARANCE_MIN_WIDTHS, FLANK_STEP_EVEN,
    FLANK_STEP_MAX, LINK_GATE_MIN_PX,
};

/// A measured crossing.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// Column.
    pub u: usize,
    /// Row.
    pub v: f64,
    /// Variance from camera noise, px².
    pub camera_variance: f64,
    /// Variance per unit of squared speckle contrast times speckle grain, px².
    pub speckle_variance: f64,
    /// Variance along the column of the line's profile times the window that measured it, px².
    pub cross_variance_px2: f64,
    /// Grey levels above the background.
    pub intensity: f32,
    /// Full width at half height along the column.
    pub width_px: f32,
    /// Whether pixels near the centre are at full scale.
    pub saturated: bool,
}

/// Crossings of one line in neighbouring columns, however they are kept.
pub trait Line {
    /// Columns.
    fn n_columns(&self) -> usize;
    /// The crossing of the column `idx` columns after the first.
    fn at(&self, idx: usize) -> Crossing;
    /// Third differences at a lag that begin at `start` and at the columns after it, all inside of the line.
    fn third_differences(&self, start: usize, lag: usize) -> ThirdDifferences {
        let mut differences = ThirdDifferences::default();
        (0..LANES).for_each(|lane| differences.set(lane, self, start + lane, lag));
        differences
    }
}

impl Line for &[Crossing] {
    fn n_columns(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn at(&self, idx: usize) -> Crossing {
        self[idx]
    }
}

/// Settings and tools shared by all crossings of an image.
pub struct Measurer<'a, T> {
    /// The image.
    pub view: View<'a, T>,
    /// Its noise.
    pub noise: &'a NoiseMap,
    /// Detection boxes: where background is looked for.
    pub boxes: Boxes,
    /// Typical width of the lines.
    pub width_px: f32,
    /// How the centre is found.
    pub method: CentrelineMethod,
    /// Gaussian derivatives.
    pub kernels: &'a Kernels,
}

/// A centre as one of the methods found it.
struct Centre {
    /// Row.
    v: f64,
    /// Rows that entered.
    rows: std::ops::Range<usize>,
    /// What smoothing along the line leaves of the variance of white noise.
    white: f32,
    /// Movement per grey level and weight.
    gain: f32,
    /// Variance of the window across the line, px².
    window_variance_px2: f32,
}

/// Light beside a line in one column.
#[derive(Debug, Clone, Copy)]
struct Beside {
    above: f32,
    below: f32,
}

impl<T: Level> Measurer<'_, T> {
    /// Measures every step of a trace; `None` where no centre was found.
    pub fn measure(&self, trace: &Trace) -> Vec<Option<Crossing>> {
        let widths = self.widths(trace);
        let slopes = slopes(trace);
        (0..trace.len()).map(|idx| self.crossing(trace, idx, widths[idx], slopes[idx])).collect()
    }

    fn crossing(&self, trace: &Trace, idx: usize, width_px: f32, slope: f32) -> Option<Crossing> {
        let (u, v) = (trace.first_u + idx, trace.v[idx]);
        let margin = BORDER_WIDTHS * width_px;
        if v < margin || v > (self.view.height - 1) as f32 - margin {
            return None;
        }
        let (contrast, clearance_px) = (trace.contrast[idx], trace.clearance_px[idx]);
        let beside = self.beside(u, v);
        let step = beside.below - beside.above;
        if clearance_px < CLEARANCE_MIN_WIDTHS * width_px || step.abs() > FLANK_STEP_MAX * contrast {
            return None;
        }
        let even = step.abs() < FLANK_STEP_EVEN * contrast;
        let flank_px = self.boxes.flank as f32;
        let clearance_px = if even { clearance_px } else { clearance_px.min(flank_px) };
        let background_slope = if even { step / (2.0 * flank_px) } else { 0.0 };
        let from = Approach {
            u,
            v,
            slope,
            gate_px: (0.75 * width_px).max(LINK_GATE_MIN_PX),
            background: 0.5 * (beside.above + beside.below),
            background_slope,
        };
        match self.method {
            CentrelineMethod::Steger => self.steger(from, width_px, clearance_px),
            CentrelineMethod::CentreOfGravity => self.centroid(from, width_px, clearance_px),
        }
    }

    fn steger(&self, from: Approach, width_px: f32, clearance_px: f32) -> Option<Crossing> {
        let taps = self.kernels.for_width(width_px.min(CLEARANCE_KERNEL_WIDTH * clearance_px));
        let Ridge { v, v_pixel, curvature } = self.kernels.ridge(&self.view, taps, from)?;
        let weights = |row: usize| taps.first[row + taps.reach() - v_pixel];
        let rows = self.rows_around(v_pixel, taps.reach());
        let window_variance_px2 = taps.sigma_px * taps.sigma_px;
        let centre =
            Centre { v, rows, white: self.kernels.along_gain(), gain: 1.0 / curvature, window_variance_px2 };
        Some(self.described(from, width_px, centre, weights))
    }

    /// Grey-level centroid above the background, iterated until the window sits on the line.
    fn centroid(&self, from: Approach, width_px: f32, clearance_px: f32) -> Option<Crossing> {
        let reach = (CENTROID_HALF_HEIGHT_WIDTHS * width_px).min(0.5 * clearance_px).ceil() as usize;
        let mut v = from.v;
        for _ in 0..3 {
            let rows = self.rows_around(v.round().max(0.0) as usize, reach);
            let middle = v;
            let (mut sum, mut moment) = (0.0f32, 0.0f32);
            for row in rows {
                let d = row as f32 - from.v;
                let level = self.view.grey(from.u, row) - from.background - from.background_slope * d;
                sum += level;
                moment += level * (row as f32 - middle);
            }
            if sum <= 0.0 || (moment / sum).abs() > reach as f32 {
                return None;
            }
            v = middle + moment / sum;
            if (v - from.v).abs() > from.gate_px {
                return None;
            }
        }
        let v_pixel = v.round().max(0.0) as usize;
        let rows = self.rows_around(v_pixel, reach);
        let sum: f32 = rows.clone().map(|row| self.view.grey(from.u, row) - from.background).sum();
        let gain = 1.0 / sum.max(1.0);
        let centre = Centre { v: f64::from(v), rows, white: 1.0, gain, window_variance_px2: f32::INFINITY };
        Some(self.described(from, width_px, centre, |row| row as f32 - v))
    }

    /// Attaches width, intensity, saturation and the propagated noise. A pixel of weight `weights(row)` moves the
    /// centre by that much times the gain per grey level; camera noise is independent between pixels, speckle
    /// scales with the light and is absent where the pixel is at full scale.
    fn described(
        &self,
        from: Approach,
        width_px: f32,
        centre: Centre,
        weights: impl Fn(usize) -> f32,
    ) -> Crossing {
        let Centre { v, rows, white, gain, window_variance_px2 } = centre;
        let (mut camera, mut speckle) = (0.0f32, 0.0f32);
        for row in rows {
            let weight = weights(row) * gain;
            let level = self.view.grey(from.u, row);
            camera += weight * weight;
            if level < self.view.full_scale {
                let light = weight * (level - from.background).max(0.0);
                speckle += light * light;
            }
        }
        let v_pixel = (v.round().max(0.0) as usize).min(self.view.height - 1);
        let sigma = self.noise.at(from.u, v_pixel);
        Crossing {
            u: from.u,
            v,
            camera_variance: f64::from(camera * white * sigma * sigma),
            speckle_variance: f64::from(speckle),
            cross_variance_px2: 1.0 / f64::from((WIDTH_PER_SIGMA / width_px).powi(2) + 1.0 / window_variance_px2),
            intensity: self.peak(from.u, v_pixel) - from.background,
            width_px,
            saturated: self.rows_around(v_pixel, 1).any(|row| self.view.saturated(from.u, row)),
        }
    }

    /// Width (full, at half height, along the column) at every step: the median of the neighbourhood.
    fn widths(&self, trace: &Trace) -> Vec<f32> {
        const NEIGHBOURS: usize = 4;
        let reach = (2.0 * self.width_px).ceil() as usize + 2;
        let raw: Vec<f32> = trace
            .v
            .iter()
            .enumerate()
            .map(|(idx, &v)| {
                let u = trace.first_u + idx;
                let beside = self.beside(u, v);
                let v = v.round().max(0.0) as usize;
                crossing_width_px(&self.view, u, v, self.peak(u, v), 0.5 * (beside.above + beside.below), reach)
            })
            .collect();
        let mut window = [0.0f32; 2 * NEIGHBOURS + 1];
        (0..raw.len())
            .map(|idx| {
                let near = &raw[idx.saturating_sub(NEIGHBOURS)..(idx + NEIGHBOURS + 1).min(raw.len())];
                let sorted = &mut window[..near.len()];
                sorted.copy_from_slice(near);
                sorted.sort_unstable_by(f32::total_cmp);
                sorted[near.len() / 2]
            })
            .collect()
    }

    /// Grey level of the top of a crossing: mean of three rows.
    fn peak(&self, u: usize, v: usize) -> f32 {
        let rows = self.rows_around(v, 1);
        let n = rows.len() as f32;
        rows.map(|row| self.view.grey(u, row)).sum::<f32>() / n
    }

    /// Mean grey levels of the two flanks. Outside the image the other flank stands in.
    fn beside(&self, u: usize, v: f32) -> Beside {
        let v = v.round().max(0.0) as usize;
        let (flank, half) = (self.boxes.flank, self.boxes.half_height);
        let mean = |middle: usize| {
            let rows = self.rows_around(middle, half);
            let n = rows.len().max(1) as f32;
            rows.map(|row| self.view.grey(u, row)).sum::<f32>() / n
        };
        let above = (v >= flank).then(|| mean(v - flank));
        let below = (v + flank < self.view.height).then(|| mean(v + flank));
        let either = above.or(below).unwrap_or(0.0);
        Beside { above: above.unwrap_or(either), below: below.unwrap_or(either) }
    }

    fn rows_around(&self, v: usize, reach: usize) -> std::ops::Range<usize> {
        v.saturating_sub(reach)..(v + reach + 1).min(self.view.height)
    }
}

/// Rows per column at every step: difference of the means over a few columns to either side.
fn slopes(trace: &Trace) -> Vec<f32> {
    const REACH: usize = 8;
    (0..trace.len())
        .map(|idx| {
            let (from, to) = (idx.saturating_sub(REACH), (idx + REACH).min(trace.len() - 1));
            let middle = 0.5 * (from + to) as f32;
            let (mut moment, mut norm) = (0.0f32, 0.0f32);
            for (k, v) in trace.v.iter().enumerate().take(to + 1).skip(from) {
                let x = k as f32 - middle;
                moment += x * v;
                norm += x * x;
            }
            moment / norm.max(1.0)
        })
        .collect()
}
