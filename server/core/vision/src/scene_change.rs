//! Whether the images with the laser off and on show the same scene in the same ambient light.

use std::fmt;

use crate::colour::{CameraImage, Channel};
use crate::image::GreyImage;
use statistics::median;

/// Side of the blocks whose means are compared between laser on and off: the noise of a block's mean is a quarter of a
/// pixel's.
const BLOCK_PX: usize = 4;
/// Level difference, relative to full scale, by which a block may be darker with the laser on: the noise of a block's
/// mean is a sixth of it.
const DARKER: f32 = 6.0 / 255.0;
/// Fraction of the blocks that may be darker with the laser on than off: images of the same pose have none.
const DARKER_FRACTION: f64 = 0.005;
/// Ratio of ambient brightness below which a change is reported.
const DIMMER: f32 = 0.9;
/// Ratio of ambient brightness above which its remainder is reported: stray light of the laser alone reaches 1.2 on a
/// white board.
const BRIGHTER: f32 = 1.25;
/// Smallest contrast of the background, as a fraction of full scale, from which the gain is estimated; noise has less.
const CONTRAST: f32 = 0.04;
/// Smallest brightness, as a fraction of full scale, from which an image without contrast shows the ambient brightness.
const BRIGHT: f32 = 0.06;
/// Iterations of fitting the change of ambient light and rejecting outliers: laser light, and moved objects.
const FIT_ROUNDS: usize = 8;
/// A block is an outlier if its residual exceeds both this many standard deviations and [`DARKER`].
const FOLLOW_SIGMAS: f32 = 3.0;
/// Median absolute deviation over standard deviation of a normal distribution.
const MAD_PER_SIGMA: f32 = 0.6745;

/// Change between the images with the laser off and on, because of which they cannot be subtracted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SceneChange {
    /// Another pose, or another part.
    PoseChanged {
        /// Fraction of the image that is darker with the laser on than off.
        darker_fraction: f64,
    },
    /// Ambient light was dimmer in the image with the laser on.
    DimmerAmbient {
        /// Its brightness relative to the image with the laser off.
        ratio: f32,
    },
}

impl fmt::Display for SceneChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PoseChanged { darker_fraction } => write!(
                f,
                "the background seems to show another pose: {:.1} % of the image is darker with the laser on than off",
                100.0 * darker_fraction
            ),
            Self::DimmerAmbient { ratio } => write!(
                f,
                "the room was darker than in the background ({:.0} %): exposure or lighting changed in between",
                100.0 * ratio
            ),
        }
    }
}

/// Change between the images with the laser off and on; `None` if the scene is unchanged.
pub fn scene_change(on: &CameraImage, off: &CameraImage) -> Option<SceneChange> {
    SceneComparison::of(on, off).change
}

/// Comparison of the images with the laser off and on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SceneComparison {
    /// Because of which they cannot be subtracted.
    pub change: Option<SceneChange>,
    /// Ratio of ambient light, laser on over off, if much of it remains after subtraction: the lamp became brighter, or
    /// the laser itself lights the surroundings.
    pub brighter: Option<f32>,
}

impl SceneComparison {
    /// Compares the two images: with the laser on no area is darker, unless something moved or ambient light became
    /// dimmer. Other ambient light, stray light or another black level change the image by one gain and one offset;
    /// another pose does not.
    pub fn of(on: &CameraImage, off: &CameraImage) -> Self {
        let (on, off) = (on.channel(Channel::Luma), off.channel(Channel::Luma));
        let full = on.full_scale();
        let blocks: Vec<[f32; 2]> =
            block_means(&off).into_iter().zip(block_means(&on)).map(|(a, b)| [a, b]).collect();
        let ambient = AmbientModel::of(&blocks, full);
        let darker = blocks.iter().filter(|[off, on]| ambient.at(*off).min(*off) - on > DARKER * full).count();
        let darker_fraction = darker as f64 / blocks.len().max(1) as f64;
        if darker_fraction > DARKER_FRACTION {
            return Self { change: Some(SceneChange::PoseChanged { darker_fraction }), brighter: None };
        }
        let ratio = ambient.ratio(&blocks, full);
        let is_brighter = ambient.gain > BRIGHTER && (ambient.gain - 1.0) * ambient.contrast > DARKER * full;
        Self {
            change: (ratio < DIMMER).then_some(SceneChange::DimmerAmbient { ratio }),
            brighter: is_brighter.then_some(ambient.gain),
        }
    }
}

