//! Shares of belief of all labels of all pieces, piece beside piece: sums and maxima over labels never cross a register.

/// Memory of the shares.
#[derive(Debug, Default)]
pub struct Softmax {
    /// Per label and piece: what speaks for it, then its share.
    shares: Vec<f64>,
    /// Per piece: the largest of its labels, and their sum.
    tops: Vec<f64>,
    sums: Vec<f64>,
}

impl Softmax {
    /// Shares in proportion to e to the power of `sharpness` times what `supports` says of a piece and a label. One list of
    /// all pieces after the other, label by label, each filled up to [`width`].
    #[inline(always)]
    pub fn share<const N: usize>(&mut self, supports: &[[f64; N]], n_labels: usize, sharpness: f64) -> &[f64] {
        let width = width(supports.len());
        // What stays in entries beyond the last piece are shares: numbers, which nobody asks for.
        for (list, n) in [(&mut self.tops, width), (&mut self.sums, width), (&mut self.shares, n_labels * width)] {
            list.resize(n, 0.0);
        }
        let (tops, sums, shares) = (&mut self.tops[..], &mut self.sums[..width], &mut self.shares[..]);
        let tops = &mut tops[..width];
        tops.fill(f64::NEG_INFINITY);
        sums.fill(0.0);
        for label in 0..n_labels {
            let shares = &mut shares[label * width..][..width];
            for (share, support) in shares.iter_mut().zip(supports) {
                *share = support[label];
            }
            for i in 0..width {
                tops[i] = if shares[i] > tops[i] { shares[i] } else { tops[i] };
            }
        }
        for label in 0..n_labels {
            let shares = &mut shares[label * width..][..width];
            for i in 0..width {
                shares[i] = (shares[i] - tops[i]) * sharpness;
            }
        }
        for share in shares.iter_mut() {
            *share = exponential(*share);
        }
        for label in 0..n_labels {
            let shares = &shares[label * width..][..width];
            for i in 0..width {
                sums[i] += shares[i];
            }
        }
        for sum in sums.iter_mut() {
            *sum = 1.0 / *sum;
        }
        for label in 0..n_labels {
            let shares = &mut shares[label * width..][..width];
            for i in 0..width {
                shares[i] *= sums[i];
            }
        }
        &self.shares
    }
}

/// Entries of a list of pieces: whole registers, whatever the instruction set.
#[inline(always)]
pub fn width(n_pieces: usize) -> usize {
    n_pieces.next_multiple_of(8)
}

/// e to the power of a number that is not positive, to two units in the last place; nothing below e⁻⁷⁰⁰.
#[inline(always)]
fn exponential(x: f64) -> f64 {
    let power = if x > LEAST_EXPONENT { x } else { LEAST_EXPONENT };
    // In these numbers one is a unit in the last place: adding rounds, and the lowest bits hold the result.
    let rounded = power * std::f64::consts::LOG2_E + ROUNDING;
    let whole = rounded - ROUNDING;
    let rest = (power - whole * LN_2_HIGH) - whole * LN_2_LOW;
    let scale = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
    let mut sum = FACTORIALS[FACTORIALS.len() - 1];
    for factor in FACTORIALS.iter().rev().skip(1) {
        sum = sum * rest + factor;
    }
    if x > LEAST_EXPONENT { sum * scale } else { 0.0 }
}

/// Powers of e below this one are taken for nothing.
const LEAST_EXPONENT: f64 = -700.0;

/// 1.5 · 2⁵²: numbers nearby are whole.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// ln 2 in two parts; products of the first with whole numbers up to a thousand are exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
/// See [`LN_2_HIGH`].
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// 1 / k!: the power series of e up to where its terms are lost in rounding, within ln 2 / 2 of zero.
const FACTORIALS: [f64; 14] = [
    1.0,
    1.0,
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative error of e^x: a few units in the last place.
    const EXPONENTIAL_ERROR: f64 = 1e-15;

    #[test]
    fn the_exponential_is_that_of_the_library() {
        for step in 0..70_000 {
            let x = -0.01 * f64::from(step) + 1e-3;
            let found = exponential(x);
            assert!((found / x.exp() - 1.0).abs() < EXPONENTIAL_ERROR || x <= LEAST_EXPONENT, "e^{x}");
        }
        assert_eq!([0.0, -1e9, f64::NEG_INFINITY].map(exponential), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn shares_sum_up_to_one_and_impossible_labels_have_none() {
        let supports = [[0.3, -0.4, f64::NEG_INFINITY, 0.2], [-3000.0, f64::NEG_INFINITY, -3000.0, 9.0]];
        let mut softmax = Softmax::default();
        let found = softmax.share(&supports, 4, 3.0);
        let weights = [0.0f64, -2.1, -0.3].map(f64::exp);
        let sum: f64 = weights.iter().sum();
        for (label, weight) in [0, 1, 3].into_iter().zip(weights) {
            assert!((found[8 * label] - weight / sum).abs() < EXPONENTIAL_ERROR);
        }
        assert_eq!(found[16], 0.0);
        // The last label of the second piece does not take part.
        let found = softmax.share(&supports, 3, 3.0);
        assert_eq!([found[1], found[9], found[17]], [0.5, 0.0, 0.5]);
    }
}
