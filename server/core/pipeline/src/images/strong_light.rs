//! Strong light that is not part of a line found (too wide, clipped, two lines, or not a line), and lines that may be
//! two. Both are reported.

use std::collections::VecDeque;
use std::fmt;
use std::ops::Range;

use statistics::median;
use vision::{Centrelines, GreyImage, LineDirection};

use crate::images::search::Region;

/// Neighbouring columns (rows) whose light is averaged.
const STRIP_PX: usize = 16;
/// Fewest strips over which light must extend to be reported: shorter pieces are glints and corners.
const MIN_STRIPS: usize = 4;
/// Smallest height of strong light relative to the brightest tenth of the points found.
const MIN_OF_LINES: f32 = 0.5;
/// Without lines, smallest height relative to full scale.
const MIN_OF_FULL_SCALE: f32 = 0.1;
/// Largest width of light considered, relative to the size of the image across the lines; wider light is a bright
/// surface.
const MAX_WIDTH_RELATIVE: f32 = 0.25;
/// Widest line that the extraction supports (`docs/maths/centreline.md`, known limits).
const MAX_LINE_WIDTH_PX: usize = 40;
/// Fraction of full scale from which light is clipped.
const CLIPPED_FRACTION: f32 = 0.98;
/// Largest distance of a point from the light to which it belongs, px.
const MAX_DISTANCE_PX: f64 = 3.0;
/// Widths of a line within which another one touches it: closer ones are not extracted (`docs/maths/centreline.md`, known
/// limits).
const TOUCHING_WIDTHS: f32 = 3.0;
/// Width of the light relative to the distance of two touching lines: of one of them if half of their height separates
/// them, of both otherwise. Other light is texture, and light wider than any line is no pair of lines.
const WIDTH_OF_ONE: Range<f32> = 0.2..0.8;
const WIDTH_OF_BOTH: Range<f32> = 1.6..2.0;
/// Largest deviation of their distance from its median, relative to it, in most strips.
const MAX_DISTANCE_CHANGE: f32 = 0.15;
/// Smallest dip between two lines, relative to the lower of them: smaller ones are speckle or saturation.
const MIN_DIP: f32 = 0.2;
/// Light up to this width along the first or last row is a border that a program drew around the image.
const MAX_BORDER_PX: usize = 3;
/// Most findings per image; the longest first.
const MAX_FINDINGS: usize = 3;

/// Light without points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrongLight {
    /// Search direction.
    pub direction: LineDirection,
    /// Full width at half of its height, the median of its strips.
    pub width_px: usize,
    /// First and last column (row) along the line.
    pub along_px: [usize; 2],
    /// First and last row (column) of its centre.
    pub across_px: [usize; 2],
    /// Grey levels above its surroundings.
    pub height: f32,
    /// Whether it is at full scale.
    pub is_clipped: bool,
    /// Distance of the other line that touches it, px.
    pub touching_px: Option<usize>,
    /// Whether one line was found between these two.
    pub yields_one_line: bool,
}

impl StrongLight {
    /// Whether it may be a line that noise hides.
    pub(crate) fn may_be_line_in_noise(&self) -> bool {
        !self.is_clipped && self.touching_px.is_none() && self.width_px <= MAX_LINE_WIDTH_PX
    }
}

impl fmt::Display for StrongLight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (along, across) = match self.direction {
            LineDirection::Rows => ("columns", "rows"),
            LineDirection::Columns => ("rows", "columns"),
        };
        let ([a, b], [c, d]) = (self.along_px, self.across_px);
        let yields = if self.yields_one_line { "one line" } else { "no point" };
        write!(
            f,
            "light {} px wide at {along} {a}–{b}, {across} {c}–{d}, {:.0} grey levels high, yields {yields}: ",
            self.width_px, self.height
        )?;
        if let Some(distance_px) = self.touching_px {
            write!(
                f,
                "it may be two lines {distance_px} px apart that touch; focus the laser or the camera, or switch on one \
                 laser at a time"
            )
        } else if self.width_px > MAX_LINE_WIDTH_PX {
            let (clipped, remedy) = match self.is_clipped {
                true => (", and clipped", "expose shorter, then focus"),
                false => ("", "focus"),
            };
            write!(
                f,
                "wider than {MAX_LINE_WIDTH_PX} px, the widest line supported{clipped}; {remedy} the laser or the camera"
            )
        } else if self.is_clipped {
            f.write_str("clipped; expose shorter")
        } else {
            f.write_str(
                "no line can be followed in it; check the line direction and the channel, expose longer if the image is \
                 noisy, and switch off other light",
            )
        }
    }
}

