//! The crossings of a trace: sixteen columns at a time, straightened, measured across the line.

use super::lanes::Numbers;
use super::pieces::{Crossings, Measured, WIDTH_PER_AREA};
use super::taps::Taps;
use super::window::{LANES, Places, SHARING, Window};
use crate::centreline::reference::candidates::Boxes;
use crate::centreline::reference::noise::NoiseMap;
use crate::centreline::reference::segments::Trace;
use crate::centreline::reference::steger::WIDTH_PER_SIGMA;
use crate::centreline::view::{Level, Sum, View};
use crate::params::{
    BORDER_WIDTHS, CLEARANCE_KERNEL_WIDTH, CLEARANCE_MIN_WIDTHS, FLANK_STEP_EVEN, FLANK_STEP_MAX,
    LINK_GATE_MIN_PX, RIDGE_TRUSTED_PX, STEGER_MAX_STEPS, WIDTH_MIN_PX,
};

/// Farthest a window is moved at once, in rows.
const MOVE_MAX_PX: f32 = 4.0;

type Lanes = [f32; LANES];

/// What an image's traces are measured with.
#[derive(Clone, Copy)]
pub struct Image<'a, T> {
    /// The image.
    pub view: &'a View<'a, T>,
    /// Its noise.
    pub noise: &'a NoiseMap,
    /// Detection boxes: where background is looked for.
    pub boxes: Boxes,
    /// Typical width of the lines.
    pub width_px: f32,
    /// Rows on either side of a crossing that are looked at.
    reach: usize,
    /// Scales that reach no further.
    scales: &'static [Taps],
}

impl<'a, T> Image<'a, T> {
    /// An image with lines of this typical width.
    pub fn new(view: &'a View<'a, T>, noise: &'a NoiseMap, boxes: Boxes, width_px: f32) -> Self {
        let kernel = Taps::for_width(width_px, Taps::scales(usize::MAX)).reach;
        let reach = kernel.max(boxes.flank + boxes.half_height);
        Self { view, noise, boxes, width_px, reach, scales: Taps::scales(reach) }
    }
}

/// Measures traces; keeps its memory from image to image.
#[derive(Default)]
pub struct Measurer<T> {
    window: Window<T>,
    pending: Vec<Pending>,
    later: Vec<Pending>,
}

/// A column that still has to be measured.
#[derive(Clone, Copy, Default)]
struct Pending {
    idx: usize,
    v: u32,
}

/// The row nearest to one that is not negative: a number with so large a whole part has no digits behind the point.
#[inline(always)]
fn nearest_row(v: f32) -> u32 {
    const WHOLE: f32 = (1 << 23) as f32;
    (v + WHOLE).to_bits() - WHOLE.to_bits()
}

/// Lets some columns be looked at about the same row if theirs are next to it: their pixels are then copied together.
/// `idx` tells one such group of a trace from the next.
#[inline(always)]
fn share_row(rows: &mut [u32; SHARING], idx: usize) {
    let n = SHARING as u32;
    // Halves are rounded up and down in turn: where the window stands must not move the line.
    let mean = (rows.iter().sum::<u32>() + n / 2 - idx as u32 % 2) / n;
    let all_beside = rows.iter().fold(true, |all, row| all & ((row + 1).wrapping_sub(mean) <= 2));
    if all_beside {
        *rows = [mean; SHARING];
    }
}

/// Steps of a trace side by side; lanes beyond the last step repeat it.
struct Block {
    n: usize,
    places: Places,
    step_v: Lanes,
    contrast: Lanes,
    clearance_px: Lanes,
}

/// What is seen in a window before the ridge is looked for.
struct Surroundings {
    background: Lanes,
    background_slope: Lanes,
    is_even: [bool; LANES],
    clearance_px: Lanes,
    plausible: [bool; LANES],
    height: Lanes,
    area: Lanes,
    saturated: [bool; LANES],
}

/// Derivatives at the anchors.
struct Derivatives {
    first: Lanes,
    second: Lanes,
}

/// Where the ridge lies.
struct Ridge {
    /// Rows from the anchor.
    offset: Lanes,
    found: [bool; LANES],
    /// Rows from the anchor at which to look again; 0 where that is of no use.
    moved: Lanes,
}

