//! Subtraction of a background (laser off) from images with the laser on.

use std::path::{Path, PathBuf};

use capture::read_photograph;
use vision::{CameraImage, WhiteLevel};

use crate::failure::Failure;

/// An image without the laser.
pub struct Background {
    path: PathBuf,
    image: CameraImage,
}

impl Background {
    /// Reads the background, with `white` as full scale.
    pub fn read(path: &Path, white: WhiteLevel) -> Result<Self, Failure> {
        let photograph = read_photograph(path).map_err(|error| Failure::from(error).in_file(path))?;
        Ok(Self { path: path.to_owned(), image: photograph.scaled(white).image })
    }

    /// Laser on minus laser off, level by level, clamped at zero.
    ///
    /// Both images must have the same size and bit depth. `path`: file of `image`, for messages.
    pub fn subtracted_from(&self, image: &CameraImage, path: &Path) -> Result<CameraImage, Failure> {
        image.minus(&self.image).ok_or_else(|| self.mismatch(image, path))
    }

    /// The background image.
    pub fn image(&self) -> &CameraImage {
        &self.image
    }

    fn mismatch(&self, image: &CameraImage, path: &Path) -> Failure {
        let format = |image: &CameraImage| {
            format!("{}×{} pixels of {} bits", image.width(), image.height(), image.bit_depth())
        };
        Failure::bad_input(format!(
            "{} has {}, the background {} has {}",
            path.display(),
            format(image),
            self.path.display(),
            format(&self.image)
        ))
        .in_file(path)
        .remedy("take the background with the same camera and settings, with the laser off and nothing moved")
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use vision::{ColourImage, GreyImage, Pixels};

    fn grey(width: usize, pixels: Pixels) -> CameraImage {
        CameraImage::Grey(GreyImage::new(width, 1, pixels).unwrap())
    }

    fn background(pixels: Pixels) -> Background {
        Background { path: "off.png".into(), image: grey(3, pixels) }
    }

    #[test]
    fn a_brighter_background_gives_zero_in_either_bit_depth() {
        let on = grey(3, Pixels::Eight(vec![10, 200, 5]));
        let off = background(Pixels::Eight(vec![4, 200, 9]));
        assert_eq!(off.subtracted_from(&on, Path::new("on.png")).unwrap(), grey(3, Pixels::Eight(vec![6, 0, 0])));
        let on = grey(3, Pixels::Sixteen(vec![1000, 60_000, 5]));
        let off = background(Pixels::Sixteen(vec![1, 50_000, 9]));
        let expected = grey(3, Pixels::Sixteen(vec![999, 10_000, 0]));
        assert_eq!(off.subtracted_from(&on, Path::new("on.png")).unwrap(), expected);
    }

    #[test]
    fn a_grey_background_is_subtracted_from_all_three_channels() {
        let colour =
            |levels: &[u8]| CameraImage::Colour(ColourImage::new(3, 1, Pixels::Eight(levels.to_vec())).unwrap());
        let off = background(Pixels::Eight(vec![0, 10, 20]));
        let on = colour(&[9, 8, 7, 19, 9, 10, 50, 60, 70]);
        let expected = colour(&[9, 8, 7, 9, 0, 0, 30, 40, 50]);
        assert_eq!(off.subtracted_from(&on, Path::new("on.png")).unwrap(), expected);
    }

    #[test]
    fn another_size_or_bit_depth_is_refused() {
        let off = background(Pixels::Eight(vec![0; 3]));
        let wide = grey(4, Pixels::Eight(vec![0; 4]));
        let deep = grey(3, Pixels::Sixteen(vec![0; 3]));
        for (on, word) in [(wide, "4×1 pixels of 8 bits"), (deep, "3×1 pixels of 16 bits")] {
            let text = off.subtracted_from(&on, Path::new("on.png")).unwrap_err().to_string();
            for word in [word, "on.png", "off.png", "3×1 pixels of 8 bits", "remedy"] {
                assert!(text.contains(word), "{text}");
            }
        }
    }
}