/// Light of one strip of columns: centre, width, height, whether it is clipped, and where it is highest with the top of
/// a line that touches it.
struct Piece {
    strip: usize,
    middle: usize,
    width_px: usize,
    height: f32,
    is_clipped: bool,
    tops: Option<[usize; 2]>,
    yields_one_line: bool,
}

/// Finds light across `direction` that is as strong as the lines found, and has no point, or one between two lines.
pub(crate) fn strong_light(
    image: &GreyImage,
    lines: &Centrelines,
    direction: LineDirection,
    region: Option<Region>,
) -> Vec<StrongLight> {
    let turned;
    let (image, is_turned) = match direction {
        LineDirection::Rows => (image, false),
        LineDirection::Columns => {
            turned = image.transposed();
            (&turned, true)
        }
    };
    let mut points: Vec<Vec<f64>> = vec![Vec::new(); image.width().div_ceil(STRIP_PX)];
    let mut heights: Vec<f32> = Vec::new();
    for point in lines.segments.iter().flat_map(|segment| &segment.points) {
        let (along, across) = point.along_across(direction);
        if let Some(strip) = points.get_mut(along.max(0.0) as usize / STRIP_PX) {
            strip.push(across);
        }
        heights.push(point.intensity);
    }
    heights.sort_unstable_by(f32::total_cmp);
    let full = image.full_scale();
    let of_lines = heights.get(heights.len() * 9 / 10).map_or(0.0, |height| MIN_OF_LINES * height);
    let threshold = of_lines.max(MIN_OF_FULL_SCALE * full);
    let inside = |piece: &Piece| {
        let (along, across) = (piece.strip * STRIP_PX + STRIP_PX / 2, piece.middle);
        let (u, v) = if is_turned { (across, along) } else { (along, across) };
        region.is_none_or(|r| (r.u..r.u + r.width).contains(&u) && (r.v..r.v + r.height).contains(&v))
    };
    let mut chains: Vec<Vec<Piece>> = Vec::new();
    for (strip, points) in points.iter().enumerate().take(image.width() / STRIP_PX) {
        for mut piece in pieces_of(image, strip, threshold) {
            let half = piece.width_px as f64 / 2.0 + MAX_DISTANCE_PX;
            let is_found = points.iter().any(|across| (across - piece.middle as f64).abs() < half);
            piece.yields_one_line = piece.tops.is_some_and(|tops| points.iter().any(|&at| is_between(at, tops)));
            if is_found && !piece.yields_one_line || !inside(&piece) {
                continue;
            }
            let follows = |chain: &&mut Vec<Piece>| {
                let last = &chain[chain.len() - 1];
                let is_alike = last.width_px <= 2 * piece.width_px
                    && piece.width_px <= 2 * last.width_px
                    && last.yields_one_line == piece.yields_one_line;
                // The position is extrapolated linearly; jumps indicate texture.
                let expected = match chain.len() {
                    1 => last.middle as f64,
                    n => 2.0 * last.middle as f64 - chain[n - 2].middle as f64,
                };
                let reach =
                    if chain.len() == 1 { STRIP_PX as f64 } else { MAX_DISTANCE_PX } + piece.width_px as f64 / 4.0;
                let follows = (piece.middle as f64 - expected).abs() <= reach;
                last.strip + 1 == strip && is_alike && follows
            };
            match chains.iter_mut().find(follows) {
                Some(chain) => chain.push(piece),
                None => chains.push(vec![piece]),
            }
        }
    }
    chains.retain(|chain| chain.len() >= MIN_STRIPS);
    chains.sort_by_key(|chain| std::cmp::Reverse(chain.len()));
    let lights = chains.iter().map(|chain| light_of(chain, direction));
    lights.filter(|light| !light.yields_one_line || light.touching_px.is_some()).take(MAX_FINDINGS).collect()
}

