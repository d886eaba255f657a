//! Typed access to the pixels of one image, so that the loops are compiled for 8 and for 16 bits.

use super::fast::spread::Difference;
use crate::params::{CELL_HEIGHT_PX, CELL_WIDTH_PX};

/// A whole number that holds the sum of grey levels over the rows of a box, and differences of two such sums.
///
/// Running sums may wrap: their differences are right all the same.
pub trait Sum: Difference + Ord {
    /// One grey level.
    const ONE: Self;
    /// More than any sum.
    const MAX: Self;
    /// Sum.
    fn plus(self, other: Self) -> Self;
    /// Difference.
    fn minus(self, other: Self) -> Self;
    /// The number to calculate with.
    fn number(self) -> f32;
    /// Its absolute value.
    fn abs(self) -> Self;
    /// All bits set where it is negative, otherwise none.
    fn sign(self) -> Self;
    /// Bits set in both.
    fn and(self, other: Self) -> Self;
    /// Bits set in either.
    fn or(self, other: Self) -> Self;
    /// The other bits.
    fn not(self) -> Self;
    /// A whole number that is one.
    fn whole(int: i32) -> Self;
    /// The nearest sum to a number.
    fn nearest(number: f32) -> Self;
}

macro_rules! wrapping_sum {
    ($whole:ty) => {
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
            fn abs(self) -> Self {
                self.wrapping_abs()
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

wrapping_sum!(i16);
wrapping_sum!(i32);

/// Cells summed up at once.
pub const CELL_BLOCK: usize = 4;

/// One row of pixels of cells side by side.
pub type CellRow<T> = [[T; CELL_WIDTH_PX]; CELL_BLOCK];

/// A grey level of an image.
pub trait Level: Difference + Ord {
    /// Holds sums over up to 128 rows.
    type Sum: Sum;
    /// The level as such a sum.
    fn sum(self) -> Self::Sum;
    /// How far two levels are apart.
    fn apart(self, other: Self) -> Self;
    /// The level as a number to calculate with.
    fn grey(self) -> f32;
    /// The sum over a cell.
    fn cell_sum(rows: [&[Self; CELL_WIDTH_PX]; CELL_HEIGHT_PX]) -> Self::Sum;
    /// The sums over some cells side by side.
    fn cell_sums(rows: [&CellRow<Self>; CELL_HEIGHT_PX]) -> [Self::Sum; CELL_BLOCK];
}

impl Level for u8 {
    type Sum = i16;
    #[inline(always)]
    fn sum(self) -> i16 {
        i16::from(self)
    }
    #[inline(always)]
    fn apart(self, other: Self) -> Self {
        self.saturating_sub(other) | other.saturating_sub(self)
    }
    #[inline(always)]
    fn grey(self) -> f32 {
        f32::from(self)
    }
    #[inline(always)]
    fn cell_sum(rows: [&[Self; CELL_WIDTH_PX]; CELL_HEIGHT_PX]) -> i16 {
        // Eight levels as one word: even and odd ones in four lanes of 16 bits, which hold 32 levels.
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
    fn cell_sums(rows: [&CellRow<Self>; CELL_HEIGHT_PX]) -> [i16; CELL_BLOCK] {
        const EVEN: u64 = 0x00FF_00FF_00FF_00FF;
        let mut pairs = [0u64; CELL_BLOCK];
        for row in rows {
            for i in 0..CELL_BLOCK {
                let word = u64::from_le_bytes(row[i]);
                pairs[i] += (word & EVEN) + (word >> 8 & EVEN);
            }
        }
        let mut sums = [0i16; CELL_BLOCK];
        for i in 0..CELL_BLOCK {
            let two = pairs[i] + (pairs[i] >> 32);
            sums[i] = (two + (two >> 16)) as i16;
        }
        sums
    }
}

impl Level for u16 {
    type Sum = i32;
    #[inline(always)]
    fn sum(self) -> i32 {
        i32::from(self)
    }
    #[inline(always)]
    fn apart(self, other: Self) -> Self {
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
    fn cell_sums(rows: [&CellRow<Self>; CELL_HEIGHT_PX]) -> [i32; CELL_BLOCK] {
        std::array::from_fn(|i| Self::cell_sum([&rows[0][i], &rows[1][i], &rows[2][i], &rows[3][i]]))
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

    /// Whether a pixel is at full scale.
    pub fn saturated(&self, u: usize, v: usize) -> bool {
        self.grey(u, v) >= self.full_scale
    }
}