/// Ambient light with the laser on as a function of that with the laser off: gain · light + offset.
#[derive(Debug, Clone, Copy)]
struct AmbientModel {
    gain: f32,
    offset: f32,
    /// Brightest minus darkest blocks of the background, without the extremes.
    contrast: f32,
}

impl AmbientModel {
    /// Robust fit to the blocks (off, on): least squares, repeated without outliers. If the background has no contrast,
    /// the gain is 1.
    fn of(blocks: &[[f32; 2]], full_scale: f32) -> Self {
        let mut off: Vec<f32> = blocks.iter().map(|[off, _]| *off).collect();
        off.sort_by(f32::total_cmp);
        let quantile = |fraction: f64| off.get((fraction * off.len() as f64) as usize).copied().unwrap_or(0.0);
        let (dark, bright) = (quantile(DARKER_FRACTION), quantile(1.0 - DARKER_FRACTION));
        let middle = |of: &dyn Fn(&[f32; 2]) -> Option<f32>| {
            median(&mut blocks.iter().filter_map(of).collect::<Vec<f32>>()).unwrap_or(0.0)
        };
        let contrast = bright - dark;
        if contrast < CONTRAST * full_scale {
            return Self { gain: 1.0, offset: middle(&|[off, on]| Some(on - off)), contrast };
        }
        let half_way = 0.5 * (dark + bright);
        let of_darker = |of: usize| middle(&|block| (block[0] <= half_way).then_some(block[of]));
        let of_brighter = |of: usize| middle(&|block| (block[0] > half_way).then_some(block[of]));
        let gain = (of_brighter(1) - of_darker(1)) / (of_brighter(0) - of_darker(0));
        let mut ambient = Self { gain, offset: of_darker(1) - gain * of_darker(0), contrast };
        for _ in 0..FIT_ROUNDS {
            let sigma = middle(&|[off, on]| Some((on - ambient.at(*off)).abs())) / MAD_PER_SIGMA;
            let reach = (FOLLOW_SIGMAS * sigma).max(DARKER * full_scale);
            let follows = |block: &&[f32; 2]| (block[1] - ambient.at(block[0])).abs() <= reach;
            let Some((gain, offset)) = line_through(blocks.iter().filter(follows)) else { break };
            ambient = Self { gain, offset, contrast };
        }
        ambient
    }

    /// Predicted level with the laser on where it is `off` with the laser off.
    fn at(&self, off: f32) -> f32 {
        self.gain * off + self.offset
    }

    /// Ratio of ambient brightness, laser on over off: the smaller of the gain and the ratio at the 90 % quantile.
    fn ratio(&self, blocks: &[[f32; 2]], full_scale: f32) -> f32 {
        let mut off: Vec<f32> = blocks.iter().map(|[off, _]| *off).collect();
        off.sort_by(f32::total_cmp);
        let bright = off.get(off.len() * 9 / 10).filter(|bright| **bright > BRIGHT * full_scale);
        bright.map_or(self.gain, |bright| self.gain.min(self.at(*bright) / bright)).min(1.0)
    }
}

/// Gain and offset by least squares; `None` if all blocks have the same level.
fn line_through<'a>(blocks: impl Iterator<Item = &'a [f32; 2]> + Clone) -> Option<(f32, f32)> {
    let n = blocks.clone().count() as f64;
    let mean = |of: usize| blocks.clone().map(|block| f64::from(block[of])).sum::<f64>() / n;
    let [off_mean, on_mean] = [0, 1].map(mean);
    let (spread, lean) = blocks.clone().fold((0.0, 0.0), |(spread, lean), [off, on]| {
        let apart = f64::from(*off) - off_mean;
        (spread + apart * apart, lean + apart * (f64::from(*on) - on_mean))
    });
    let gain = lean / spread;
    gain.is_finite().then_some((gain as f32, (on_mean - gain * off_mean) as f32))
}

