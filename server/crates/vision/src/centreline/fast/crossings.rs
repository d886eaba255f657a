//! The crossings of a trace: sixteen columns at a time, straightened, measured across the line.

use super::taps::Taps;
use super::window::{LANES, Place, straighten};
use crate::centreline::reference::candidates::Boxes;
use crate::centreline::reference::crossing::Crossing;
use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::reference::segments::Trace;
use crate::centreline::reference::steger::WIDTH_PER_SIGMA;
use crate::centreline::view::{Level, View};
use crate::params::{
    BORDER_WIDTHS, CLEARANCE_KERNEL_WIDTH, CLEARANCE_MIN_WIDTHS, FLANK_STEP_EVEN, FLANK_STEP_MAX,
    LINK_GATE_MIN_PX, RIDGE_TRUSTED_PX, STEGER_MAX_STEPS, WIDTH_MIN_PX, WIDTH_NEIGHBOURS,
};

/// Full width at half height of a Gaussian over its area by its height: 2 √(2 ln 2) / √(2π).
const WIDTH_PER_AREA: f32 = 0.939_437;

type Lanes = [f32; LANES];

/// Tools and settings shared by all traces of an image.
pub struct Measurer<'a, T> {
    view: &'a View<'a, T>,
    noise: &'a NoiseMap,
    boxes: Boxes,
    width_px: f32,
    reach: usize,
}

/// A column that still has to be measured.
#[derive(Clone, Copy)]
struct Pending {
    idx: usize,
    v: usize,
}

/// A crossing before its width is known from its neighbourhood.
#[derive(Clone, Copy)]
struct Raw {
    v: f64,
    camera_variance: f32,
    speckle_variance: f32,
    window_variance_px2: f32,
    intensity: f32,
    area: f32,
    saturated: bool,
}

/// What is seen in a window before the ridge is looked for.
struct Surroundings {
    background: Lanes,
    background_slope: Lanes,
    clearance_px: Lanes,
    plausible: [bool; LANES],
    height: Lanes,
    area: Lanes,
    saturated: [bool; LANES],
}

/// Derivatives at the anchors, and the light that speckle plays with.
struct Derivatives {
    first: Lanes,
    second: Lanes,
    third: Lanes,
    speckle: Lanes,
}

impl<'a, T: Level> Measurer<'a, T> {
    /// A measurer for lines of a typical width.
    pub fn new(view: &'a View<'a, T>, noise: &'a NoiseMap, boxes: Boxes, width_px: f32) -> Self {
        let kernel = Taps::for_width(width_px, usize::MAX).reach;
        let reach = kernel.max(boxes.flank + boxes.half_height);
        Self { view, noise, boxes, width_px, reach }
    }

    /// Measures every step of a trace; `None` where no centre was found.
    #[inline(always)]
    pub fn measure(&self, trace: &Trace) -> Vec<Option<Crossing>> {
        let n = trace.steps.len();
        let last = self.view.height - 1;
        let mut raw: Vec<Option<Raw>> = vec![None; n];
        let mut pending: Vec<Pending> = (0..n)
            .map(|idx| Pending { idx, v: (trace.steps[idx].v.round().max(0.0) as usize).min(last) })
            .collect();
        let mut later = Vec::new();
        let mut window = vec![[self.view.pixels[0]; LANES]; 2 * self.reach + 1];
        for _ in 0..STEGER_MAX_STEPS {
            for block in pending.chunks(LANES) {
                self.block(trace, block, &mut window, &mut raw, &mut later);
            }
            if later.is_empty() {
                break;
            }
            pending.clear();
            std::mem::swap(&mut pending, &mut later);
        }
        with_widths(trace.first_u, &raw)
    }

