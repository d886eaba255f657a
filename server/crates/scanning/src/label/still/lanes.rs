//! All labels of a piece side by side: what one or two vector registers hold, whatever the instruction set.
//!
//! No fused multiply-add and no sums across lanes in an order that depends on their number, so that every instruction
//! set gives the same bits.

/// One number per label; labels that a station has not are there too, and never win.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lanes<const N: usize>(pub [f64; N]);

impl<const N: usize> Lanes<N> {
    /// The same number for every label.
    #[inline(always)]
    pub fn splat(number: f64) -> Self {
        Self([number; N])
    }

    /// This and `factor` times `other`.
    #[inline(always)]
    pub fn plus(mut self, factor: f64, other: &Self) -> Self {
        for i in 0..N {
            self.0[i] += factor * other.0[i];
        }
        self
    }

    /// This without `factor` times `other`.
    #[inline(always)]
    pub fn minus(mut self, factor: f64, other: &Self) -> Self {
        for i in 0..N {
            self.0[i] -= factor * other.0[i];
        }
        self
    }

    /// The sum with `other`.
    #[inline(always)]
    pub fn and(mut self, other: &Self) -> Self {
        for i in 0..N {
            self.0[i] += other.0[i];
        }
        self
    }

    /// The larger of this and `other`.
    #[inline(always)]
    pub fn or(mut self, other: &Self) -> Self {
        for i in 0..N {
            self.0[i] = if other.0[i] > self.0[i] { other.0[i] } else { self.0[i] };
        }
        self
    }

    /// All divided by one number.
    #[inline(always)]
    pub fn over(mut self, divisor: f64) -> Self {
        for i in 0..N {
            self.0[i] /= divisor;
        }
        self
    }

    /// Index of the largest among the first `n`, the first of equals.
    #[inline(always)]
    pub fn largest(&self, n: usize) -> usize {
        let mut best = 0;
        for i in 1..n {
            best = if self.0[i] > self.0[best] { i } else { best };
        }
        best
    }

    /// By how much a label beats the next best among the first `n`.
    #[inline(always)]
    pub fn margin(&self, label: usize, n: usize) -> f64 {
        let mut next = f64::NEG_INFINITY;
        for i in 0..n {
            next = if i != label { next.max(self.0[i]) } else { next };
        }
        self.0[label] - next
    }

    /// Shares of belief: in proportion to e to the power of `sharpness` times each number.
    #[inline(always)]
    pub fn softmax(mut self, sharpness: f64) -> Self {
        let mut top = self.0;
        let mut width = N / 2;
        while width > 0 {
            for i in 0..width {
                top[i] = if top[i] > top[i + width] { top[i] } else { top[i + width] };
            }
            width /= 2;
        }
        for i in 0..N {
            self.0[i] = (self.0[i] - top[0]) * sharpness;
        }
        let weights = self.exponential();
        let mut sum = weights.0;
        let mut width = N / 2;
        while width > 0 {
            for i in 0..width {
                sum[i] += sum[i + width];
            }
            width /= 2;
        }
        weights.over(sum[0])
    }

    /// e to the power of numbers that are not positive, to two units in the last place; nothing below e⁻⁷⁰⁰.
    #[inline(always)]
    fn exponential(self) -> Self {
        let (mut powers, mut rest, mut scales) = ([0.0; N], [0.0; N], [0.0; N]);
        for i in 0..N {
            powers[i] = if self.0[i] > LEAST_EXPONENT { self.0[i] } else { LEAST_EXPONENT };
        }
        for i in 0..N {
            // In these numbers one is a unit in the last place: adding rounds, and the lowest bits hold the result.
            let rounded = powers[i] * std::f64::consts::LOG2_E + ROUNDING;
            let whole = rounded - ROUNDING;
            rest[i] = (powers[i] - whole * LN_2_HIGH) - whole * LN_2_LOW;
            scales[i] = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
        }
        let mut sum = [FACTORIALS[FACTORIALS.len() - 1]; N];
        for factor in FACTORIALS.iter().rev().skip(1) {
            for i in 0..N {
                sum[i] = sum[i] * rest[i] + factor;
            }
        }
        for i in 0..N {
            sum[i] = if self.0[i] > LEAST_EXPONENT { sum[i] * scales[i] } else { 0.0 };
        }
        Self(sum)
    }
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
            let found = Lanes([x, 0.0, -1e9, f64::NEG_INFINITY]).exponential().0;
            assert!((found[0] / x.exp() - 1.0).abs() < EXPONENTIAL_ERROR || x <= LEAST_EXPONENT, "e^{x}");
            assert_eq!(found[1..], [1.0, 0.0, 0.0]);
        }
    }

    #[test]
    fn beliefs_sum_up_to_one_and_impossible_labels_have_none() {
        let found = Lanes([0.3, -0.4, f64::NEG_INFINITY, 0.2]).softmax(3.0).0;
        let weights = [0.0f64, -2.1, -0.3].map(f64::exp);
        let sum: f64 = weights.iter().sum();
        for (found, weight) in [found[0], found[1], found[3]].iter().zip(weights) {
            assert!((found - weight / sum).abs() < EXPONENTIAL_ERROR);
        }
        assert_eq!(found[2], 0.0);
    }

    #[test]
    fn the_first_of_equals_is_the_largest_and_has_no_margin() {
        let lanes = Lanes([0.1, 0.5, 0.5, 9.0]);
        assert_eq!((lanes.largest(3), lanes.margin(1, 3), lanes.margin(3, 4)), (1, 0.0, 8.5));
    }
}
