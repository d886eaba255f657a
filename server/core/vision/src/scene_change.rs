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
/// The room may have become darker by this share before it is said.
const DIMMER: f32 = 0.9;
/// Contrast of the background, of full scale, from which it shows by what gain the room changed; noise has less.
const CONTRAST: f32 = 0.04;
/// Brightness, of full scale, from which a picture without contrast shows how bright the room was.
const BRIGHT: f32 = 0.06;
/// Rounds of fitting how the room changed and leaving out what does not follow: the laser's light, and what moved.
const FIT_ROUNDS: usize = 8;
/// Blocks farther off than so many standard deviations of the others, and than [`DARKER`], do not follow.
const FOLLOW_SIGMAS: f32 = 3.0;
/// Median absolute deviation of normal values, in standard deviations.
const MAD_PER_SIGMA: f32 = 0.6745;

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

/// Compares what ordinary light shows in both pictures: with the laser on nothing is darker, unless something moved or the
/// room became darker as a whole. A room that is darker as a whole, with other stray light or another black level, follows
/// the background by one gain and one offset; another pose does not.
pub fn room_change(on: &Picture, off: &Picture) -> Option<RoomChange> {
    let (on, off) = (on.channel(Channel::Luma), off.channel(Channel::Luma));
    let full = on.full_scale();
    let blocks: Vec<[f32; 2]> = block_means(&off).into_iter().zip(block_means(&on)).map(|(a, b)| [a, b]).collect();
    let room = Room::of(&blocks, full);
    let darker = blocks.iter().filter(|[off, on]| room.at(*off).min(*off) - on > DARKER * full).count();
    let darker_share = darker as f64 / blocks.len().max(1) as f64;
    if darker_share > DARKER_SHARE {
        return Some(RoomChange::AnotherPose { darker_share });
    }
    let share = room.share(&blocks, full);
    (share < DIMMER).then_some(RoomChange::Dimmer { share })
}

/// How the room's light in one picture follows that in the other: gain · light + offset.
#[derive(Debug, Clone, Copy)]
struct Room {
    gain: f32,
    offset: f32,
}

impl Room {
    /// What most blocks (off, on) follow: least squares, again and again without those that do not. Where the background
    /// has no contrast nothing is known of a gain.
    fn of(blocks: &[[f32; 2]], full_scale: f32) -> Self {
        let mut off: Vec<f32> = blocks.iter().map(|[off, _]| *off).collect();
        off.sort_by(f32::total_cmp);
        let quantile = |share: f64| off.get((share * off.len() as f64) as usize).copied().unwrap_or(0.0);
        let (dark, bright) = (quantile(DARKER_SHARE), quantile(1.0 - DARKER_SHARE));
        let middle = |of: &dyn Fn(&[f32; 2]) -> Option<f32>| {
            median(&mut blocks.iter().filter_map(of).collect::<Vec<f32>>()).unwrap_or(0.0)
        };
        if bright - dark < CONTRAST * full_scale {
            return Self { gain: 1.0, offset: middle(&|[off, on]| Some(on - off)) };
        }
        let half_way = 0.5 * (dark + bright);
        let of_darker = |of: usize| middle(&|block| (block[0] <= half_way).then_some(block[of]));
        let of_brighter = |of: usize| middle(&|block| (block[0] > half_way).then_some(block[of]));
        let gain = (of_brighter(1) - of_darker(1)) / (of_brighter(0) - of_darker(0));
        let mut room = Self { gain, offset: of_darker(1) - gain * of_darker(0) };
        for _ in 0..FIT_ROUNDS {
            let sigma = middle(&|[off, on]| Some((on - room.at(*off)).abs())) / MAD_PER_SIGMA;
            let reach = (FOLLOW_SIGMAS * sigma).max(DARKER * full_scale);
            let follows = |block: &&[f32; 2]| (block[1] - room.at(block[0])).abs() <= reach;
            let Some(next) = Self::through(blocks.iter().filter(follows)) else { break };
            room = next;
        }
        room
    }

