//! Predicts one colour of an image from the other two in ambient light, so that the excess is laser light.
//!
//! Grey objects reflect daylight or lamp light with the same ratio of colours everywhere: one colour is a weighted sum
//! of the other two. Any excess is other light. The weights are fitted to each image, so that white balance and colour
//! temperature cancel. Subtracting only the brighter of the other colours would leave a tenth of the contrast of a
//! board's squares, whose edges interrupt the lines.

use statistics::{SIGMA_PER_MAD, median};

use super::{ColourImage, Level};

/// Samples along each side of the image to which the weights are fitted: enough for a thousandth, and fast.
const SAMPLES_PER_SIDE: usize = 160;
/// Brightness, as a fraction of full scale, above which a pixel's colour is not just noise.
const BRIGHT: f32 = 0.06;
/// Darkest colour over brightest, above which a pixel may be a grey object in ambient light; laser light is far below.
const GREY_RATIO: f32 = 0.5;
/// Fraction of full scale above which a colour may be clipped, so that its brightness is unknown.
const CLIPPED: f32 = 0.97;
/// Fewest pixels for a fit of the weights; with fewer, ambient light is insignificant.
const MIN_SAMPLES: usize = 100;
/// Repetitions of the fit without its outliers: the laser and coloured objects.
const TRIMS: usize = 4;
/// Residual, in standard deviations, above which a pixel is an outlier.
const TRIM_SIGMAS: f32 = 3.0;
/// Weight of the regularisation towards equal weights, relative to the sum of squares: it decides only where the other
/// two colours do not differ.
const EVEN_WEIGHT: f64 = 1e-3;

/// Ambient light: one colour as a weighted sum of the other two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AmbientLight {
    colour: usize,
    others: [usize; 2],
    /// Weights of the other two; `None` without ambient light, when the brighter of them is subtracted.
    weights: Option<[f32; 2]>,
}

impl AmbientLight {
    /// Fits the weights for `colour` (0 red, 1 green, 2 blue) of an image.
    pub(super) fn of(image: &ColourImage, colour: usize) -> Self {
        let others = [(colour + 1) % 3, (colour + 2) % 3];
        let mut samples = grey_samples(image, colour, others);
        let mut weights = None;
        for _ in 0..TRIMS {
            if samples.len() < MIN_SAMPLES {
                break;
            }
            let fitted = fit(&samples);
            weights = Some(fitted);
            let departure = |[own, a, b]: &[f32; 3]| (own - fitted[0] * a - fitted[1] * b).abs();
            let mut departures: Vec<f32> = samples.iter().map(departure).collect();
            let typical = median(&mut departures).unwrap_or(0.0);
            // Rounding to grey levels alone makes residuals of half a level.
            let limit = TRIM_SIGMAS * (SIGMA_PER_MAD as f32 * typical).max(image.full_scale() / 255.0);
            samples.retain(|sample| departure(sample) <= limit);
        }
        Self { colour, others, weights }
    }

    /// Excess of the colour over ambient light in a pixel; zero where there is none.
    pub(super) fn excess<T: Level>(&self, rgb: [T; 3]) -> T {
        T::nearest(self.signed_excess(rgb.map(Into::into)))
    }

    /// The same, negative where there is less of the colour.
    pub(super) fn signed_excess(&self, rgb: [f32; 3]) -> f32 {
        let [a, b] = self.others.map(|other| rgb[other]);
        rgb[self.colour] - self.weights.map_or(a.max(b), |[of_a, of_b]| of_a * a + of_b * b)
    }
}

/// The colour and the other two of pixels that may be grey objects, on an even grid.
fn grey_samples(image: &ColourImage, colour: usize, others: [usize; 2]) -> Vec<[f32; 3]> {
    let full = image.full_scale();
    let (step_u, step_v) = (image.width().div_ceil(SAMPLES_PER_SIDE), image.height().div_ceil(SAMPLES_PER_SIDE));
    let places =
        (0..image.height()).step_by(step_v).flat_map(|v| (0..image.width()).step_by(step_u).map(move |u| (u, v)));
    let may_be_grey = |rgb: &[f32; 3]| {
        let brightest = rgb.iter().copied().fold(f32::MIN, f32::max);
        let darkest = rgb.iter().copied().fold(f32::MAX, f32::min);
        brightest > BRIGHT * full && brightest < CLIPPED * full && darkest > GREY_RATIO * brightest
    };
    let samples = places.map(|(u, v)| image.at(u, v)).filter(may_be_grey);
    samples.map(|rgb| [rgb[colour], rgb[others[0]], rgb[others[1]]]).collect()
}

/// Least squares for own = w₀ a + w₁ b with non-negative weights.
fn fit(samples: &[[f32; 3]]) -> [f32; 2] {
    let sum = |term: fn([f64; 3]) -> f64| samples.iter().map(|sample| term(sample.map(f64::from))).sum::<f64>();
    let (aa, ab, bb) = (sum(|[_, a, _]| a * a), sum(|[_, a, b]| a * b), sum(|[_, _, b]| b * b));
    let (ya, yb) = (sum(|[y, a, _]| y * a), sum(|[y, _, b]| y * b));
    let even = EVEN_WEIGHT * (aa + bb);
    let (paa, pab, pbb) = (aa + even, ab - even, bb + even);
    let determinant = paa * pbb - pab * pab;
    let weights = [(ya * pbb - yb * pab) / determinant, (yb * paa - ya * pab) / determinant];
    match weights {
        [of_a, _] if of_a < 0.0 => [0.0, (yb / bb) as f32],
        [_, of_b] if of_b < 0.0 => [(ya / aa) as f32, 0.0],
        both => both.map(|weight| weight as f32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Pixels};

    /// Grey objects of several shades in light of this colour, with a stripe of red light on them.
    fn lit(light: [f64; 3], stripe: f64) -> ColourImage {
        let pixel = |idx: usize| {
            let (u, v) = (idx % 200, idx / 200);
            let shade = 20.0 + ((u / 10 + v / 10) % 7) as f64 * 20.0;
            let red = if v == 50 { stripe } else { 0.0 };
            [0, 1, 2].map(|c| (shade * light[c] + if c == 0 { red } else { 0.0 }).round().min(255.0) as u8)
        };
        ColourImage::new(200, 100, Pixels::Eight((0..200 * 100).flat_map(pixel).collect())).unwrap()
    }

    #[test]
    fn ambient_light_of_any_colour_temperature_is_removed() {
        for light in [[1.0, 1.0, 1.0], [1.2, 1.0, 0.75], [0.75, 1.0, 1.2]] {
            let excess = lit(light, 60.0).channel(Channel::RedMinusOthers);
            for (u, v) in (0..200).flat_map(|u| (0..100).map(move |v| (u, v))) {
                let expected = if v == 50 { 60.0 } else { 0.0 };
                // Each of the three levels is rounded by up to a half.
                assert!((excess.at(u, v) - expected).abs() <= 2.0, "{light:?} ({u}, {v}): {}", excess.at(u, v));
            }
        }
    }

    #[test]
    fn without_ambient_light_the_laser_is_not_subtracted() {
        // A red laser that also lights a tenth of the other pixels, and no other light.
        let pixel = |idx: usize| if idx / 200 % 20 < 4 { [200_u8, 20, 16] } else { [3, 3, 3] };
        let image = ColourImage::new(200, 100, Pixels::Eight((0..200 * 100).flat_map(pixel).collect())).unwrap();
        assert_eq!(image.channel(Channel::RedMinusOthers).at(10, 1), 180.0);
    }
}
