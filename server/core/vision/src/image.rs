//! The image type of the processing core: one channel, 8 or 16 bit, row-major.

/// Grey levels, row-major, top row first.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// 0–255.
    Eight(Vec<u8>),
    /// 0–65535.
    Sixteen(Vec<u16>),
}

/// Mutable access to the grey levels of an image.
#[derive(Debug)]
pub enum LevelsMut<'a> {
    /// 0–255.
    Eight(&'a mut [u8]),
    /// 0–65535.
    Sixteen(&'a mut [u16]),
}

/// Longest side of an image: row indices are computed in 16 bits, and no camera has more pixels.
pub const MAX_SIDE_PX: usize = 1 << 14;

/// A single-channel image of raw (distorted) sensor pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyImage {
    width: usize,
    height: usize,
    pixels: Pixels,
    /// See [`GreyImage::hidden_noise`].
    hidden_noise: f32,
}

/// Why an image cannot be created from a buffer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// The buffer does not hold `width` × `height` pixels.
    #[error("an image of {width}×{height} needs {needed} pixels, got {got}")]
    WrongLength {
        /// Requested columns.
        width: usize,
        /// Requested rows.
        height: usize,
        /// `width * height`.
        needed: usize,
        /// Pixels in the buffer.
        got: usize,
    },
    /// One of the sides is longer than [`MAX_SIDE_PX`].
    #[error("an image of {width}×{height} has a side of more than {MAX_SIDE_PX} pixels; crop or downscale it")]
    TooLarge {
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
    },
    /// One of the sides is zero.
    #[error("an image needs at least one row and one column, got {width}×{height}")]
    Empty {
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
    },
}

fn check_sides(width: usize, height: usize) -> Result<(), ImageError> {
    match (width.min(height), width.max(height)) {
        (0, _) => Err(ImageError::Empty { width, height }),
        (_, longest) if longest > MAX_SIDE_PX => Err(ImageError::TooLarge { width, height }),
        _ => Ok(()),
    }
}

impl GreyImage {
    /// Wraps `pixels` (row-major) as an image of `width` × `height`.
    ///
    /// # Errors
    /// [`ImageError::Empty`] if a side is zero, [`ImageError::TooLarge`] if one is too long, [`ImageError::WrongLength`] if the buffer does not fit.
    pub fn new(width: usize, height: usize, pixels: Pixels) -> Result<Self, ImageError> {
        check_sides(width, height)?;
        let got = match &pixels {
            Pixels::Eight(p) => p.len(),
            Pixels::Sixteen(p) => p.len(),
        };
        let needed = width * height;
        if got != needed {
            return Err(ImageError::WrongLength { width, height, needed, got });
        }
        Ok(Self { width, height, pixels, hidden_noise: 0.0 })
    }

    /// Makes this an 8-bit image of `width` × `height` in the same memory and returns its pixels for writing; their
    /// content is unspecified.
    ///
    /// # Errors
    /// [`ImageError::Empty`] if a side is zero, [`ImageError::TooLarge`] if one is too long; the image is then
    /// unchanged.
    pub fn eight_mut(&mut self, width: usize, height: usize) -> Result<&mut [u8], ImageError> {
        check_sides(width, height)?;
        if !matches!(self.pixels, Pixels::Eight(_)) {
            self.pixels = Pixels::Eight(Vec::new());
        }
        (self.width, self.height, self.hidden_noise) = (width, height, 0.0);
        match &mut self.pixels {
            Pixels::Eight(pixels) => {
                pixels.resize(width * height, 0);
                Ok(pixels)
            }
            Pixels::Sixteen(_) => unreachable!("replaced above"),
        }
    }

