//! Typed access to the pixels of one image, so that the loops are compiled for 8 and for 16 bits.

use super::spread::Difference;
use crate::params::{CELL_HEIGHT_PX, CELL_WIDTH_PX};

/// An integer that holds the sum of grey levels over the rows of a box, and differences of two such sums.
///
/// Running sums may wrap; their differences are still right.
pub trait Sum: Copy + Default + Ord + Send + Sync {
    /// One grey level.
    const ONE: Self;
    /// Larger than any sum.
    const MAX: Self;
    /// Sum.
    fn plus(self, other: Self) -> Self;
    /// Difference.
    fn minus(self, other: Self) -> Self;
    /// The sum as a floating-point number.
    fn number(self) -> f32;
    /// The sum as an integer.
    fn int(self) -> i32;
    /// Absolute value, clamped to the largest `u16`.
    fn saturating_abs(self) -> u16;
    /// All bits set if negative, otherwise none.
    fn sign(self) -> Self;
    /// Bitwise and.
    fn and(self, other: Self) -> Self;
    /// Bitwise or.
    fn or(self, other: Self) -> Self;
    /// Bitwise complement.
    fn not(self) -> Self;
    /// The sum with this integer value.
    fn whole(int: i32) -> Self;
    /// The sum nearest to a number.
    fn nearest(number: f32) -> Self;
}

macro_rules! wrapping_sum {
    ($whole:ty, $short:expr) => {
        impl Sum for $whole {
            const ONE: Self = 1;
            const MAX: Self = <$whole>::MAX;
            #[inline(always)]
            fn plus(self, other: Self) -> Self {
                self.wrapping_add(other)
            }
            #[inline(always)]
            fn minus(self, other: Self) -> Self {
                self.wrapping_sub(other)
            }
            #[inline(always)]
            fn number(self) -> f32 {
                self as f32
            }
            #[inline(always)]
            fn int(self) -> i32 {
                self.into()
            }
            #[inline(always)]
            fn saturating_abs(self) -> u16 {
                $short(self.wrapping_abs())
            }
            #[inline(always)]
            fn sign(self) -> Self {
                self >> (<$whole>::BITS - 1)
            }
            #[inline(always)]
            fn and(self, other: Self) -> Self {
                self & other
            }
            #[inline(always)]
            fn or(self, other: Self) -> Self {
                self | other
            }
            #[inline(always)]
            fn not(self) -> Self {
                !self
            }
            #[inline(always)]
            fn whole(int: i32) -> Self {
                int as Self
            }
            #[inline(always)]
            fn nearest(number: f32) -> Self {
                number as Self
            }
        }
    };
}

wrapping_sum!(i16, |whole: i16| whole as u16);
wrapping_sum!(i32, |whole: i32| whole.min(i32::from(u16::MAX)) as u16);

/// One row of pixels, in cells side by side.
pub type CellRow<T> = [[T; CELL_WIDTH_PX]];

/// A grey level of an image.
pub trait Level: Difference + Ord + Into<u16> {
    /// Holds sums over up to 128 rows.
    type Sum: Sum;
    /// The level as a sum.
    fn sum(self) -> Self::Sum;
    /// Absolute difference of two levels.
    fn abs_difference(self, other: Self) -> Self;
    /// The level as a floating-point number.
    fn grey(self) -> f32;
    /// The sum over a cell.
    fn cell_sum(rows: [&[Self; CELL_WIDTH_PX]; CELL_HEIGHT_PX]) -> Self::Sum;
    /// The sums over cells side by side, as many as `sums`.
    fn cell_sums(rows: [&CellRow<Self>; CELL_HEIGHT_PX], sums: &mut [Self::Sum]);
}