fn block_means(image: &GreyImage) -> Vec<f32> {
    let (columns, rows) = (image.width() / BLOCK_PX, image.height() / BLOCK_PX);
    let mean = |column: usize, row: usize| {
        let pixels = (0..BLOCK_PX).flat_map(|dv| (0..BLOCK_PX).map(move |du| (du, dv)));
        let sum: f32 = pixels.map(|(du, dv)| image.at(column * BLOCK_PX + du, row * BLOCK_PX + dv)).sum();
        sum / (BLOCK_PX * BLOCK_PX) as f32
    };
    (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))).map(|(c, r)| mean(c, r)).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::Pixels;

    const SIZE_PX: [usize; 2] = [320, 240];

    /// A board with squares of 40 px in dim ambient light, shifted to `[across, down]` px, with brightness changed by
    /// (gain, offset) and the noise of `seed`; with a laser line if `lit`.
    fn scene_image([across, down]: [usize; 2], (gain, offset): (f32, f32), lit: bool, seed: u32) -> CameraImage {
        let mut state = seed.wrapping_mul(2_654_435_761) | 1;
        let mut noise = || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            (state as f32 / u32::MAX as f32 - 0.5) * 8.0
        };
        let mut levels = Vec::new();
        for v in 0..SIZE_PX[1] {
            for u in 0..SIZE_PX[0] {
                let on_board = (140..340).contains(&(u + 100 - across)) && (120..280).contains(&(v + 100 - down));
                let bright = ((u + 100 - across) / 40 + (v + 100 - down) / 40) % 2 == 0;
                let ambient = if !on_board {
                    25.0
                } else if bright {
                    120.0
                } else {
                    40.0
                };
                let laser = if lit { 90.0 * (-0.5 * ((v as f32 - 120.0) / 2.0).powi(2)).exp() } else { 0.0 };
                levels.push((gain * ambient + offset + laser + noise()).round().clamp(0.0, 255.0) as u8);
            }
        }
        CameraImage::Grey(GreyImage::new(SIZE_PX[0], SIZE_PX[1], Pixels::Eight(levels)).unwrap())
    }

    const UNCHANGED: (f32, f32) = (1.0, 0.0);

    #[test]
    fn a_laser_line_alone_is_not_a_change_of_the_scene() {
        for room in [UNCHANGED, (1.0, 6.0), (1.15, 0.0), (0.95, 2.0)] {
            let change =
                scene_change(&scene_image([20, 20], room, true, 2), &scene_image([20, 20], UNCHANGED, false, 1));
            assert_eq!(change, None, "{room:?}");
        }
        let dark = |seed| scene_image([20, 20], (0.0, 5.0), false, seed);
        assert_eq!(scene_change(&dark(2), &dark(1)), None, "no ambient light");
    }

    #[test]
    fn dimmer_ambient_light_is_not_a_changed_pose_at_any_offset() {
        for (gain, offset) in [(0.8, 0.0), (0.6, 10.0), (0.6, -8.0), (0.3, 25.0), (0.8, 40.0), (1.0, -30.0)] {
            let on = scene_image([20, 20], (gain, offset), true, 2);
            let change = scene_change(&on, &scene_image([20, 20], UNCHANGED, false, 1));
            assert!(matches!(change, Some(SceneChange::DimmerAmbient { .. })), "{gain} {offset}: {change:?}");
        }
    }

    #[test]
    fn ambient_light_that_remains_after_subtraction_is_told_with_its_ratio() {
        let off = scene_image([20, 20], UNCHANGED, false, 1);
        for (gain, is_told) in [(1.0, false), (1.15, false), (1.4, true), (1.5, true), (2.0, true)] {
            let compared = SceneComparison::of(&scene_image([20, 20], (gain, 3.0), true, 2), &off);
            assert_eq!(compared.change, None, "{gain}");
            assert_eq!(compared.brighter.is_some(), is_told, "{gain}: {compared:?}");
            assert!(compared.brighter.is_none_or(|ratio| (ratio - gain).abs() < 0.05), "{gain}: {compared:?}");
        }
    }

    #[test]
    fn a_changed_pose_is_detected_in_dimmer_and_brighter_ambient_light() {
        for place in [[24, 20], [20, 40], [60, 60], [0, 0]] {
            for room in [UNCHANGED, (0.8, 0.0), (0.6, 10.0), (1.2, 0.0)] {
                let change =
                    scene_change(&scene_image(place, room, true, 2), &scene_image([20, 20], UNCHANGED, false, 1));
                assert!(matches!(change, Some(SceneChange::PoseChanged { .. })), "{place:?} {room:?}: {change:?}");
            }
        }
    }
}