    /// As [`GreyImage::eight_mut`], with 16 bits per pixel.
    ///
    /// # Errors
    /// [`ImageError::Empty`] if a side is zero, [`ImageError::TooLarge`] if one is too long; the image is then
    /// unchanged.
    pub fn sixteen_mut(&mut self, width: usize, height: usize) -> Result<&mut [u16], ImageError> {
        check_sides(width, height)?;
        if !matches!(self.pixels, Pixels::Sixteen(_)) {
            self.pixels = Pixels::Sixteen(Vec::new());
        }
        (self.width, self.height, self.hidden_noise) = (width, height, 0.0);
        match &mut self.pixels {
            Pixels::Sixteen(pixels) => {
                pixels.resize(width * height, 0);
                Ok(pixels)
            }
            Pixels::Eight(_) => unreachable!("replaced above"),
        }
    }

    /// Standard deviation, in grey levels, of noise that the levels no longer show where they were clamped at zero: that of
    /// a difference of images or colours. Zero for other images.
    pub fn hidden_noise(&self) -> f32 {
        self.hidden_noise
    }

    /// The image with [`GreyImage::hidden_noise`].
    #[must_use]
    pub fn with_hidden_noise(mut self, sigma: f32) -> Self {
        self.hidden_noise = sigma;
        self
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The grey levels, row-major.
    pub fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// The grey levels, row-major, without the image.
    pub fn into_pixels(self) -> Pixels {
        self.pixels
    }

    /// The grey levels, row-major, for modification in place.
    pub fn levels_mut(&mut self) -> LevelsMut<'_> {
        match &mut self.pixels {
            Pixels::Eight(levels) => LevelsMut::Eight(levels),
            Pixels::Sixteen(levels) => LevelsMut::Sixteen(levels),
        }
    }

    /// Bits per pixel: 8 or 16.
    pub fn bit_depth(&self) -> u32 {
        match self.pixels {
            Pixels::Eight(_) => 8,
            Pixels::Sixteen(_) => 16,
        }
    }

    /// The largest grey level the pixel type can hold: 255 or 65535.
    pub fn full_scale(&self) -> f32 {
        match self.pixels {
            Pixels::Eight(_) => 255.0,
            Pixels::Sixteen(_) => 65535.0,
        }
    }

    /// Grey level of column `u`, row `v`; `u` and `v` must be inside the image.
    pub fn at(&self, u: usize, v: usize) -> f32 {
        let idx = v * self.width + u;
        match &self.pixels {
            Pixels::Eight(p) => f32::from(p[idx]),
            Pixels::Sixteen(p) => f32::from(p[idx]),
        }
    }

    /// Whether column `u`, row `v` is at full scale; both must be inside the image.
    pub fn is_saturated(&self, u: usize, v: usize) -> bool {
        self.at(u, v) >= self.full_scale()
    }

    /// The image with the mean of `n_px` pixels of its row in place of each pixel; at the border, of those inside the image.
    /// `n_px` is odd.
    pub fn smoothed_along_rows(&self, n_px: usize) -> Self {
        let pixels = match &self.pixels {
            Pixels::Eight(levels) => Pixels::Eight(smoothed_rows(levels, self.width, n_px)),
            Pixels::Sixteen(levels) => Pixels::Sixteen(smoothed_rows(levels, self.width, n_px)),
        };
        Self { pixels, hidden_noise: self.hidden_noise / (n_px as f32).sqrt(), ..*self }
    }

    /// The transposed image: columns become rows.
    pub fn transposed(&self) -> Self {
        let pixels = match &self.pixels {
            Pixels::Eight(_) => Pixels::Eight(vec![]),
            Pixels::Sixteen(_) => Pixels::Sixteen(vec![]),
        };
        let mut turned = Self { width: 0, height: 0, pixels, hidden_noise: 0.0 };
        self.transpose_into(&mut turned);
        turned
    }

    /// As [`GreyImage::transposed`], into the memory of an existing image.
    pub fn transpose_into(&self, turned: &mut Self) {
        let (w, h) = (self.width, self.height);
        match (&self.pixels, &mut turned.pixels) {
            (Pixels::Eight(from), Pixels::Eight(to)) => transpose(from, w, h, to),
            (Pixels::Sixteen(from), Pixels::Sixteen(to)) => transpose(from, w, h, to),
            _ => {
                *turned = self.transposed();
                return;
            }
        }
        (turned.width, turned.height, turned.hidden_noise) = (h, w, self.hidden_noise);
    }
}