impl Level for u8 {
    type Sum = i16;
    #[inline(always)]
    fn sum(self) -> i16 {
        i16::from(self)
    }
    #[inline(always)]
    fn abs_difference(self, other: Self) -> Self {
        self.saturating_sub(other) | other.saturating_sub(self)
    }
    #[inline(always)]
    fn grey(self) -> f32 {
        f32::from(self)
    }
    #[inline(always)]
    fn cell_sum(rows: [&[Self; CELL_WIDTH_PX]; CELL_HEIGHT_PX]) -> i16 {
        // Eight levels as one word: even and odd levels in four lanes of 16 bits each, which hold sums of 32 levels.
        let pairs = |row: &[u8; CELL_WIDTH_PX]| {
            let word = u64::from_le_bytes(*row);
            (word & 0x00FF_00FF_00FF_00FF) + (word >> 8 & 0x00FF_00FF_00FF_00FF)
        };
        let [a, b, c, d] = rows.map(pairs);
        let four = a + b + c + d;
        let two = (four & 0x0000_FFFF_0000_FFFF) + (four >> 16 & 0x0000_FFFF_0000_FFFF);
        (two + (two >> 32)) as i16
    }
    #[inline(always)]
    fn cell_sums([a, b, c, d]: [&CellRow<Self>; CELL_HEIGHT_PX], sums: &mut [i16]) {
        const EVEN: u64 = 0x00FF_00FF_00FF_00FF;
        /// Cells per iteration: the number that compilers vectorise without shuffles.
        const BLOCK: usize = 4;
        let n = sums.len();
        let (some, rest) = sums.as_chunks_mut::<BLOCK>();
        let rows = a.as_chunks::<BLOCK>().0.iter().zip(b.as_chunks::<BLOCK>().0);
        let rows = rows.zip(c.as_chunks::<BLOCK>().0).zip(d.as_chunks::<BLOCK>().0);
        for (sums, (((a, b), c), d)) in some.iter_mut().zip(rows) {
            let mut pairs = [0u64; BLOCK];
            for row in [a, b, c, d] {
                for i in 0..BLOCK {
                    let word = u64::from_le_bytes(row[i]);
                    pairs[i] += (word & EVEN) + (word >> 8 & EVEN);
                }
            }
            for i in 0..BLOCK {
                let two = pairs[i] + (pairs[i] >> 32);
                sums[i] = (two + (two >> 16)) as i16;
            }
        }
        for (sum, i) in rest.iter_mut().zip(n - n % BLOCK..) {
            *sum = Self::cell_sum([&a[i], &b[i], &c[i], &d[i]]);
        }
    }
}

impl Level for u16 {
    type Sum = i32;
    #[inline(always)]
    fn sum(self) -> i32 {
        i32::from(self)
    }
    #[inline(always)]
    fn abs_difference(self, other: Self) -> Self {
        self.saturating_sub(other) | other.saturating_sub(self)
    }
    #[inline(always)]
    fn grey(self) -> f32 {
        f32::from(self)
    }
    #[inline(always)]
    fn cell_sum(rows: [&[Self; CELL_WIDTH_PX]; CELL_HEIGHT_PX]) -> i32 {
        let mut sums = [0u32; CELL_WIDTH_PX];
        for row in rows {
            (0..CELL_WIDTH_PX).for_each(|i| sums[i] += u32::from(row[i]));
        }
        sums.iter().sum::<u32>() as i32
    }
    #[inline(always)]
    fn cell_sums([a, b, c, d]: [&CellRow<Self>; CELL_HEIGHT_PX], sums: &mut [i32]) {
        const EVEN: u64 = 0x0000_FFFF_0000_FFFF;
        /// See the sums for 8 bits.
        const BLOCK: usize = 2;
        // Four levels as one word: even and odd levels in two lanes of 32 bits.
        let pairs = |levels: &[u8; 8]| {
            let word = u64::from_ne_bytes(*levels);
            (word & EVEN) + (word >> 16 & EVEN)
        };
        let n = sums.len();
        let (some, rest) = sums.as_chunks_mut::<BLOCK>();
        let rows = a.as_chunks::<BLOCK>().0.iter().zip(b.as_chunks::<BLOCK>().0);
        let rows = rows.zip(c.as_chunks::<BLOCK>().0).zip(d.as_chunks::<BLOCK>().0);
        for (sums, (((a, b), c), d)) in some.iter_mut().zip(rows) {
            let mut both = [0u64; 2 * BLOCK];
            for row in [a, b, c, d] {
                let fours: &[[u8; 8]; 2 * BLOCK] = bytemuck::cast_ref(row);
                for i in 0..2 * BLOCK {
                    both[i] += pairs(&fours[i]);
                }
            }
            for i in 0..BLOCK {
                let two = both[2 * i] + both[2 * i + 1];
                sums[i] = (two + (two >> 32)) as i32;
            }
        }
        for (sum, i) in rest.iter_mut().zip(n - n % BLOCK..) {
            *sum = Self::cell_sum([&a[i], &b[i], &c[i], &d[i]]);
        }
    }
}

/// Row-major pixels with their size. Lines run along the rows.
#[derive(Clone, Copy)]
pub struct View<'a, T> {
    /// Grey levels, `width` × `height`.
    pub pixels: &'a [T],
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The largest grey level.
    pub full_scale: f32,
    /// See [`crate::GreyImage::hidden_noise`].
    pub hidden_noise: f32,
}

impl<T: Level> View<'_, T> {
    /// One row.
    #[inline(always)]
    pub fn row(&self, v: usize) -> &[T] {
        &self.pixels[v * self.width..(v + 1) * self.width]
    }

    /// One grey level.
    #[inline(always)]
    pub fn grey(&self, u: usize, v: usize) -> f32 {
        self.pixels[v * self.width + u].grey()
    }
}
