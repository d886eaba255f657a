//! The one image type of the processing core: one channel, 8 or 16 bit, row-major.

/// Grey levels, row-major, top row first.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// 0–255.
    Eight(Vec<u8>),
    /// 0–65535.
    Sixteen(Vec<u16>),
}

/// A single-channel image of raw (distorted) sensor pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyImage {
    width: usize,
    height: usize,
    pixels: Pixels,
}

/// Why an image cannot be made from a buffer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// The buffer does not hold `width` × `height` pixels.
    #[error("an image of {width}×{height} needs {needed} pixels, got {got}")]
    WrongLength {
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
        /// `width * height`.
        needed: usize,
        /// Pixels in the buffer.
        got: usize,
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

impl GreyImage {
    /// Wraps `pixels` (row-major) as an image of `width` × `height`.
    ///
    /// # Errors
    /// [`ImageError::Empty`] if a side is zero, [`ImageError::WrongLength`] if the buffer does not fit.
    pub fn new(width: usize, height: usize, pixels: Pixels) -> Result<Self, ImageError> {
        if width == 0 || height == 0 {
            return Err(ImageError::Empty { width, height });
        }
        let got = match &pixels {
            Pixels::Eight(p) => p.len(),
            Pixels::Sixteen(p) => p.len(),
        };
        let needed = width * height;
        if got != needed {
            return Err(ImageError::WrongLength { width, height, needed, got });
        }
        Ok(Self { width, height, pixels })
    }

    /// Makes this an 8-bit image of `width` × `height` in the same memory and hands out its pixels for writing;
    /// what they hold before is undefined.
    ///
    /// # Errors
    /// [`ImageError::Empty`] if a side is zero; the image is unchanged then.
    pub fn eight_mut(&mut self, width: usize, height: usize) -> Result<&mut [u8], ImageError> {
        if width == 0 || height == 0 {
            return Err(ImageError::Empty { width, height });
        }
        if !matches!(self.pixels, Pixels::Eight(_)) {
            self.pixels = Pixels::Eight(Vec::new());
        }
        (self.width, self.height) = (width, height);
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
    /// [`ImageError::Empty`] if a side is zero; the image is unchanged then.
    pub fn sixteen_mut(&mut self, width: usize, height: usize) -> Result<&mut [u16], ImageError> {
        if width == 0 || height == 0 {
            return Err(ImageError::Empty { width, height });
        }
        if !matches!(self.pixels, Pixels::Sixteen(_)) {
            self.pixels = Pixels::Sixteen(Vec::new());
        }
        (self.width, self.height) = (width, height);
        match &mut self.pixels {
            Pixels::Sixteen(pixels) => {
                pixels.resize(width * height, 0);
                Ok(pixels)
            }
            Pixels::Eight(_) => unreachable!("replaced above"),
        }
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

    /// The image mirrored at its main diagonal: columns become rows.
    pub fn transposed(&self) -> Self {
        let (w, h) = (self.width, self.height);
        let pixels = match &self.pixels {
            Pixels::Eight(p) => Pixels::Eight(transpose(p, w, h)),
            Pixels::Sixteen(p) => Pixels::Sixteen(transpose(p, w, h)),
        };
        Self { width: h, height: w, pixels }
    }
}

fn transpose<T: Copy>(source: &[T], width: usize, height: usize) -> Vec<T> {
    let mut target = Vec::with_capacity(source.len());
    for u in 0..width {
        target.extend((0..height).map(|v| source[v * width + u]));
    }
    target
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
    }
}
