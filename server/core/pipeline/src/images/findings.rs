//! Findings about an image besides its lines, formatted for the user.

use std::collections::BTreeSet;
use std::fmt;

use capture::LaserImage;
use vision::{
    CameraImage, Centrelines, GreyImage, LineDirection, SceneChange, SceneComparison, Segment, find_centrelines,
};

use crate::images::search::{Directions, LineSearch, SMOOTHED_PX, runs_along};
use crate::images::strong_light::{StrongLight, strong_light};
use crate::progress::Reporter;

/// Ratio of the points found by another interpretation of an image to those found as requested from which the
/// other is reported.
const LIKELIER: usize = 3;
/// Fewest points that support another interpretation: fewer are noise.
const SUSPICIOUS_POINTS: usize = 100;
/// Length of a piece, relative to the image along the lines, from which it is a whole line.
const WHOLE_LINE: f32 = 0.8;
/// Height of a point relative to the brightest twentieth from which it is as bright.
const BRIGHT_FRACTION: f32 = 0.3;

/// A finding about an image.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// No line at all.
    NoLine,
    /// Only short pieces of line, as edges of a scene without laser light look.
    NoLongLine {
        /// The longest, in line widths.
        longest_widths: f64,
    },
    /// Strong light without points.
    LightWithoutLine(StrongLight),
    /// A line found between two that touch.
    LineMayBeTwo(StrongLight),
    /// Glints were removed.
    Glints {
        /// Their number.
        n: usize,
    },
    /// The lines are those of the image averaged along them.
    Smoothed,
    /// Many points are clipped.
    Clipped {
        /// Their fraction.
        fraction: f64,
    },
    /// Lines appear to run in the other direction.
    OtherDirection {
        /// The other direction.
        direction: LineDirection,
        /// Points found in it, and in the requested one.
        n_points: [usize; 2],
    },
    /// The background shows the lines.
    SwappedPair {
        /// Points found in off minus on, and in on minus off.
        n_points: [usize; 2],
    },
    /// The background shows another pose or part.
    BackgroundOfAnotherPose {
        /// Fraction of the image that is darker with the laser on than off.
        darker_fraction: f64,
    },
    /// The ambient light was weaker in the image with the laser on.
    DimmerAmbientLight {
        /// Its brightness relative to the background.
        ratio: f32,
    },
    /// The ambient light was stronger in the image with the laser on, so that part of it remains.
    BrighterAmbientLight {
        /// Its brightness relative to the background.
        ratio: f32,
    },
}

impl Finding {
    /// Whether the background cannot be subtracted because of it.
    pub(crate) fn prevents_subtraction(&self) -> bool {
        match self {
            Self::BackgroundOfAnotherPose { .. } | Self::DimmerAmbientLight { .. } | Self::SwappedPair { .. } => {
                true
            }
            Self::NoLine
            | Self::NoLongLine { .. }
            | Self::LightWithoutLine(_)
            | Self::LineMayBeTwo(_)
            | Self::Glints { .. }
            | Self::Smoothed
            | Self::Clipped { .. }
            | Self::BrighterAmbientLight { .. }
            | Self::OtherDirection { .. } => false,
        }
    }

    /// A stable name for programs.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::NoLine => "no_line",
            Self::NoLongLine { .. } => "no_long_line",
            Self::LightWithoutLine(_) => "light_without_line",
            Self::LineMayBeTwo(_) => "line_may_be_two",
            Self::Glints { .. } => "glints",
            Self::Smoothed => "smoothed",
            Self::Clipped { .. } => "clipped",
            Self::OtherDirection { .. } => "other_direction",
            Self::SwappedPair { .. } => "swapped_pair",
            Self::BackgroundOfAnotherPose { .. } => "background_of_another_pose",
            Self::DimmerAmbientLight { .. } => "dimmer_room",
            Self::BrighterAmbientLight { .. } => "brighter_room",
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoLine => f.write_str("shows no laser line"),
            Self::NoLongLine { longest_widths } => write!(
                f,
                "no piece of line is longer than {longest_widths:.0} line widths: these may be edges in an image without laser \
                 light; check the image, its channel and the line direction"
            ),
            Self::LightWithoutLine(light) | Self::LineMayBeTwo(light) => light.fmt(f),
            Self::Glints { n } => {
                write!(f, "{n} short clipped pieces are brighter than the lines: glints, removed")
            }
            Self::Smoothed => write!(
                f,
                "the image is noisy: {SMOOTHED_PX} pixels along the lines were averaged; expose longer for full lateral \
                 resolution"
            ),
            Self::Clipped { fraction } => write!(
                f,
                "{:.0} % of the points are clipped: glare may displace them by more than the stated σ; expose shorter",
                1e2 * fraction
            ),
            Self::OtherDirection { direction, n_points: [other, own] } => {
                let word = match direction {
                    LineDirection::Rows => "rows",
                    LineDirection::Columns => "columns",
                };
                write!(
                    f,
                    "lines seem to run along {word}: {other} points that way, {own} this way; state that direction \
                     (--direction {word}, or projector.line_direction of a capture)"
                )
            }
            Self::SwappedPair { n_points: [swapped, own] } => write!(
                f,
                "laser on and off seem to be swapped: the background shows lines ({swapped} points against {own})"
            ),
            Self::BackgroundOfAnotherPose { darker_fraction } => {
                SceneChange::PoseChanged { darker_fraction: *darker_fraction }.fmt(f)
            }
            Self::DimmerAmbientLight { ratio } => SceneChange::DimmerAmbient { ratio: *ratio }.fmt(f),
            Self::BrighterAmbientLight { ratio } => write!(
                f,
                "ambient light is {ratio:.2} times as strong as in the background, and what exceeds it is not subtracted: \
                 exposure or lighting changed in between, or the laser lights the surroundings"
            ),
        }
    }
}

