//! Position of a line's ridge, from derivatives across it.

use super::block::{Block, Image, Lanes};
use super::pieces::WIDTH_PER_AREA;
use super::surroundings::Surroundings;
use super::taps::Taps;
use super::window::{LANES, Window};
use crate::centreline::fast::lanes::Numbers;
use crate::centreline::lines::candidates::Boxes;
use crate::centreline::lines::taps::WIDTH_PER_SIGMA;
use crate::centreline::view::Level;
use crate::params::{BORDER_WIDTHS, CLEARANCE_MIN_WIDTHS, LINK_GATE_MIN_PX, RIDGE_TRUSTED_PX};

/// Largest shift of a window in one step, rows.
const MOVE_MAX_PX: f32 = 4.0;

/// Derivatives at the anchors.
pub struct Derivatives {
    pub first: Lanes,
    pub second: Lanes,
}

/// Position of the ridge.
pub struct Ridge {
    /// Rows from the anchor.
    pub offset: Lanes,
    pub found: [bool; LANES],
    /// Rows from the anchor at which to measure again; 0 where that would not help.
    pub moved: Lanes,
}

#[inline(always)]
pub fn derivatives<T: Level>(window: &Window<T>, taps: &Taps) -> Derivatives {
    let [_, w2] = taps.weights[taps.reach];
    let (mut first, mut second) = (Numbers::default(), Numbers::greys(window.row(0)) * w2);
    for (&[w1, w2], (before, after)) in taps.weights[taps.reach + 1..].iter().zip(window.pairs()) {
        // The first derivative uses the difference of the rows on either side, the second their sum.
        let (before, after) = (Numbers::greys(before), Numbers::greys(after));
        first = first + (after - before) * w1;
        second = second + (before + after) * w2;
    }
    Derivatives { first: first.0, second: second.0 }
}

#[inline(always)]
pub fn ridge<T: Level>(
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

/// Change of the background slope per row that the line lies below the anchor, for a line of height one: the lower
/// flank then gets more of its light than the upper one.
#[inline(always)]
fn leak(boxes: Boxes, line_sigma_px: f32) -> f32 {
    let half = boxes.half_height as f32 + 0.5;
    let bell = |x: f32| decay(0.5 * (x / line_sigma_px) * (x / line_sigma_px));
    let flank = boxes.flank as f32;
    (bell(flank - half) - bell(flank + half)) / (boxes.rows() as f32 * flank)
}

/// e^−y for non-negative y, to a relative error of 2e-4; library versions differ in the last bit.
#[inline(always)]
fn decay(y: f32) -> f32 {
    let halvings = (y * std::f32::consts::LOG2_E).min(126.0);
    let whole = halvings as u32;
    let x = (halvings - whole as f32) * std::f32::consts::LN_2;
    let rest = 1.0 - x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0)))));
    rest * f32::from_bits((127 - whole) << 23)
}