impl<T: Level> Measurer<T> {
    /// Measures every step of a trace, adds it to `crossings`, and tells where among them it begins.
    #[inline(always)]
    pub fn measure(&mut self, image: &Image<T>, trace: &Trace, crossings: &mut Crossings) -> usize {
        let last = (image.view.height - 1) as u32;
        let start = crossings.extend(trace.len());
        self.pending.clear();
        for first in (0..trace.len()).step_by(LANES) {
            self.block(image, trace, &Block::from(trace, first, last), crossings, start);
        }
        for _ in 1..STEGER_MAX_STEPS {
            if self.later.is_empty() {
                break;
            }
            std::mem::swap(&mut self.pending, &mut self.later);
            let pending = std::mem::take(&mut self.pending);
            for some in pending.chunks(LANES) {
                self.block(image, trace, &Block::of(trace, some), crossings, start);
            }
            self.pending = pending;
            self.pending.clear();
        }
        self.later.clear();
        crossings.widen(start);
        start
    }

    #[inline(always)]
    fn block(&mut self, image: &Image<T>, trace: &Trace, block: &Block, crossings: &mut Crossings, start: usize) {
        self.window.straighten(image.view, &block.places, image.reach);
        let seen = surroundings(image, block, &self.window);
        let (width_px, clearance_px) = seen.width_and_clearance(block.n, image.width_px);
        let taps = Taps::for_width(width_px.min(CLEARANCE_KERNEL_WIDTH * clearance_px), image.scales);
        let derivatives = derivatives(&self.window, taps);
        let ridge = ridge(image, block, &seen, &derivatives, taps.sigma_px, width_px);
        let middle = block.n / 2;
        let noise = image.noise.at(block.places.u[middle] as usize, block.places.v[middle] as usize);
        let measured = Measured::of(block, &seen, &derivatives, &ridge, taps, width_px, noise);
        let idx = |i: usize| block.places.u[i] as usize - trace.first_u;
        if block.n == LANES && block.places.adjoin {
            crossings.put(start + idx(0), &measured);
        } else {
            let found = (0..block.n).filter(|&i| measured.found[i]);
            found.for_each(|i| crossings.put_one(start + idx(i), &measured, i));
        }
        if ridge.moved.iter().fold(false, |any, &moved| any | (moved != 0.0)) {
            let moved = (0..block.n).filter(|&i| ridge.moved[i] != 0.0);
            self.later.extend(
                moved.map(|i| Pending { idx: idx(i), v: (block.places.v[i] as f32 + ridge.moved[i]) as u32 }),
            );
        }
    }
}

impl Measured {
    #[inline(always)]
    fn of(
        block: &Block,
        seen: &Surroundings,
        derivatives: &Derivatives,
        ridge: &Ridge,
        taps: &Taps,
        width_px: f32,
        noise: f32,
    ) -> Self {
        let camera = taps.first_squared * noise * noise;
        let per_area = WIDTH_PER_AREA / width_px;
        let speckle = taps.speckle(width_px) * per_area * per_area;
        let zero = [0.0f32; LANES];
        let mut measured = Self {
            found: ridge.found,
            v: [0.0; LANES],
            camera_variance: zero,
            speckle_variance: zero,
            cross_variance_px2: taps.sigma_px * taps.sigma_px,
            intensity: zero,
            area: zero,
            saturated: seen.saturated,
        };
        for i in 0..LANES {
            measured.v[i] = f64::from(block.places.v[i] as i32) + f64::from(ridge.offset[i]);
        }
        for i in 0..LANES {
            let second = derivatives.second[i];
            let squared_gain = 1.0 / (second * second).max(f32::MIN_POSITIVE);
            let area = seen.area[i];
            measured.camera_variance[i] = camera * squared_gain;
            measured.speckle_variance[i] = speckle * (area * area) * squared_gain;
            measured.intensity[i] = if ridge.found[i] { seen.height[i] } else { 0.0 };
            measured.area[i] = if ridge.found[i] { area } else { 0.0 };
        }
        measured
    }
}

impl Block {
    /// Steps in a row, from `first` on. `last` is the last row of the image.
    #[inline(always)]
    fn from(trace: &Trace, first: usize, last: u32) -> Self {
        let (step_v, contrast) = (from(&trace.v[first..]), from(&trace.contrast[first..]));
        let clearance_px = from(&trace.clearance_px[first..]);
        let mut rows = [0; LANES];
        for i in 0..LANES {
            rows[i] = nearest_row(step_v[i]).min(last);
        }
        let n = LANES.min(trace.len() - first);
        for (idx, some) in rows.as_chunks_mut::<SHARING>().0.iter_mut().enumerate() {
            if (idx + 1) * SHARING <= n {
                share_row(some, first / SHARING + idx);
            }
        }
        let first_u = (trace.first_u + first) as u32;
        let mut u = [first_u; LANES];
        for i in 0..LANES {
            u[i] += i as u32;
        }
        let places = Places { u, v: rows, adjoin: true };
        Self { n, places, step_v, contrast, clearance_px }
    }

