//! Vectors of numbers: the content of one or two vector registers on any instruction set.

use std::ops::{Add, Mul, Sub};

use crate::centreline::view::Level;

/// Numbers per vector.
pub const LANES: usize = 16;

/// A vector of [`LANES`] numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Numbers(pub [f32; LANES]);

impl Numbers {
    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(number: f32) -> Self {
        Self([number; LANES])
    }

    /// The first [`LANES`] numbers of a slice, which must hold as many.
    #[inline(always)]
    pub fn of(slice: &[f32]) -> Self {
        Self(*slice.first_chunk().expect("the caller slices as many"))
    }

    /// Grey levels.
    #[inline(always)]
    pub fn greys<T: Level>(levels: &[T; LANES]) -> Self {
        let mut greys = [0.0; LANES];
        for i in 0..LANES {
            greys[i] = levels[i].grey();
        }
        Self(greys)
    }

    /// The larger of each pair; the second where the first is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.where_over(other, self, other)
    }

    /// Lane by lane: `over` where this is more than `limit`, otherwise `otherwise`.
    #[inline(always)]
    pub fn where_over(self, limit: Self, over: Self, otherwise: Self) -> Self {
        let mut result = [0.0; LANES];
        for i in 0..LANES {
            result[i] = if self.0[i] > limit.0[i] { over.0[i] } else { otherwise.0[i] };
        }
        Self(result)
    }

    /// 1 where the lane equals `number`, otherwise 0.
    #[inline(always)]
    pub fn is(self, number: f32) -> Self {
        let mut result = [0.0; LANES];
        for i in 0..LANES {
            result[i] = if self.0[i] == number { 1.0 } else { 0.0 };
        }
        Self(result)
    }

    /// Whether any lane is over zero.
    #[inline(always)]
    pub fn any_over_zero(self) -> bool {
        self.0.iter().fold(false, |any, &number| any | (number > 0.0))
    }

    /// The sum of all lanes, by pairwise halving.
    #[inline(always)]
    pub fn sum(self) -> f32 {
        let mut numbers = self.0;
        let mut half = LANES / 2;
        while half > 0 {
            for i in 0..half {
                numbers[i] += numbers[i + half];
            }
            half /= 2;
        }
        numbers[0]
    }

    /// The smallest lane.
    #[inline(always)]
    pub fn least(self) -> f32 {
        let mut numbers = self.0;
        let mut half = LANES / 2;
        while half > 0 {
            for i in 0..half {
                let other = numbers[i + half];
                numbers[i] = if other < numbers[i] { other } else { numbers[i] };
            }
            half /= 2;
        }
        numbers[0]
    }
}

macro_rules! lane_by_lane {
    ($trait:ident, $method:ident) => {
        impl $trait for Numbers {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut result = [0.0; LANES];
                for i in 0..LANES {
                    result[i] = self.0[i].$method(other.0[i]);
                }
                Self(result)
            }
        }
    };
}

lane_by_lane!(Add, add);
lane_by_lane!(Sub, sub);
lane_by_lane!(Mul, mul);

impl Mul<f32> for Numbers {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        self * Self::splat(factor)
    }
}