/// Rows of levels, each the mean of itself and its neighbours in the row, rounded.
fn smoothed_rows<T: Copy + Into<u32> + TryFrom<u32>>(levels: &[T], width: usize, n_px: usize) -> Vec<T> {
    let mean = |row: &[T], u: usize| {
        let near = &row[u.saturating_sub(n_px / 2)..(u + n_px / 2 + 1).min(row.len())];
        let (sum, n) = (near.iter().map(|&level| level.into()).sum::<u32>(), near.len() as u32);
        T::try_from((sum + n / 2) / n).unwrap_or(row[u])
    };
    levels.chunks_exact(width).flat_map(|row| (0..width).map(move |u| mean(row, u))).collect()
}

/// Side of the blocks that are transposed in registers.
const BLOCK: usize = 16;

type Block<T> = [[T; BLOCK]; BLOCK];

fn transpose<T: Copy + Default>(source: &[T], width: usize, height: usize, target: &mut Vec<T>) {
    target.resize(source.len(), T::default());
    let (whole_u, whole_v) = (width - width % BLOCK, height - height % BLOCK);
    for u0 in (0..whole_u).step_by(BLOCK) {
        for v0 in (0..whole_v).step_by(BLOCK) {
            let mut block = [[T::default(); BLOCK]; BLOCK];
            for (k, row) in block.iter_mut().enumerate() {
                row.copy_from_slice(&source[(v0 + k) * width + u0..][..BLOCK]);
            }
            for (k, row) in transposed_block(block).iter().enumerate() {
                target[(u0 + k) * height + v0..][..BLOCK].copy_from_slice(row);
            }
        }
    }
    for v in 0..height {
        let beyond = if v < whole_v { whole_u } else { 0 };
        for u in beyond..width {
            target[u * height + v] = source[v * width + u];
        }
    }
}

/// Interleaves the first half of the rows with the second, repeatedly, until the bits of row and column are exchanged.
#[inline(always)]
fn transposed_block<T: Copy>(mut block: Block<T>) -> Block<T> {
    for _ in 0..BLOCK.ilog2() {
        let before = block;
        for i in 0..BLOCK / 2 {
            block[2 * i] = interleaved(&before[i], &before[i + BLOCK / 2], 0);
            block[2 * i + 1] = interleaved(&before[i], &before[i + BLOCK / 2], BLOCK / 2);
        }
    }
    block
}

/// Half of two rows, with their elements alternating.
#[inline(always)]
fn interleaved<T: Copy>(a: &[T; BLOCK], b: &[T; BLOCK], from: usize) -> [T; BLOCK] {
    let mut row = *a;
    for k in 0..BLOCK / 2 {
        row[2 * k] = a[from + k];
        row[2 * k + 1] = b[from + k];
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_buffer_of_the_wrong_length_is_refused() {
        let refused = GreyImage::new(3, 2, Pixels::Eight(vec![0; 5]));
        assert_eq!(refused, Err(ImageError::WrongLength { width: 3, height: 2, needed: 6, got: 5 }));
    }

    #[test]
    fn transposing_exchanges_columns_and_rows() {
        let image = GreyImage::new(3, 2, Pixels::Sixteen(vec![1, 2, 3, 4, 5, 6])).unwrap();
        assert_eq!(image.transposed().pixels(), &Pixels::Sixteen(vec![1, 4, 2, 5, 3, 6]));
        let (width, height) = (37, 50);
        let pixels: Vec<u8> = (0..width * height).map(|i| (i * 31 % 251) as u8).collect();
        let image = GreyImage::new(width, height, Pixels::Eight(pixels.clone())).unwrap();
        let mut turned = GreyImage::new(1, 1, Pixels::Sixteen(vec![1])).unwrap();
        image.transpose_into(&mut turned);
        assert_eq!((turned.width(), turned.height()), (height, width));
        let Pixels::Eight(found) = turned.pixels() else { panic!("8 bits stay 8 bits") };
        (0..width * height).for_each(|i| assert_eq!(found[i], pixels[i % height * width + i / height]));
    }
}
