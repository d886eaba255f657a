//! What a picture shows besides its lines that a person should know, in words.

use std::fmt;

use statistics::median;
use vision::{Centrelines, Channel, GreyImage, LineDirection, Picture, find_centrelines};

use crate::pictures::search::{Directions, LineSearch, runs_along};
use crate::pictures::strong_light::{StrongLight, strong_light};

/// Points of the other reading of a picture, per point of the one asked for, from which the other is the likelier.
const LIKELIER: usize = 3;
/// Fewest points that speak for another reading: less is noise.
const SUSPICIOUS_POINTS: usize = 100;
/// Side of the blocks by whose means pictures with laser on and off are compared: a quarter of the pixels' noise.
const BLOCK_PX: usize = 4;
/// Levels, of full scale, by which a block may be darker with the laser on: the noise of a block's mean is a sixth of it.
const DARKER: f32 = 6.0 / 255.0;
/// Share of the blocks that may be darker with the laser on than without: a picture of the same pose has none.
const DARKER_SHARE: f64 = 0.005;
/// Brightness, of full scale, from which a block tells how bright the room was.
const BRIGHT: f32 = 0.06;
/// The room may have become darker by this share before it is said.
const DIMMER: f32 = 0.9;

/// Something a person should know about a picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// No line at all.
    NoLine,
    /// Strong light that yields no point.
    LightWithoutLine(StrongLight),
    /// Glints were left out.
    Glints {
        /// How many.
        n: usize,
    },
    /// Lines seem to run the other way.
    OtherDirection {
        /// The other way.
        direction: LineDirection,
        /// Points found along it, and along the one asked for.
        n_points: [usize; 2],
    },
    /// The picture with the laser off shows the lines.
    SwappedPair {
        /// Points found in off minus on, and in on minus off.
        n_points: [usize; 2],
    },
    /// The background shows another pose or part.
    BackgroundOfAnotherPose {
        /// Share of the picture that is darker with the laser on than without.
        darker_share: f64,
    },
    /// The room was darker in the picture with the laser on.
    DimmerRoom {
        /// Its brightness, of that in the background.
        share: f32,
    },
}

impl Finding {
    /// A stable name for machines.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::NoLine => "no_line",
            Self::LightWithoutLine(_) => "light_without_line",
            Self::Glints { .. } => "glints",
            Self::OtherDirection { .. } => "other_direction",
            Self::SwappedPair { .. } => "swapped_pair",
            Self::BackgroundOfAnotherPose { .. } => "background_of_another_pose",
            Self::DimmerRoom { .. } => "dimmer_room",
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoLine => f.write_str("shows no laser line"),
            Self::LightWithoutLine(light) => light.fmt(f),
            Self::Glints { n } => write!(f, "{n} short clipped pieces outshine the lines: glints, left out"),
            Self::OtherDirection { direction, n_points: [other, own] } => {
                let word = match direction {
                    LineDirection::Rows => "rows",
                    LineDirection::Columns => "columns",
                };
                write!(
                    f,
                    "lines seem to run along {word}: {other} points that way, {own} this way; try --direction {word}"
                )
            }
            Self::SwappedPair { n_points: [swapped, own] } => write!(
                f,
                "laser on and off seem to be swapped: the background shows lines ({swapped} points against {own})"
            ),
            Self::BackgroundOfAnotherPose { darker_share } => write!(
                f,
                "the background seems to show another pose: {:.1} % of the picture is darker with the laser on than without",
                100.0 * darker_share
            ),
            Self::DimmerRoom { share } => write!(
                f,
                "the room was darker than in the background ({:.0} %): exposure or lamps changed in between",
                100.0 * share
            ),
        }
    }
}

/// What `image`, in which `lines` are all that were found, shows besides. With lines along both directions light is looked
/// for along the first.
pub(crate) fn findings_of(image: &GreyImage, lines: &Centrelines, search: &LineSearch) -> Vec<Finding> {
    let mut findings: Vec<Finding> = other_direction(image, lines, search).into_iter().collect();
    let found = strong_light(image, lines, search.directions.each()[0], search.region);
    findings.extend(found.into_iter().map(Finding::LightWithoutLine));
    findings
}

fn other_direction(image: &GreyImage, lines: &Centrelines, search: &LineSearch) -> Option<Finding> {
    let Directions::One(direction) = search.directions else { return None };
    let other = match direction {
        LineDirection::Rows => LineDirection::Columns,
        LineDirection::Columns => LineDirection::Rows,
    };
    let along = |lines: &Centrelines, direction| {
        lines.segments.iter().flat_map(|s| &s.points).filter(|point| runs_along(point, direction)).count()
    };
    let own = along(lines, direction);
    let turned = LineSearch { directions: Directions::One(other), ..search.clone() }.all_lines(image);
    let n_points = [along(&turned, other), own];
    let suspected = n_points[0] >= SUSPICIOUS_POINTS && n_points[0] > LIKELIER * own;
    suspected.then_some(Finding::OtherDirection { direction: other, n_points })
}

/// Whether a picture with the laser on and one with it off are a pair; `found`: points found in on minus off.
pub(crate) fn pair_findings(on: &Picture, off: &Picture, found: usize, search: &LineSearch) -> Option<Finding> {
    if found < SUSPICIOUS_POINTS * LIKELIER
        && let Some(reversed) = off.minus(on)
    {
        let params = search.params(search.directions.each()[0]);
        let lines = find_centrelines(&reversed.channel(search.channel), &params);
        let swapped: usize = lines.segments.iter().map(|segment| segment.points.len()).sum();
        // What moved leaves edges both ways; a swapped pair has nothing but the lines.
        if swapped >= SUSPICIOUS_POINTS && swapped > LIKELIER * found {
            return Some(Finding::SwappedPair { n_points: [swapped, found] });
        }
    }
    room_finding(on, off)
}

/// Compares what ordinary light shows in both pictures: with the laser on nothing is darker, unless something moved or the
/// room became darker as a whole.
pub fn room_finding(on: &Picture, off: &Picture) -> Option<Finding> {
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
        return Some(Finding::BackgroundOfAnotherPose { darker_share });
    }
    (share < DIMMER).then_some(Finding::DimmerRoom { share })
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
