//! Typed access to the pixels of one image, so that the loops are compiled for 8 and for 16 bits.

use crate::params::{CELL_HEIGHT_PX, CELL_WIDTH_PX};

/// A grey level of an image.
pub trait Level: Copy + Send + Sync {
    /// The level as an integer.
    fn int(self) -> i32;
    /// The level as a number to calculate with.
    fn grey(self) -> f32;
    /// The sum over a cell.
    fn sum(rows: [&[Self; CELL_WIDTH_PX]; CELL_HEIGHT_PX]) -> i32;
}

impl Level for u8 {
    #[inline(always)]
    fn int(self) -> i32 {
        i32::from(self)
    }
    #[inline(always)]
    fn grey(self) -> f32 {
        f32::from(self)
    }
    #[inline(always)]
    fn sum(rows: [&[Self; CELL_WIDTH_PX]; CELL_HEIGHT_PX]) -> i32 {
        // Eight levels as one word: even and odd ones in four lanes of 16 bits, which hold 32 levels.
        let pairs = |row: &[u8; CELL_WIDTH_PX]| {
            let word = u64::from_le_bytes(*row);
            (word & 0x00FF_00FF_00FF_00FF) + (word >> 8 & 0x00FF_00FF_00FF_00FF)
        };
        let [a, b, c, d] = rows.map(pairs);
        let four = a + b + c + d;
        let two = (four & 0x0000_FFFF_0000_FFFF) + (four >> 16 & 0x0000_FFFF_0000_FFFF);
        (two as u32 + (two >> 32) as u32) as i32
    }
}

impl Level for u16 {
    #[inline(always)]
    fn int(self) -> i32 {
        i32::from(self)
    }
    #[inline(always)]
    fn grey(self) -> f32 {
        f32::from(self)
    }
    #[inline(always)]
    fn sum(rows: [&[Self; CELL_WIDTH_PX]; CELL_HEIGHT_PX]) -> i32 {
        let mut sums = [0u32; CELL_WIDTH_PX];
        for row in rows {
            (0..CELL_WIDTH_PX).for_each(|i| sums[i] += u32::from(row[i]));
        }
        sums.iter().sum::<u32>() as i32
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
