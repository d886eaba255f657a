//! Whether a picture with the laser off shows the same scene as one with the laser on.

use std::fmt;

use crate::colour::{Channel, Picture};
use crate::image::GreyImage;
use statistics::median;

/// Side of the blocks whose means are compared between laser on and off: the noise of a mean is a quarter of a pixel's.
const BLOCK_PX: usize = 4;
/// Level difference, relative to full scale, by which a block may be darker with the laser on: the noise of a block's
/// mean is a sixth of it.
const DARKER: f32 = 6.0 / 255.0;
/// Fraction of the blocks that may be darker with the laser on than off: a picture of the same pose has none.
const DARKER_SHARE: f64 = 0.005;
/// Smallest brightness, relative to full scale, of a block used to compare the room's brightness.
const BRIGHT: f32 = 0.06;
/// Smallest brightness ratio of the room that is not reported.
const DIMMER: f32 = 0.9;

/// What changed between a picture with the laser off and one with it on, so that they cannot be subtracted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RoomChange {
    /// Another pose or part.
    AnotherPose {
        /// Fraction of the picture that is darker with the laser on than off.
        darker_share: f64,
    },
    /// The room was darker in the picture with the laser on.
    Dimmer {
        /// Its brightness relative to the picture without the laser.
        share: f32,
    },
}

impl fmt::Display for RoomChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AnotherPose { darker_share } => write!(
                f,
                "the background seems to show another pose: {:.1} % of the picture is darker with the laser on than off",
                100.0 * darker_share
            ),
            Self::Dimmer { share } => write!(
                f,
                "the room was darker than in the background ({:.0} %): exposure or lamps changed in between",
                100.0 * share
            ),
        }
    }
}

/// Compares both pictures in ordinary light: with the laser on nothing is darker, unless something moved or the room
/// became darker as a whole.
pub fn room_change(on: &Picture, off: &Picture) -> Option<RoomChange> {
    let (on, off) = (on.channel(Channel::Luma), off.channel(Channel::Luma));
    let (on_blocks, off_blocks) = (block_means(&on), block_means(&off));
    let full = on.full_scale();
    let bright = on_blocks.iter().zip(&off_blocks).filter(|(_, off)| **off > BRIGHT * full);
    let mut ratios: Vec<f32> = bright.map(|(on, off)| on / off).collect();
    let share = median(&mut ratios).unwrap_or(1.0).min(1.0);
    let darker =
        on_blocks.iter().zip(&off_blocks).filter(|(on, off)| share * **off - **on > DARKER * full).count();
    let darker_share = darker as f64 / on_blocks.len().max(1) as f64;
    if darker_share > DARKER_SHARE {
        return Some(RoomChange::AnotherPose { darker_share });
    }
    (share < DIMMER).then_some(RoomChange::Dimmer { share })
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
