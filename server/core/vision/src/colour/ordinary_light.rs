//! What one colour of a picture has to do with the other two by ordinary light, so that a laser stands out of it.
//!
//! Grey things reflect daylight or a lamp in the same proportion of colours everywhere: one colour is a weighted sum of the
//! other two. What exceeds it is light of another kind. The weights are fitted to each picture, so that the white balance
//! of a camera and the warmth of a lamp leave nothing behind: the brighter of the other colours alone leaves a tenth of a
//! board's squares, whose edges break the lines.

use statistics::median;

use super::{ColourImage, Level};

/// Samples along each side of the picture that the weights are fitted to: known to a thousandth, and soon done.
const SAMPLES_PER_SIDE: usize = 160;
/// Brightness, of full scale, from which a pixel shows a colour and not noise.
const BRIGHT: f32 = 0.06;
/// Darkest colour over brightest, from which a pixel may be a grey thing in the light of a room; a laser's are far below.
const GREY_RATIO: f32 = 0.5;
/// From this share of full scale a colour may be clipped and its brightness is unknown.
const CLIPPED: f32 = 0.97;
/// Fewest pixels that weights are fitted to; with less there is no ordinary light to speak of.
const MIN_SAMPLES: usize = 100;
/// Times the fit is repeated without what departed from it: the laser, coloured things.
const TRIMS: usize = 4;
/// Departure, in standard deviations of the others, from which a pixel is left out.
const TRIM_SIGMAS: f32 = 3.0;
/// Standard deviations per median departure of a normal distribution.
const SIGMA_PER_MEDIAN: f32 = 1.4826;
/// Weight of the wish that both other colours count the same, of their own sum of squares: decides only where they do not
/// differ.
const EVEN_WEIGHT: f64 = 1e-3;

/// How one colour follows from the other two where there is only ordinary light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OrdinaryLight {
    colour: usize,
    others: [usize; 2],
    /// Weights of the other two; `None` in the dark, where the brighter of them stands in.
    weights: Option<[f32; 2]>,
}

impl OrdinaryLight {
    /// Fits the weights for `colour` (0 red, 1 green, 2 blue) of a picture.
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
            // Rounding to grey levels alone makes departures of half a level.
            let limit = TRIM_SIGMAS * (SIGMA_PER_MEDIAN * typical).max(image.full_scale() / 255.0);
            samples.retain(|sample| departure(sample) <= limit);
        }
        Self { colour, others, weights }
    }

    /// By how much the colour exceeds ordinary light in a pixel; zero where it does not.
    pub(super) fn excess<T: Level>(&self, rgb: [T; 3]) -> T {
        let [a, b] = self.others.map(|other| rgb[other]);
        match self.weights {
            Some([of_a, of_b]) => T::nearest(rgb[self.colour].into() - of_a * a.into() - of_b * b.into()),
            None => rgb[self.colour].above(a.max(b)),
        }
    }
}

/// The colour and the other two of pixels that may be grey things, from an even grid.
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

/// Least squares for own = w₀ a + w₁ b, neither weight below zero.
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

    /// Grey things of many shades by light of that colour, with a stripe of red light over them.
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
    fn ordinary_light_of_any_warmth_leaves_nothing_but_the_laser() {
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
    fn in_the_dark_the_laser_itself_is_not_taken_for_ordinary_light() {
        // A red laser that also lights a tenth of the other pixels, and nothing else.
        let pixel = |idx: usize| if idx / 200 % 20 < 4 { [200_u8, 20, 16] } else { [3, 3, 3] };
        let image = ColourImage::new(200, 100, Pixels::Eight((0..200 * 100).flat_map(pixel).collect())).unwrap();
        assert_eq!(image.channel(Channel::RedMinusOthers).at(10, 1), 180.0);
    }
}