fn light_of(chain: &[Piece], direction: LineDirection) -> StrongLight {
    let mut widths: Vec<usize> = chain.iter().map(|piece| piece.width_px).collect();
    let mut distances: Vec<usize> =
        chain.iter().filter_map(|piece| piece.tops).map(|[a, b]| a.abs_diff(b)).collect();
    let distance_px = median(&mut distances).unwrap_or_default();
    let is_alike = |one: &&usize| one.abs_diff(distance_px) as f32 <= MAX_DISTANCE_CHANGE * distance_px as f32;
    let is_pair = distances.iter().filter(is_alike).count() * 2 > chain.len();
    let middles = chain.iter().map(|piece| piece.middle);
    StrongLight {
        direction,
        width_px: median(&mut widths).unwrap_or_default(),
        along_px: [chain[0].strip * STRIP_PX, (chain[chain.len() - 1].strip + 1) * STRIP_PX - 1],
        across_px: [middles.clone().min().unwrap_or(0), middles.max().unwrap_or(0)],
        height: chain.iter().map(|piece| piece.height).sum::<f32>() / chain.len() as f32,
        is_clipped: chain.iter().filter(|piece| piece.is_clipped).count() * 2 > chain.len(),
        touching_px: is_pair.then_some(distance_px),
        yields_one_line: chain[0].yields_one_line,
    }
}

/// Light that exceeds its surroundings across a strip of columns.
fn pieces_of(image: &GreyImage, strip: usize, threshold: f32) -> Vec<Piece> {
    let columns = strip * STRIP_PX..(strip + 1) * STRIP_PX;
    let mean = |v: usize| columns.clone().map(|u| image.at(u, v)).sum::<f32>() / STRIP_PX as f32;
    let profile: Vec<f32> = (0..image.height()).map(mean).collect();
    let surroundings = opened(&profile, (MAX_WIDTH_RELATIVE * image.height() as f32) as usize);
    let light: Vec<f32> = profile.iter().zip(&surroundings).map(|(light, dark)| light - dark).collect();
    let mut pieces = Vec::new();
    let mut v = 0;
    while v < light.len() {
        if light[v] < threshold {
            v += 1;
            continue;
        }
        let end = (v..light.len()).find(|&at| light[at] < threshold).unwrap_or(light.len());
        let height = light[v..end].iter().copied().fold(0.0, f32::max);
        let brightest = profile[v..end].iter().copied().fold(0.0, f32::max);
        let is_lit = |&at: &usize| light[at] >= height / 2.0;
        let peak = (v..end).find(|&at| light[at] == height).unwrap_or(v);
        let from = (0..=peak).rev().take_while(is_lit).last().unwrap_or(peak);
        let to = (peak..light.len()).take_while(is_lit).last().unwrap_or(peak);
        let is_clipped = brightest >= CLIPPED_FRACTION * image.full_scale();
        let (width_px, is_at_border) = (to - from + 1, from == 0 || to + 1 == light.len());
        if !(is_at_border && width_px <= MAX_BORDER_PX) {
            let tops = touching_line(&light, peak, width_px).map(|other| [peak, other]);
            let middle = (from + to) / 2;
            pieces.push(Piece { strip, middle, width_px, height, is_clipped, tops, yields_one_line: false });
        }
        v = end.max(to + 1);
    }
    pieces
}