    /// Some steps that are looked at again.
    #[inline(always)]
    fn of(trace: &Trace, pending: &[Pending]) -> Self {
        let n = pending.len();
        let mut block = Self {
            n,
            places: Places { u: [0; LANES], v: [0; LANES], adjoin: false },
            step_v: [0.0; LANES],
            contrast: [0.0; LANES],
            clearance_px: [0.0; LANES],
        };
        for i in 0..LANES {
            let Pending { idx, v } = pending[i.min(n - 1)];
            block.places.u[i] = (trace.first_u + idx) as u32;
            block.places.v[i] = v;
            block.step_v[i] = trace.v[idx];
            block.contrast[i] = trace.contrast[idx];
            block.clearance_px[i] = trace.clearance_px[idx];
        }
        block
    }
}

/// The numbers a slice begins with; the last is repeated if there are fewer.
#[inline(always)]
fn from(numbers: &[f32]) -> Lanes {
    match numbers.first_chunk() {
        Some(all) => *all,
        None => {
            let mut some = [numbers[numbers.len() - 1]; LANES];
            some[..numbers.len()].copy_from_slice(numbers);
            some
        }
    }
}

/// Background, height and area of every crossing. Outside the image the other flank stands in.
#[inline(always)]
fn surroundings<T: Level>(image: &Image<T>, block: &Block, window: &Window<T>) -> Surroundings {
    let Boxes { half_height: half, flank } = image.boxes;
    let n_rows = image.boxes.rows() as f32;
    let half_area = flank - half - 1;
    let n_light = (2 * half_area + 1) as f32;
    let above = sum_of(window.rows(-(flank as isize), half));
    let below = sum_of(window.rows(flank as isize, half));
    let top = sum_of(window.rows(0, 1));
    let light = sum_of(window.rows(0, half_area));
    let rows: [&[T; LANES]; 3] = [window.row(-1), window.row(0), window.row(1)];
    let mut seen = Surroundings {
        background: [0.0; LANES],
        background_slope: [0.0; LANES],
        is_even: [false; LANES],
        clearance_px: [0.0; LANES],
        plausible: [false; LANES],
        height: [0.0; LANES],
        area: [0.0; LANES],
        saturated: [false; LANES],
    };
    for i in 0..LANES {
        seen.saturated[i] = rows[0][i].max(rows[1][i]).max(rows[2][i]).grey() >= image.view.full_scale;
    }
    let per_row = 1.0 / n_rows;
    let per_distance = 1.0 / (2.0 * flank as f32);
    let v = block.places.v;
    let (first, last) = (flank as u32, (image.view.height - flank) as u32);
    for i in 0..LANES {
        let (above, below) = (above[i] * per_row, below[i] * per_row);
        let above = if v[i] < first { below } else { above };
        let below = if v[i] >= last { above } else { below };
        let difference = below - above;
        let even = difference.abs() < FLANK_STEP_EVEN * block.contrast[i];
        let background = 0.5 * (above + below);
        seen.plausible[i] = difference.abs() <= FLANK_STEP_MAX * block.contrast[i];
        seen.is_even[i] = even;
        seen.background_slope[i] = if even { difference * per_distance } else { 0.0 };
        let clearance_px = block.clearance_px[i];
        seen.clearance_px[i] = if even { clearance_px } else { clearance_px.min(flank as f32) };
        seen.background[i] = background;
        seen.height[i] = top[i] * (1.0 / 3.0) - background;
        seen.area[i] = light[i] - n_light * background;
    }
    seen
}

impl Surroundings {
    /// Width of the block's lines along the column, and the least clearance of those that can be measured.
    #[inline(always)]
    fn width_and_clearance(&self, n: usize, typical_px: f32) -> (f32, f32) {
        let (mut area, mut height, mut clearance_px) = ([0.0f32; LANES], [0.0f32; LANES], [f32::INFINITY; LANES]);
        for i in 0..LANES {
            let counts = self.plausible[i] & (i < n);
            area[i] = if counts { self.area[i].max(0.0) } else { 0.0 };
            height[i] = if counts { self.height[i].max(0.0) } else { 0.0 };
            let clear = counts & (self.clearance_px[i] >= CLEARANCE_MIN_WIDTHS * WIDTH_MIN_PX);
            clearance_px[i] = if clear { self.clearance_px[i] } else { f32::INFINITY };
        }
        let (area, height) = (Numbers(area).sum(), Numbers(height).sum());
        let width_px = if height > 0.0 { WIDTH_PER_AREA * area / height } else { typical_px };
        (width_px.clamp(WIDTH_MIN_PX, 2.0 * typical_px), Numbers(clearance_px).least())
    }
}

