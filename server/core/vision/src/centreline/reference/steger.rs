//! The ridge of a line by Gaussian derivatives (Steger 1998, TPAMI 20(2), section 3), at one column.

use crate::centreline::view::{Level, View};
use crate::params::{
    STEGER_CUT_SIGMAS, STEGER_MAX_STEPS, STEGER_SCALE_STEP, STEGER_SIGMA_ALONG_PX, STEGER_SIGMA_MAX_PX,
    STEGER_SIGMA_MIN_PX, STEGER_SIGMA_PER_LINE_SIGMA,
};

/// Full width at half height of a Gaussian over its standard deviation: 2 √(2 ln 2).
pub const WIDTH_PER_SIGMA: f32 = 2.354_82;

/// Sampled Gaussian and its first two derivatives, as weights of pixels at −r … r.
///
/// Normalised on the samples: `smooth` sums to one, `first` gives 1 for a unit ramp and `second` gives 1 for
/// x²/2 and 0 for a constant.
pub struct Taps {
    /// Standard deviation in pixels.
    pub sigma_px: f32,
    /// Gaussian.
    pub smooth: Vec<f32>,
    /// First derivative.
    pub first: Vec<f32>,
    /// Second derivative.
    pub second: Vec<f32>,
}

impl Taps {
    /// Taps for one scale.
    pub fn new(sigma_px: f32) -> Self {
        let reach = (STEGER_CUT_SIGMAS * sigma_px).ceil() as i32;
        let xs: Vec<f64> = (-reach..=reach).map(f64::from).collect();
        let var = f64::from(sigma_px) * f64::from(sigma_px);
        let mut smooth: Vec<f64> = xs.iter().map(|x| (-0.5 * x * x / var).exp()).collect();
        let sum: f64 = smooth.iter().sum();
        smooth.iter_mut().for_each(|g| *g /= sum);
        let ramp: f64 = xs.iter().zip(&smooth).map(|(x, g)| x * x * g).sum();
        let first = xs.iter().zip(&smooth).map(|(x, g)| (x * g / ramp) as f32).collect();
        let curved: Vec<f64> = xs.iter().zip(&smooth).map(|(x, g)| (x * x - ramp) * g).collect();
        let unit: f64 = xs.iter().zip(&curved).map(|(x, c)| 0.5 * x * x * c).sum();
        let second = curved.iter().map(|c| (c / unit) as f32).collect();
        Self { sigma_px, smooth: smooth.iter().map(|&g| g as f32).collect(), first, second }
    }

    /// Pixels on either side of the middle.
    pub fn reach(&self) -> usize {
        self.smooth.len() / 2
    }
}

/// Kernels along the line and, for a row of scales, across it.
pub struct Kernels {
    along: Taps,
    across: Vec<Taps>,
}

/// Gaussian-smoothed image and the derivatives needed at a pixel; u runs along the line, v across.
#[derive(Debug, Clone, Copy)]
struct Derivatives {
    r: f32,
    ru: f32,
    rv: f32,
    rvv: f32,
}

/// A ridge in one column.
#[derive(Debug, Clone, Copy)]
pub struct Ridge {
    /// Row where the ridge crosses the column.
    pub v: f64,
    /// Pixel row that holds it.
    pub v_pixel: usize,
    /// −∂²R/∂v², grey levels per px²: what a grey-level slope is divided by to become an offset.
    pub curvature: f32,
}

/// What is known about a line near a column before its ridge is measured.
#[derive(Debug, Clone, Copy)]
pub struct Approach {
    /// Column.
    pub u: usize,
    /// Row, to about a pixel.
    pub v: f32,
    /// Rows per column.
    pub slope: f32,
    /// Farthest the ridge may be from `v`.
    pub gate_px: f32,
    /// Grey level under the line.
    pub background: f32,
    /// Its change per row.
    pub background_slope: f32,
}

impl Kernels {
    /// Kernels for every line width up to the widest believed.
    pub fn new() -> Self {
        let mut across = Vec::new();
        let mut sigma = STEGER_SIGMA_MIN_PX;
        while sigma <= STEGER_SIGMA_MAX_PX {
            across.push(Taps::new(sigma));
            sigma *= STEGER_SCALE_STEP;
        }
        Self { along: Taps::new(STEGER_SIGMA_ALONG_PX), across }
    }

    /// The scale for lines of this full width at half height along the column.
    pub fn for_width(&self, width_px: f32) -> &Taps {
        let wanted = STEGER_SIGMA_PER_LINE_SIGMA * width_px / WIDTH_PER_SIGMA;
        let idx = self.across.partition_point(|taps| taps.sigma_px < wanted);
        let idx = idx.min(self.across.len() - 1);
        let lower = idx.saturating_sub(1);
        if wanted * wanted < self.across[lower].sigma_px * self.across[idx].sigma_px {
            &self.across[lower]
        } else {
            &self.across[idx]
        }
    }