/// Whether a point lies between two lines rather than on one of them.
fn is_between(at: f64, tops: [usize; 2]) -> bool {
    let [from, to] = [tops[0].min(tops[1]) as f64, tops[0].max(tops[1]) as f64];
    let quarter = (to - from) / 4.0;
    (from + quarter..=to - quarter).contains(&at)
}

/// The nearest other maximum that is at least half as high, beyond a dip.
fn touching_line(light: &[f32], peak: usize, width_px: usize) -> Option<usize> {
    let reach = (TOUCHING_WIDTHS * width_px as f32) as usize;
    let nearest = |beside: Vec<usize>| {
        let mut lowest = light[peak];
        let mut rises = |at: usize| {
            lowest = lowest.min(light[at]);
            light[at] >= light[peak] / 2.0 && lowest <= (1.0 - MIN_DIP) * light[at]
        };
        let beyond = beside.iter().position(|&at| rises(at))?;
        let flank = beside[beyond..].iter().take(width_px);
        flank.copied().max_by(|&a, &b| light[a].total_cmp(&light[b]))
    };
    let right = (peak + 1..light.len()).take(reach).collect();
    let left = (0..peak).rev().take(reach).collect();
    let other = [nearest(right), nearest(left)].into_iter().flatten().min_by_key(|other| other.abs_diff(peak))?;
    let distance_px = other.abs_diff(peak);
    let width = width_px as f32 / distance_px as f32;
    let is_one = WIDTH_OF_ONE.contains(&width) && width_px <= MAX_LINE_WIDTH_PX;
    let is_both = WIDTH_OF_BOTH.contains(&width) && distance_px <= MAX_LINE_WIDTH_PX;
    (is_one || is_both).then_some(other)
}

/// Morphological opening of the profile: minimum over a window of `width`, then maximum.
fn opened(profile: &[f32], width: usize) -> Vec<f32> {
    let half = (width / 2).max(1);
    extremes(&extremes(profile, half, |one, other| one <= other), half, |one, other| one >= other)
}