    #[inline(always)]
    fn block(
        &self,
        trace: &Trace,
        block: &[Pending],
        window: &mut [[T; LANES]],
        raw: &mut [Option<Raw>],
        later: &mut Vec<Pending>,
    ) {
        let at = |i: usize| block[i.min(block.len() - 1)];
        let places: [Place; LANES] = std::array::from_fn(|i| Place { u: trace.first_u + at(i).idx, v: at(i).v });
        straighten(self.view, &places, self.reach, window);
        let seen = self.surroundings(trace, block, &places, window);
        let (width_px, clearance_px) = self.width_and_clearance(block, &seen);
        let taps = Taps::for_width(width_px.min(CLEARANCE_KERNEL_WIDTH * clearance_px), self.reach);
        let derivatives = self.derivatives(window, taps, &seen.background);
        let gate_px = (0.75 * width_px).max(LINK_GATE_MIN_PX);
        let margin = BORDER_WIDTHS * width_px;
        let line_sigma_px = width_px / WIDTH_PER_SIGMA;
        let quartic = -3.0 / (taps.sigma_px * taps.sigma_px + line_sigma_px * line_sigma_px);
        let last = (self.view.height - 1) as f32;
        for (i, &Pending { idx, v }) in block.iter().enumerate() {
            let step = trace.steps[idx];
            let inside = step.v >= margin && step.v <= last - margin;
            let clear = step.clearance_px >= CLEARANCE_MIN_WIDTHS * width_px;
            let (second, slope) = (derivatives.second[i], derivatives.first[i] - seen.background_slope[i]);
            if !(inside && clear && seen.plausible[i]) || second >= 0.0 || seen.height[i] <= 0.0 {
                continue;
            }
            let first_guess = -slope / second;
            if first_guess.abs() > RIDGE_TRUSTED_PX {
                let moved = (v as f32 + first_guess.clamp(-4.0, 4.0)).round().clamp(0.0, last);
                if moved != v as f32 && (moved - step.v).abs() <= gate_px + 1.0 {
                    later.push(Pending { idx, v: moved as usize });
                }
                continue;
            }
            let offset = refined(first_guess, derivatives.third[i] / second, quartic);
            let found = v as f32 + offset;
            if (found - step.v).abs() > gate_px || found < 0.0 || found > last {
                continue;
            }
            let gain = 1.0 / second;
            let sigma = self.noise.at(places[i].u, v);
            raw[idx] = Some(Raw {
                v: v as f64 + f64::from(offset),
                camera_variance: taps.first_squared * gain * gain * sigma * sigma,
                speckle_variance: derivatives.speckle[i] * gain * gain,
                window_variance_px2: taps.sigma_px * taps.sigma_px,
                intensity: seen.height[i],
                area: seen.area[i],
                saturated: seen.saturated[i],
            });
        }
    }

    /// Background, height and area of every crossing. Outside the image the other flank stands in.
    #[inline(always)]
    fn surroundings(
        &self,
        trace: &Trace,
        block: &[Pending],
        places: &[Place; LANES],
        window: &[[T; LANES]],
    ) -> Surroundings {
        let Boxes { half_height: half, flank } = self.boxes;
        let (middle, flank_px) = (self.reach, flank as f32);
        let n_rows = self.boxes.rows() as f32;
        let mut above = sum_of(&window[middle - flank - half..=middle - flank + half]).map(|s| s / n_rows);
        let mut below = sum_of(&window[middle + flank - half..=middle + flank + half]).map(|s| s / n_rows);
        for i in 0..LANES {
            above[i] = if places[i].v < flank { below[i] } else { above[i] };
            below[i] = if places[i].v + flank >= self.view.height { above[i] } else { below[i] };
        }
        let background: Lanes = std::array::from_fn(|i| 0.5 * (above[i] + below[i]));
        let top = sum_of(&window[middle - 1..=middle + 1]);
        let half_area = flank - half - 1;
        let light = sum_of(&window[middle - half_area..=middle + half_area]);
        let n_light = (2 * half_area + 1) as f32;
        let mut saturated = [false; LANES];
        for row in &window[middle - 1..=middle + 1] {
            (0..LANES).for_each(|i| saturated[i] |= row[i].grey() >= self.view.full_scale);
        }
        let (mut plausible, mut background_slope) = ([false; LANES], [0.0; LANES]);
        let mut clearance_px = [f32::INFINITY; LANES];
        for (i, &Pending { idx, .. }) in block.iter().enumerate() {
            let step = trace.steps[idx];
            let difference = below[i] - above[i];
            let even = difference.abs() < FLANK_STEP_EVEN * step.contrast;
            plausible[i] = difference.abs() <= FLANK_STEP_MAX * step.contrast;
            background_slope[i] = if even { difference / (2.0 * flank_px) } else { 0.0 };
            clearance_px[i] = if even { step.clearance_px } else { step.clearance_px.min(flank_px) };
        }
        Surroundings {
            background,
            background_slope,
            clearance_px,
            plausible,
            height: std::array::from_fn(|i| top[i] / 3.0 - background[i]),
            area: std::array::from_fn(|i| light[i] - n_light * background[i]),
            saturated,
        }
    }

