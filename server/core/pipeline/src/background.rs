//! A picture with the laser off, taken away from pictures with the laser on.

use std::path::{Path, PathBuf};

use capture::read_grey_image;
use vision::{GreyImage, Pixels};

use crate::failure::Failure;

/// What the camera sees without the laser.
pub struct Background {
    path: PathBuf,
    image: GreyImage,
}

impl Background {
    /// Reads the picture with the laser off.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let image = read_grey_image(path).map_err(|error| Failure::from(error).in_file(path))?;
        Ok(Self { path: path.to_owned(), image })
    }

    /// Laser on minus laser off, grey level by grey level; what would be negative is zero.
    ///
    /// Both pictures must have the same size and bit depth; `path` names the one with the laser on.
    pub fn taken_from(&self, image: &GreyImage, path: &Path) -> Result<GreyImage, Failure> {
        let size = |image: &GreyImage| (image.width(), image.height());
        let difference = match (image.pixels(), self.image.pixels()) {
            _ if size(image) != size(&self.image) => None,
            (Pixels::Eight(on), Pixels::Eight(off)) => {
                Some(Pixels::Eight(on.iter().zip(off).map(|(on, off)| on.saturating_sub(*off)).collect()))
            }
            (Pixels::Sixteen(on), Pixels::Sixteen(off)) => {
                Some(Pixels::Sixteen(on.iter().zip(off).map(|(on, off)| on.saturating_sub(*off)).collect()))
            }
            _ => None,
        };
        let difference = difference.ok_or_else(|| self.mismatch(image, path))?;
        GreyImage::new(image.width(), image.height(), difference).map_err(|error| {
            Failure::bad_input(format!("{} minus {} is no image", path.display(), self.path.display()))
                .in_file(path)
                .because(&error)
        })
    }

    fn mismatch(&self, image: &GreyImage, path: &Path) -> Failure {
        let format = |image: &GreyImage| {
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
        .remedy("take the background with the same camera and settings, the laser off and nothing moved")
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn background(pixels: Pixels) -> Background {
        Background { path: "off.png".into(), image: GreyImage::new(3, 1, pixels).unwrap() }
    }

    #[test]
    fn brighter_background_gives_zero_in_either_bit_depth() {
        let on = GreyImage::new(3, 1, Pixels::Eight(vec![10, 200, 5])).unwrap();
        let off = background(Pixels::Eight(vec![4, 200, 9]));
        assert_eq!(*off.taken_from(&on, Path::new("on.png")).unwrap().pixels(), Pixels::Eight(vec![6, 0, 0]));
        let on = GreyImage::new(3, 1, Pixels::Sixteen(vec![1000, 60_000, 5])).unwrap();
        let off = background(Pixels::Sixteen(vec![1, 50_000, 9]));
        assert_eq!(
            *off.taken_from(&on, Path::new("on.png")).unwrap().pixels(),
            Pixels::Sixteen(vec![999, 10_000, 0])
        );
    }

    #[test]
    fn another_size_or_bit_depth_is_refused_by_name() {
        let off = background(Pixels::Eight(vec![0; 3]));
        let wide = GreyImage::new(4, 1, Pixels::Eight(vec![0; 4])).unwrap();
        let deep = GreyImage::new(3, 1, Pixels::Sixteen(vec![0; 3])).unwrap();
        for (on, word) in [(wide, "4×1 pixels of 8 bits"), (deep, "3×1 pixels of 16 bits")] {
            let text = off.taken_from(&on, Path::new("on.png")).unwrap_err().to_string();
            for word in [word, "on.png", "off.png", "3×1 pixels of 8 bits", "remedy"] {
                assert!(text.contains(word), "{text}");
            }
        }
    }
}
