//! The crossings of a trace: sixteen columns at a time, straightened, measured across the line.

use super::block::{Block, Image, Pending};
use super::pieces::{Crossings, Measured, WIDTH_PER_AREA};
use super::ridge::{Derivatives, Ridge, derivatives, ridge};
use super::surroundings::{Surroundings, surroundings};
use super::taps::Taps;
use super::window::{LANES, Window};
use crate::centreline::lines::traces::Trace;
use crate::centreline::view::Level;
use crate::params::{CLEARANCE_KERNEL_WIDTH, STEGER_MAX_STEPS};

/// Measures traces; its memory is reused from image to image.
#[derive(Default)]
pub struct Measurer<T> {
    window: Window<T>,
    pending: Vec<Pending>,
    later: Vec<Pending>,
}

impl<T: Level> Measurer<T> {
    /// Measures every step of a trace, appends it to `crossings`, and returns the index of the first one appended.
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