    /// Width of the block's lines along the column, and the least clearance of those that can be measured.
    #[inline(always)]
    fn width_and_clearance(&self, block: &[Pending], seen: &Surroundings) -> (f32, f32) {
        let (mut area, mut height, mut clearance_px) = (0.0f32, 0.0f32, f32::INFINITY);
        for i in (0..block.len()).filter(|&i| seen.plausible[i]) {
            area += seen.area[i].max(0.0);
            height += seen.height[i].max(0.0);
            if seen.clearance_px[i] >= CLEARANCE_MIN_WIDTHS * WIDTH_MIN_PX {
                clearance_px = clearance_px.min(seen.clearance_px[i]);
            }
        }
        let width_px = if height > 0.0 { WIDTH_PER_AREA * area / height } else { self.width_px };
        (width_px.clamp(WIDTH_MIN_PX, 2.0 * self.width_px), clearance_px)
    }

    #[inline(always)]
    fn derivatives(&self, window: &[[T; LANES]], taps: &Taps, background: &Lanes) -> Derivatives {
        let [mut first, mut second, mut third, mut speckle] = [[0.0f32; LANES]; 4];
        let rows = &window[self.reach - taps.reach..=self.reach + taps.reach];
        let full_scale = self.view.full_scale;
        for (row, &[w1, w2, w3]) in rows.iter().zip(&taps.weights) {
            let level: Lanes = row.map(T::grey);
            // Speckle scales with the light and is absent where the pixel is at full scale.
            let above: Lanes =
                std::array::from_fn(
                    |i| {
                        if level[i] < full_scale { (level[i] - background[i]).max(0.0) } else { 0.0 }
                    },
                );
            for i in 0..LANES {
                first[i] += w1 * level[i];
            }
            for i in 0..LANES {
                second[i] += w2 * level[i];
            }
            for i in 0..LANES {
                third[i] += w3 * level[i];
            }
            for i in 0..LANES {
                speckle[i] += (w1 * above[i]) * (w1 * above[i]);
            }
        }
        Derivatives { first, second, third, speckle }
    }
}

/// The zero of the slope near a first guess t = −R′/R″: one Newton step on R′ + R″t + R‴t²/2 + R⁗t³/6, with
/// `third` = R‴/R″ as measured and `fourth` = R⁗/R″ of a Gaussian line.
#[inline(always)]
fn refined(t: f32, third: f32, fourth: f32) -> f32 {
    let excess = t * t * (0.5 * third + fourth * t / 6.0);
    let slope = 1.0 + t * (third + 0.5 * fourth * t);
    if slope > 0.3 { t - excess / slope } else { t }
}

#[inline(always)]
fn sum_of<T: Level>(rows: &[[T; LANES]]) -> Lanes {
    let mut sum = [0.0; LANES];
    for row in rows {
        (0..LANES).for_each(|i| sum[i] += row[i].grey());
    }
    sum
}

/// Gives every crossing the width of its neighbourhood: area by height, both summed.
#[inline(always)]
fn with_widths(first_u: usize, raw: &[Option<Raw>]) -> Vec<Option<Crossing>> {
    let mut sums = Vec::with_capacity(raw.len() + 1);
    let mut sum = (0.0f64, 0.0f64);
    sums.push(sum);
    for crossing in raw {
        if let Some(crossing) = crossing {
            sum = (sum.0 + f64::from(crossing.area), sum.1 + f64::from(crossing.intensity));
        }
        sums.push(sum);
    }
    let described = |(idx, raw): (usize, &Option<Raw>)| {
        let raw = (*raw)?;
        let (from, to) = (idx.saturating_sub(WIDTH_NEIGHBOURS), (idx + WIDTH_NEIGHBOURS + 1).min(sums.len() - 1));
        let area = (sums[to].0 - sums[from].0) as f32;
        let height = (sums[to].1 - sums[from].1) as f32;
        let width_px = (WIDTH_PER_AREA * area / height).max(0.5);
        let line = WIDTH_PER_SIGMA / width_px;
        Some(Crossing {
            u: first_u + idx,
            v: raw.v,
            camera_variance: f64::from(raw.camera_variance),
            speckle_variance: f64::from(raw.speckle_variance),
            cross_variance_px2: f64::from(1.0 / (line * line + 1.0 / raw.window_variance_px2)),
            intensity: raw.intensity,
            width_px,
            saturated: raw.saturated,
        })
    };
    raw.iter().enumerate().map(described).collect()
}