    /// Σ of the squared weights along the line: how much white noise the smoothing along it leaves.
    pub fn along_gain(&self) -> f32 {
        self.along.smooth.iter().map(|g| g * g).sum()
    }

    /// Variance of the Gaussian along the line, px².
    pub fn along_variance_px2(&self) -> f32 {
        self.along.sigma_px * self.along.sigma_px
    }

    /// Finds the ridge that a column crosses near `from`, stepping from pixel to pixel until the offset ends
    /// inside the pixel. `None` if there is no ridge within the gate.
    ///
    /// Steger's point lies t = −(∇R·n) / (nᵀ H n) along the normal n. On a ridge H = λ n nᵀ and ∇R = (∇R·n) n, so
    /// carrying t·n along the tangent into the column gives −R_v / R_vv, the two derivatives with the least
    /// noise; the direction of the line comes from its neighbours, where it is known far better than from the
    /// other entries of H.
    ///
    /// Where the intensity changes along the line, smoothing mixes in the brighter neighbours and moves the
    /// ridge of a sloping line by slope · σ_u² · ∂ ln R along the line, exactly (a Gaussian's weight times its
    /// distance is its derivative); that much is taken back.
    pub fn ridge<T: Level>(&self, view: &View<T>, across: &Taps, from: Approach) -> Option<Ridge> {
        let last = view.height as f32 - 1.0;
        let mut v = from.v.round().clamp(0.0, last);
        for _ in 0..STEGER_MAX_STEPS {
            let d = self.derivatives(view, across, from.u, v as usize);
            let across_slope = d.rv - from.background_slope;
            if d.rvv >= 0.0 || (v - from.v).abs() > from.gate_px + 1.0 {
                return None;
            }
            let offset = -across_slope / d.rvv;
            if offset.abs() <= 0.55 {
                let found = v + offset;
                let above = d.r - from.background;
                let brightening = (d.ru + from.slope * across_slope) / above.max(f32::MIN_POSITIVE);
                let shift = (self.along_variance_px2() * brightening).clamp(-1.0, 1.0);
                let inside =
                    found >= 0.0 && found <= last && (found - from.v).abs() <= from.gate_px && above > 0.0;
                let v_ridge = f64::from(found - from.slope * shift);
                return inside.then_some(Ridge { v: v_ridge, v_pixel: v as usize, curvature: -d.rvv });
            }
            let stepped = (v + offset.clamp(-4.0, 4.0)).round().clamp(0.0, last);
            if stepped == v {
                return None;
            }
            v = stepped;
        }
        None
    }

    /// Derivatives at one pixel, all from one pass over the window. Beyond the image its border is repeated.
    fn derivatives<T: Level>(&self, view: &View<T>, across: &Taps, u: usize, v: usize) -> Derivatives {
        const LANES: usize = 8;
        let (ru, rv) = (self.along.reach(), across.reach());
        debug_assert!(2 * ru < LANES);
        let (mut smooth, mut first, mut second) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
        let inside = u >= ru && u - ru + LANES <= view.width;
        let mut window = [0.0f32; LANES];
        for k in 0..across.smooth.len() {
            let row = view.row((v + k).saturating_sub(rv).min(view.height - 1));
            if inside {
                for (w, p) in window.iter_mut().zip(&row[u - ru..u - ru + LANES]) {
                    *w = p.grey();
                }
            } else {
                for (i, w) in window.iter_mut().enumerate() {
                    *w = row[(u + i).saturating_sub(ru).min(view.width - 1)].grey();
                }
            }
            let (g0, g1, g2) = (across.smooth[k], across.first[k], across.second[k]);
            for i in 0..LANES {
                smooth[i] += g0 * window[i];
                first[i] += g1 * window[i];
                second[i] += g2 * window[i];
            }
        }
        let dot = |taps: &[f32], lanes: &[f32; LANES]| taps.iter().zip(lanes).map(|(t, l)| t * l).sum::<f32>();
        Derivatives {
            r: dot(&self.along.smooth, &smooth),
            ru: dot(&self.along.first, &smooth),
            rv: dot(&self.along.smooth, &first),
            rvv: dot(&self.along.smooth, &second),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sampled_derivatives_are_exact_on_parabolas() {
        for sigma in [1.0, 2.3, 6.0] {
            let taps = Taps::new(sigma);
            let parabola = |x: f64| 3.0 + 0.7 * x + 0.2 * x * x;
            let reach = taps.reach() as i32;
            let apply = |weights: &[f32]| -> f64 {
                (-reach..=reach).zip(weights).map(|(x, &w)| f64::from(w) * parabola(f64::from(x))).sum()
            };
            // Taps are single precision.
            assert!((apply(&taps.first) - 0.7).abs() < 1e-5);
            assert!((apply(&taps.second) - 0.4).abs() < 1e-5);
        }
    }
}