    /// Least squares; `None` where the blocks are all alike.
    fn through<'a>(blocks: impl Iterator<Item = &'a [f32; 2]> + Clone) -> Option<Self> {
        let n = blocks.clone().count() as f64;
        let mean = |of: usize| blocks.clone().map(|block| f64::from(block[of])).sum::<f64>() / n;
        let [off_mean, on_mean] = [0, 1].map(mean);
        let (spread, lean) = blocks.clone().fold((0.0, 0.0), |(spread, lean), [off, on]| {
            let apart = f64::from(*off) - off_mean;
            (spread + apart * apart, lean + apart * (f64::from(*on) - on_mean))
        });
        let gain = lean / spread;
        gain.is_finite().then_some(Self { gain: gain as f32, offset: (on_mean - gain * off_mean) as f32 })
    }

    /// The room's light in the picture with the laser on where the other shows `off`.
    fn at(&self, off: f32) -> f32 {
        self.gain * off + self.offset
    }

    /// The room's brightness in the picture with the laser on, of that without: of its contrast, and of its brighter tenth.
    fn share(&self, blocks: &[[f32; 2]], full_scale: f32) -> f32 {
        let mut off: Vec<f32> = blocks.iter().map(|[off, _]| *off).collect();
        off.sort_by(f32::total_cmp);
        let bright = off.get(off.len() * 9 / 10).filter(|bright| **bright > BRIGHT * full_scale);
        bright.map_or(self.gain, |bright| self.gain.min(self.at(*bright) / bright)).min(1.0)
    }
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

    /// A board of squares of 40 px in a dim room, `[across, down]` px from its place, seen through (gain, offset), with the noise
    /// of picture `seed`; with a laser line where `lit`.
    fn picture([across, down]: [usize; 2], (gain, offset): (f32, f32), lit: bool, seed: u32) -> Picture {
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
                let room = if !on_board {
                    25.0
                } else if bright {
                    120.0
                } else {
                    40.0
                };
                let laser = if lit { 90.0 * (-0.5 * ((v as f32 - 120.0) / 2.0).powi(2)).exp() } else { 0.0 };
                levels.push((gain * room + offset + laser + noise()).round().clamp(0.0, 255.0) as u8);
            }
        }
        Picture::Grey(GreyImage::new(SIZE_PX[0], SIZE_PX[1], Pixels::Eight(levels)).unwrap())
    }

    const AS_IT_WAS: (f32, f32) = (1.0, 0.0);

    #[test]
    fn the_same_room_with_a_laser_line_has_not_changed() {
        for room in [AS_IT_WAS, (1.0, 6.0), (1.15, 0.0), (0.95, 2.0)] {
            let change = room_change(&picture([20, 20], room, true, 2), &picture([20, 20], AS_IT_WAS, false, 1));
            assert_eq!(change, None, "{room:?}");
        }
        let dark = |seed| picture([20, 20], (0.0, 5.0), false, seed);
        assert_eq!(room_change(&dark(2), &dark(1)), None, "a dark room");
    }

    #[test]
    fn a_dimmer_room_is_no_other_pose_whatever_its_offset() {
        for (gain, offset) in [(0.8, 0.0), (0.6, 10.0), (0.6, -8.0), (0.3, 25.0), (0.8, 40.0), (1.0, -30.0)] {
            let on = picture([20, 20], (gain, offset), true, 2);
            let change = room_change(&on, &picture([20, 20], AS_IT_WAS, false, 1));
            assert!(matches!(change, Some(RoomChange::Dimmer { .. })), "{gain} {offset}: {change:?}");
        }
    }

    #[test]
    fn another_pose_is_one_in_a_dimmer_and_in_a_brighter_room_too() {
        for place in [[24, 20], [20, 40], [60, 60], [0, 0]] {
            for room in [AS_IT_WAS, (0.8, 0.0), (0.6, 10.0), (1.2, 0.0)] {
                let change = room_change(&picture(place, room, true, 2), &picture([20, 20], AS_IT_WAS, false, 1));
                assert!(matches!(change, Some(RoomChange::AnotherPose { .. })), "{place:?} {room:?}: {change:?}");
            }
        }
    }
}
