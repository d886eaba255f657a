//! Shares of belief of all labels, piece beside piece: sums and maxima over labels never cross a register.

use super::beliefs::BLOCK;

/// Makes of what speaks for each label of each piece its share: in proportion to e to the power of `sharpness` times that.
#[inline(always)]
pub fn share<const L: usize>(shares: &mut [[f64; BLOCK]; L], sharpness: f64) {
    let mut tops = [f64::NEG_INFINITY; BLOCK];
    for label in 0..L {
        for i in 0..BLOCK {
            tops[i] = if shares[label][i] > tops[i] { shares[label][i] } else { tops[i] };
        }
    }
    for label in 0..L {
        for i in 0..BLOCK {
            shares[label][i] = (shares[label][i] - tops[i]) * sharpness;
        }
    }
    for share in shares.as_flattened_mut() {
        *share = exponential(*share);
    }
    let mut sums = [0.0; BLOCK];
    for label in 0..L {
        for i in 0..BLOCK {
            sums[i] += shares[label][i];
        }
    }
    for i in 0..BLOCK {
        sums[i] = 1.0 / sums[i];
    }
    for label in 0..L {
        for i in 0..BLOCK {
            shares[label][i] *= sums[i];
        }
    }
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
    if x > LEAST_EXPONENT { series(rest) * scale } else { 0.0 }
}

/// The power series of e by parts that need not wait for each other.
#[inline(always)]
fn series(x: f64) -> f64 {
    let f = &FACTORIALS;
    let (x2, x4, x8) = (x * x, (x * x) * (x * x), ((x * x) * (x * x)) * ((x * x) * (x * x)));
    let low = ((f[0] + f[1] * x) + (f[2] + f[3] * x) * x2) + ((f[4] + f[5] * x) + (f[6] + f[7] * x) * x2) * x4;
    let high = ((f[8] + f[9] * x) + (f[10] + f[11] * x) * x2) + (f[12] + f[13] * x) * x4;
    low + high * x8
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
        let share_of = |n_labels: usize| {
            let mut shares = [[0.0; BLOCK]; 4];
            for (label, shares) in shares.iter_mut().enumerate() {
                for (piece, share) in shares.iter_mut().enumerate() {
                    *share = if label < n_labels { supports[piece % 2][label] } else { f64::NEG_INFINITY };
                }
            }
            share(&mut shares, 3.0);
            shares
        };
        let found = share_of(4);
        let weights = [0.0f64, -2.1, -0.3].map(f64::exp);
        let sum: f64 = weights.iter().sum();
        for (label, weight) in [0, 1, 3].into_iter().zip(weights) {
            assert!((found[label][0] - weight / sum).abs() < EXPONENTIAL_ERROR);
        }
        assert_eq!(found[2][0], 0.0);
        // The last label of the second piece does not take part.
        let found = share_of(3);
        assert_eq!([found[0][1], found[1][1], found[2][1]], [0.5, 0.0, 0.5]);
    }
}
