//! A laser-off image, subtracted from the images of its scene before lines are detected.

use capture::write_png;
use station::StampedFrame;
use std::path::Path;
use vision::{CameraImage, GreyImage, scene_change};

use crate::error::AppError;
use crate::error::disk_problem;

/// Fraction of pixels brighter than the ambient level.
const BRIGHTER_FRACTION: f64 = 0.05;

/// Subsampling along a row for the ambient level.
const LOOK_STRIDE_PX: usize = 7;

/// A laser-off image.
pub struct Background(CameraImage);

impl Background {
    /// From a laser-off frame.
    pub fn new(frame: &StampedFrame) -> Self {
        Self::of(frame.image.clone())
    }

    /// From a laser-off image.
    pub(crate) fn of(image: GreyImage) -> Self {
        Self(CameraImage::Grey(image))
    }

    /// Whether it matches `image` except for the laser.
    pub fn suits(&self, image: &GreyImage) -> bool {
        scene_change(&CameraImage::Grey(image.clone()), &self.0).is_none()
    }

    /// The image with it subtracted; `None` if it does not match.
    pub fn subtracted_from(&self, image: &GreyImage) -> Option<GreyImage> {
        let on = CameraImage::Grey(image.clone());
        if scene_change(&on, &self.0).is_some() {
            return None;
        }
        match on.minus(&self.0)? {
            CameraImage::Grey(image) => Some(image),
            CameraImage::Colour(_) => None,
        }
    }

    /// Its ambient level, of 255, exceeded by 5 % of the pixels.
    pub fn ambient_levels(&self) -> f64 {
        let CameraImage::Grey(image) = &self.0 else { return 0.0 };
        let pixels = (0..image.height())
            .flat_map(|v| (v % LOOK_STRIDE_PX..image.width()).step_by(LOOK_STRIDE_PX).map(move |u| (u, v)));
        let mut levels: Vec<f32> = pixels.map(|(u, v)| image.at(u, v)).collect();
        let rank = ((1.0 - BRIGHTER_FRACTION) * levels.len() as f64) as usize;
        let (_, level, _) = levels.select_nth_unstable_by(rank, f32::total_cmp);
        f64::from(*level / image.full_scale()) * 255.0
    }

    /// Writes it as a PNG file.
    pub fn write(&self, path: &Path) -> Result<(), AppError> {
        let CameraImage::Grey(image) = &self.0 else { return Ok(()) };
        write_png(path, image).map_err(disk_problem)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use vision::Pixels;

    use super::*;

    fn grey(level: impl Fn(usize, usize) -> u8) -> GreyImage {
        let (width, height) = (160, 120);
        let pixels = (0..width * height).map(|idx| level(idx % width, idx / width)).collect();
        GreyImage::new(width, height, Pixels::Eight(pixels)).unwrap()
    }

    /// A room of 40 levels with a dark block from column `u`.
    pub(crate) fn room(u_px: usize) -> GreyImage {
        grey(|u, v| if (u_px..u_px + 40).contains(&u) && (40..80).contains(&v) { 5 } else { 40 })
    }

    #[test]
    fn a_background_is_subtracted_only_from_images_of_its_scene() {
        let lit = |of: GreyImage| grey(move |u, v| of.at(u, v) as u8 + if v == 60 { 100 } else { 0 });
        let here = Background::of(room(20)).subtracted_from(&lit(room(20))).unwrap();
        assert_eq!((here.at(30, 60), here.at(30, 61), here.at(100, 10)), (100.0, 0.0, 0.0));
        assert_eq!(Background::of(room(80)).subtracted_from(&lit(room(20))), None);
    }

    #[test]
    fn the_ambient_level_is_exceeded_by_a_twentieth_of_the_image() {
        let is = |found: f64, levels: f64| (found - levels).abs() < 1e-3;
        assert!(is(Background::of(room(20)).ambient_levels(), 40.0));
        let window = grey(|u, _| if u < 4 { 200 } else { 7 });
        assert!(is(Background::of(window).ambient_levels(), 7.0));
    }
}