#[inline(always)]
fn derivatives<T: Level>(window: &Window<T>, taps: &Taps) -> Derivatives {
    let [_, w2] = taps.weights[taps.reach];
    let (mut first, mut second) = (Numbers::default(), Numbers::greys(window.row(0)) * w2);
    for (&[w1, w2], (before, after)) in taps.weights[taps.reach + 1..].iter().zip(window.pairs()) {
        // The first takes the difference of the rows on either side, the second their sum.
        let (before, after) = (Numbers::greys(before), Numbers::greys(after));
        first = first + (after - before) * w1;
        second = second + (before + after) * w2;
    }
    Derivatives { first: first.0, second: second.0 }
}

#[inline(always)]
fn ridge<T: Level>(
    image: &Image<T>,
    block: &Block,
    seen: &Surroundings,
    derivatives: &Derivatives,
    sigma_px: f32,
    width_px: f32,
) -> Ridge {
    let gate_px = (0.75 * width_px).max(LINK_GATE_MIN_PX);
    let last = (image.view.height - 1) as f32;
    let (first_v, last_v) = (BORDER_WIDTHS * width_px, last - BORDER_WIDTHS * width_px);
    let clearance_px = CLEARANCE_MIN_WIDTHS * width_px;
    let line_sigma_px = width_px / WIDTH_PER_SIGMA;
    let leak = leak(image.boxes, line_sigma_px) * WIDTH_PER_AREA / width_px;
    let per_spread = 1.0 / (sigma_px * sigma_px + line_sigma_px * line_sigma_px);
    let mut ridge = Ridge { offset: [0.0; LANES], found: [false; LANES], moved: [0.0; LANES] };
    for i in 0..LANES {
        let v = block.places.v[i] as i32 as f32;
        let (expected, second) = (block.step_v[i], derivatives.second[i]);
        let slope = derivatives.first[i] - seen.background_slope[i];
        let inside = (expected >= first_v) & (expected <= last_v);
        let clear = block.clearance_px[i] >= clearance_px;
        let bright = (second < 0.0) & (seen.height[i] > 0.0);
        let usable = inside & clear & seen.plausible[i] & bright;
        // A line off the anchor leaks into the nearer flank.
        let leaked = if seen.is_even[i] { leak * seen.area[i] } else { 0.0 };
        let guess = -slope / if bright { (second + leaked).min(0.5 * second) } else { -1.0 };
        let near = guess.abs() <= RIDGE_TRUSTED_PX;
        // For a Gaussian line R′ / R″ = t / (1 − t²/S²), S² the variance of line and kernel together.
        let offset = 2.0 * guess / (1.0 + (1.0 + 4.0 * guess * guess * per_spread).sqrt());
        let found = v + offset;
        let reached = ((found - expected).abs() <= gate_px) & (found >= 0.0) & (found <= last);
        ridge.offset[i] = offset;
        ridge.found[i] = usable & near & reached;
        let moved = (v + guess.clamp(-MOVE_MAX_PX, MOVE_MAX_PX)).round_ties_even().clamp(0.0, last);
        let worth = usable & !near & ((moved - expected).abs() <= gate_px + 1.0);
        ridge.moved[i] = if worth { moved - v } else { 0.0 };
    }
    ridge
}

/// By how much the background slope rises per row that the line lies below the anchor, for a line of height one: the
/// flank below then has more of its light than the one above.
#[inline(always)]
fn leak(boxes: Boxes, line_sigma_px: f32) -> f32 {
    let half = boxes.half_height as f32 + 0.5;
    let bell = |x: f32| decay(0.5 * (x / line_sigma_px) * (x / line_sigma_px));
    let flank = boxes.flank as f32;
    (bell(flank - half) - bell(flank + half)) / (boxes.rows() as f32 * flank)
}

/// e^−y of what is not negative, to 2e-4 of itself; libraries disagree in the last bit.
#[inline(always)]
fn decay(y: f32) -> f32 {
    let halvings = (y * std::f32::consts::LOG2_E).min(126.0);
    let whole = halvings as u32;
    let x = (halvings - whole as f32) * std::f32::consts::LN_2;
    let rest = 1.0 - x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0)))));
    rest * f32::from_bits((127 - whole) << 23)
}

#[inline(always)]
fn sum_of<'a, T: Level + 'a>(rows: impl Iterator<Item = &'a [T; LANES]>) -> Lanes {
    let mut sum = [T::Sum::default(); LANES];
    for row in rows {
        (0..LANES).for_each(|i| sum[i] = sum[i].plus(row[i].sum()));
    }
    let mut numbers = [0.0; LANES];
    for i in 0..LANES {
        numbers[i] = sum[i].number();
    }
    numbers
}
