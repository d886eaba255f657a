//! Points of a line from the parabolas chosen for them.

use std::ops::Range;

use super::means::Mean;
use crate::centreline::CentrelinePoint;
use crate::centreline::fast::across::pieces::Crossings;
use crate::centreline::fast::lanes::{LANES, Numbers};
use crate::params::{HEIGHT_EXCESS, HEIGHT_LEAST_PX};

type Lanes = [f32; LANES];

/// The parabola chosen in every lane.
pub struct Chosen {
    pub mean: Mean,
    /// Its slope, per column.
    pub slopes: Numbers,
}

/// No window.
pub const NONE: f32 = -1.0;

/// Results for some points.
pub struct Described {
    /// Rows, relative to the block's first.
    pub shift: Lanes,
    pub normal_u: Lanes,
    pub across: Lanes,
    pub sigma_px: Lanes,
}

impl Described {
    /// Writes the points of neighbouring crossings. `first_u` and `row` are the column and row of the first.
    #[inline(always)]
    pub fn write(
        &self,
        crossings: &Crossings,
        places: Range<usize>,
        first_u: usize,
        row: f64,
        points: &mut [CentrelinePoint],
    ) {
        let intensity = &crossings.intensity[places.clone()];
        let width_px = stated_widths(&crossings.width_px[places.clone()]);
        let saturated = &crossings.saturated[places];
        let first_u = first_u as i32;
        for i in 0..LANES.min(points.len()) {
            points[i] = CentrelinePoint {
                u_px: f64::from(first_u + i as i32),
                v_px: row + f64::from(self.shift[i]),
                normal: [f64::from(self.normal_u[i]), f64::from(self.across[i])],
                sigma_px: f64::from(self.sigma_px[i]),
                intensity: intensity[i],
                width_px: width_px[i] * self.across[i],
                saturated: saturated[i],
            };
        }
    }
}

/// Full widths at half height as in the image, from those measured as area over height. That height is the mean of
/// three rows, which is less than the height of a narrow line: for a Gaussian profile of standard deviation s, anywhere
/// within its pixel,
///
/// measured = 3 · 0.939 / erf(1.5 / (√2 s)),
///
/// which this function inverts to 3 % from 1.5 px on.
#[inline(always)]
fn stated_widths(measured_px: &[f32]) -> Lanes {
    let mut stated = [0.0; LANES];
    stated[..measured_px.len()].copy_from_slice(measured_px);
    for width_px in &mut stated {
        let square = (*width_px * *width_px).max(HEIGHT_LEAST_PX * HEIGHT_LEAST_PX);
        let per_square = 1.0 / square;
        let excess = HEIGHT_EXCESS[0] + per_square * (HEIGHT_EXCESS[1] + per_square * HEIGHT_EXCESS[2]);
        *width_px = (square - excess).sqrt();
    }
    stated
}

impl Chosen {
    /// Position, normal and σ; a crossing without a fit keeps its own position and σ.
    #[inline(always)]
    pub fn described(&self) -> Described {
        let Mean { value, variance } = &self.mean;
        let [mut normal_u, mut across, mut sigma_px] = [[0.0f32; LANES]; 3];
        for i in 0..LANES {
            let slope = self.slopes.0[i];
            across[i] = 1.0 / (1.0 + slope * slope).sqrt();
            normal_u[i] = -slope * across[i];
            sigma_px[i] = variance.0[i].max(1e-10).sqrt() * across[i];
        }
        Described { shift: value.0, normal_u, across, sigma_px }
    }
}