/// The extreme value of the window of `half` values to either side of each; `exceeds`: whether one value is more extreme
/// than another. The queue holds the values that may still become extremes, so that the time does not depend on `half`.
fn extremes(values: &[f32], half: usize, exceeds: impl Fn(f32, f32) -> bool) -> Vec<f32> {
    let mut queue: VecDeque<usize> = VecDeque::new();
    let mut n_entered = 0;
    let extreme = |at: usize| {
        while n_entered < (at + half + 1).min(values.len()) {
            while queue.pop_back_if(|last| exceeds(values[n_entered], values[*last])).is_some() {}
            queue.push_back(n_entered);
            n_entered += 1;
        }
        while queue.pop_front_if(|first| *first + half < at).is_some() {}
        queue.front().map_or(values[at], |first| values[*first])
    };
    (0..values.len()).map(extreme).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use vision::{CentrelineParams, Pixels, find_centrelines};

    /// A stripe along rows of this width (full width at half height) with a flat or a Gaussian profile.
    fn stripe(width_px: f64, is_flat: bool, height: f64) -> GreyImage {
        let level = |idx: usize| {
            let distance = ((idx / 640) as f64 - 240.0 - 0.02 * (idx % 640) as f64).abs();
            let share = match is_flat {
                true => (width_px / 2.0 - distance + 0.5).clamp(0.0, 1.0),
                false => (-(distance / width_px).powi(2) * 4.0 * 2.0_f64.ln()).exp(),
            };
            (10.0 + height * share + (idx * 7919 % 5) as f64 * 0.5).min(255.0).round() as u8
        };
        GreyImage::new(640, 480, Pixels::Eight((0..640 * 480).map(level).collect())).unwrap()
    }

    fn light_in(image: &GreyImage) -> Vec<StrongLight> {
        let lines = find_centrelines(image, &CentrelineParams::default());
        strong_light(image, &lines, LineDirection::Rows, None)
    }

    #[test]
    fn extremes_are_those_of_every_window() {
        let values: Vec<f32> = (0..60).map(|idx| (idx * 7919 % 23) as f32).collect();
        for half in [1, 4, 100] {
            let window = |at: usize| &values[at.saturating_sub(half)..(at + half + 1).min(values.len())];
            let expected = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..values.len()).map(|at| window(at).iter().copied().reduce(pick).unwrap()).collect()
            };
            assert_eq!(extremes(&values, half, |one, other| one <= other), expected(f32::min));
            assert_eq!(extremes(&values, half, |one, other| one >= other), expected(f32::max));
        }
    }

    #[test]
    fn light_wider_than_any_supported_line_is_reported_with_its_position_and_width() {
        let found = light_in(&stripe(80.0, true, 150.0));
        let [light] = &found[..] else { panic!("{found:?}") };
        assert!((75..=85).contains(&light.width_px) && light.along_px == [0, 639], "{light:?}");
        assert!(light.across_px[0].abs_diff(240) < 5 && light.across_px[1].abs_diff(253) < 5, "{light:?}");
        let words = light.to_string();
        assert!(words.contains("px wide at columns 0–639") && words.contains("wider than 40 px"), "{words}");
    }

    /// Light 89 px wide beside as bright light 223 px away.
    #[test]
    fn light_wider_than_any_line_is_not_called_two_lines() {
        let level = |idx: usize| {
            let v = (idx / 640) as f64;
            let share = |middle: f64| ((44.5 - (v - middle).abs()) / 6.0 + 0.5).clamp(0.0, 1.0);
            (10.0 + 150.0 * (share(130.0) + share(353.0)) + (idx * 7919 % 5) as f64 * 0.5).round() as u8
        };
        let image = GreyImage::new(640, 480, Pixels::Eight((0..640 * 480).map(level).collect())).unwrap();
        let found = light_in(&image);
        assert_eq!(found.len(), 2, "{found:?}");
        for light in found {
            assert!(light.touching_px.is_none() && light.to_string().contains("wider than 40 px"), "{light}");
        }
    }

    /// Two Gaussian lines 8 px wide, at row 240 and this far below.
    fn two_lines(distance_px: f64) -> GreyImage {
        let share = |distance: f64| (-(distance / 8.0).powi(2) * 4.0 * 2.0_f64.ln()).exp();
        let level = |idx: usize| {
            let v = (idx / 640) as f64 - 240.0;
            let light = 150.0 * (share(v) + share(v - distance_px));
            (10.0 + light + (idx * 7919 % 5) as f64 * 0.5).round() as u8
        };
        GreyImage::new(640, 480, Pixels::Eight((0..640 * 480).map(level).collect())).unwrap()
    }

    #[test]
    fn lines_that_touch_are_named_with_their_distance() {
        for (distance_px, yields_one_line) in [(10.0, true), (12.0, true), (14.0, false), (18.0, false)] {
            let found = light_in(&two_lines(distance_px));
            assert!(!found.is_empty(), "{distance_px}");
            for light in found {
                assert_eq!(light.yields_one_line, yields_one_line, "{light:?}");
                assert!(light.touching_px.unwrap().abs_diff(distance_px as usize) <= 1, "{light:?}");
                assert!(light.to_string().contains("two lines"), "{light}");
            }
        }
        // Both are found.
        assert_eq!(light_in(&two_lines(24.0)), []);
    }

    #[test]
    fn a_border_drawn_around_the_image_is_not_a_finding() {
        let level = |idx: usize| if !(640..640 * 479).contains(&idx) { 250 } else { 10 + (idx * 7919 % 3) as u8 };
        let bordered = GreyImage::new(640, 480, Pixels::Eight((0..640 * 480).map(level).collect())).unwrap();
        assert_eq!(light_in(&bordered), []);
    }

    #[test]
    fn light_with_points_is_not_a_finding() {
        for width_px in [4.0, 12.0, 24.0] {
            assert_eq!(light_in(&stripe(width_px, false, 150.0)), [], "{width_px}");
        }
        assert_eq!(light_in(&stripe(80.0, true, 10.0)), [], "faint light");
    }
}
