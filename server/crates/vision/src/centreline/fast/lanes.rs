//! Numbers side by side: what one vector register holds, whatever the instruction set.

use std::ops::{Add, Mul, Sub};

/// Numbers in a register.
pub const LANES: usize = 8;

/// Eight numbers that are calculated with at once.
#[derive(Debug, Clone, Copy, Default)]
pub struct Numbers(pub [f32; LANES]);

impl Numbers {
    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(number: f32) -> Self {
        Self([number; LANES])
    }

    /// The first eight of a slice, which holds as many.
    #[inline(always)]
    pub fn of(slice: &[f32]) -> Self {
        Self(*slice.first_chunk().expect("the caller slices eight"))
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
