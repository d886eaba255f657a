//! Typed access to the pixels of one image, so that the loops are compiled for 8 and for 16 bits.

/// A grey level of an image.
pub trait Level: Copy {
    /// The level as an integer.
    fn int(self) -> i32;
    /// The level as a number to calculate with.
    fn grey(self) -> f32;
}

impl Level for u8 {
    fn int(self) -> i32 {
        i32::from(self)
    }
    fn grey(self) -> f32 {
        f32::from(self)
    }
}

impl Level for u16 {
    fn int(self) -> i32 {
        i32::from(self)
    }
    fn grey(self) -> f32 {
        f32::from(self)
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
    pub fn row(&self, v: usize) -> &[T] {
        &self.pixels[v * self.width..(v + 1) * self.width]
    }

    /// One grey level.
    pub fn grey(&self, u: usize, v: usize) -> f32 {
        self.pixels[v * self.width + u].grey()
    }

    /// Whether a pixel is at full scale.
    pub fn saturated(&self, u: usize, v: usize) -> bool {
        self.grey(u, v) >= self.full_scale
    }
}
