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
        let (mut best, mut most) = (0, self.0[0]);
        for i in 1..n {
            (best, most) = if self.0[i] > most { (i, self.0[i]) } else { (best, most) };
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_equals_is_the_largest_and_has_no_margin() {
        let lanes = Lanes([0.1, 0.5, 0.5, 9.0]);
        assert_eq!((lanes.largest(3), lanes.margin(1, 3), lanes.margin(3, 4)), (1, 0.0, 8.5));
    }
}