/// Findings about `image`, in which `lines` are all lines found: another direction, strong light that yields no
/// point, and lines that may be two.
pub(crate) fn findings_of(image: &GreyImage, lines: &Centrelines, search: &LineSearch) -> Vec<Finding> {
    let mut findings: Vec<Finding> = other_direction(image, lines, search).into_iter().collect();
    for &direction in search.directions.each() {
        let lights = strong_light(image, lines, direction, search.region).into_iter();
        findings.extend(lights.map(|light| match light.yields_one_line {
            true => Finding::LineMayBeTwo(light),
            false => Finding::LightWithoutLine(light),
        }));
    }
    findings
}

/// Findings about the images of one part of a capture, in the order of the images.
#[derive(Debug, Default)]
pub(crate) struct Findings(Vec<(String, Finding)>);

impl Findings {
    /// Adds those of an image.
    pub(crate) fn add(&mut self, image: &LaserImage, findings: Vec<Finding>) {
        let name = format!("{} ({})", image.path.display(), image.entry);
        self.0.extend(findings.into_iter().map(|finding| (name.clone(), finding)));
    }

    /// Warns of each kind once, with the first image and the number of others. Only if most of the `n_images` seem to
    /// show lines in the other direction, they do: single ones show edges beside the part.
    pub(crate) fn warn(&self, of: &str, n_images: usize, reporter: &dyn Reporter) {
        let kinds: BTreeSet<&str> = self.0.iter().map(|(_, finding)| finding.kind()).collect();
        for kind in kinds {
            let mut alike = self.0.iter().filter(|(_, finding)| finding.kind() == kind);
            let Some((first, finding)) = alike.next() else { continue };
            let images: BTreeSet<&String> = alike.map(|(name, _)| name).filter(|name| *name != first).collect();
            if matches!(finding, Finding::OtherDirection { .. }) && 2 * (images.len() + 1) <= n_images {
                continue;
            }
            let others = also_in(images.len());
            let left_out = if finding.prevents_subtraction() { "; left out" } else { "" };
            reporter.warn(&format!("{of}: {first}: {finding}{left_out}{others}"));
        }
    }
}

/// What is added to a finding that other images have as well.
pub fn also_in(n_other_images: usize) -> String {
    match n_other_images {
        0 => String::new(),
        1 => "; also in 1 other image".to_owned(),
        n => format!("; also in {n} other images"),
    }
}

/// Whether lines run in the other direction; not asked if a whole line runs in the requested one. Edges of the scene
/// give points in both directions: only points as bright as the brightest ones count.
fn other_direction(image: &GreyImage, lines: &Centrelines, search: &LineSearch) -> Option<Finding> {
    let Directions::One(direction) = search.directions else { return None };
    let other = match direction {
        LineDirection::Rows => LineDirection::Columns,
        LineDirection::Columns => LineDirection::Rows,
    };
    let across_image_px = match direction {
        LineDirection::Rows => image.width(),
        LineDirection::Columns => image.height(),
    };
    let is_whole = |segment: &Segment| segment.points.len() as f32 >= WHOLE_LINE * across_image_px as f32;
    if lines.segments.iter().any(is_whole) {
        return None;
    }
    let turned = LineSearch { directions: Directions::One(other), ..search.clone() }.all_lines(image);
    let heights = |lines: &Centrelines, direction| -> Vec<f32> {
        let points = lines.segments.iter().flat_map(|segment| &segment.points);
        points.filter(|point| runs_along(point, direction)).map(|point| point.intensity).collect()
    };
    let (turned, own) = (heights(&turned, other), heights(lines, direction));
    let mut all = [&turned[..], &own].concat();
    all.sort_unstable_by(f32::total_cmp);
    let bright = BRIGHT_FRACTION * all.get(all.len() * 19 / 20)?;
    let n_points = [turned, own].map(|heights| heights.into_iter().filter(|&height| height >= bright).count());
    let suspected = n_points[0] >= SUSPICIOUS_POINTS && n_points[0] > LIKELIER * n_points[1];
    suspected.then_some(Finding::OtherDirection { direction: other, n_points })
}

/// Findings about a pair of laser on and off; `found`: points found in on minus off.
pub(crate) fn pair_findings(
    on: &CameraImage,
    off: &CameraImage,
    found: usize,
    search: &LineSearch,
) -> Option<Finding> {
    swapped_pair(on, off, found, search).or_else(|| scene_change_finding(on, off))
}

/// Whether the background shows the lines; `found`: points found in on minus off.
fn swapped_pair(on: &CameraImage, off: &CameraImage, found: usize, search: &LineSearch) -> Option<Finding> {
    let reversed = (found < SUSPICIOUS_POINTS * LIKELIER).then(|| off.minus(on)).flatten()?;
    let params = search.params(search.directions.each()[0]);
    let lines = find_centrelines(&reversed.channel(search.channel), &params);
    let swapped: usize = lines.segments.iter().map(|segment| segment.points.len()).sum();
    // Movement leaves edges in both differences; a swapped pair has only the lines.
    let is_suspected = swapped >= SUSPICIOUS_POINTS && swapped > LIKELIER * found;
    is_suspected.then_some(Finding::SwappedPair { n_points: [swapped, found] })
}

/// Change of the scene between two images, see [`vision::SceneComparison`].
pub fn scene_change_finding(on: &CameraImage, off: &CameraImage) -> Option<Finding> {
    let SceneComparison { change, brighter } = SceneComparison::of(on, off);
    change.map(Finding::from).or(brighter.map(|ratio| Finding::BrighterAmbientLight { ratio }))
}

impl From<SceneChange> for Finding {
    fn from(change: SceneChange) -> Self {
        match change {
            SceneChange::PoseChanged { darker_fraction } => Self::BackgroundOfAnotherPose { darker_fraction },
            SceneChange::DimmerAmbient { ratio } => Self::DimmerAmbientLight { ratio },
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use crate::progress::Task;

    /// Keeps what it is warned of.
    #[derive(Default)]
    struct Said(Mutex<Vec<String>>);

    impl Reporter for Said {
        fn note(&self, _text: &str) {}

        fn warn(&self, text: &str) {
            self.0.lock().unwrap().push(text.to_owned());
        }

        fn is_cancelled(&self) -> bool {
            false
        }

        fn count(&self, _title: &str, _unit: &str, _total: usize) -> Box<dyn Task> {
            unreachable!("findings have no progress")
        }

        fn fraction(&self, _title: &str) -> Box<dyn Task> {
            unreachable!("findings have no progress")
        }
    }

    #[test]
    fn another_direction_is_warned_of_if_most_images_show_it() {
        let image = |number: usize| LaserImage {
            entry: format!("scans[0].frames[{number}].image"),
            path: format!("{number}.png").into(),
            background: None,
            line: None,
        };
        for (n_alike, is_warned_of) in [(1, false), (5, false), (6, true)] {
            let (mut findings, said) = (Findings::default(), Said::default());
            findings.add(&image(20), vec![Finding::NoLine]);
            for number in 0..n_alike {
                let finding = Finding::OtherDirection { direction: LineDirection::Rows, n_points: [900, 2] };
                findings.add(&image(number), vec![finding]);
            }
            findings.warn("scan part", 10, &said);
            let said = said.0.into_inner().unwrap();
            assert!(said.iter().any(|text| text.contains("20.png")), "{said:?}");
            let other = said.iter().find(|text| text.contains("along rows"));
            assert_eq!(other.is_some(), is_warned_of, "{n_alike}: {said:?}");
            assert!(other.is_none_or(|text| text.contains("also in 5 other images")), "{said:?}");
        }
    }
}
