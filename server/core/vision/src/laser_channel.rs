//! Selects the channel of colour images that shows the laser best.
//!
//! Lines are extracted in every channel. A point belongs to the laser if its light is coloured: the excess over its
//! surroundings is mostly of one colour. The excess at board edges, on paper and in reflections has all colours.

use crate::colour::{Channel, ColourImage};
use crate::{CentrelineExtractor, CentrelineParams, CentrelinePoint, Centrelines};

/// Fraction of the added light by which a laser's own colour exceeds the others. White light adds equal parts; even red
/// lasers that also excite the blue pixels of a phone, and saturate the red ones, stay above this.
const COLOURED_FRACTION: f32 = 0.2;
/// Fraction of full scale from which a colour may be clipped: there overexposed laser light looks white, and its excess
/// over other colours is unknown.
const CLIPPED: f32 = 0.97;
/// Weight of a point whose light is clipped in its channel: its centre is less certain than another channel's.
const CLIPPED_WEIGHT: f64 = 0.5;
/// Sample positions across the line, in line widths from its middle: the flanks have the colour where the middle is
/// clipped.
const INSIDE_WIDTHS: [f64; 5] = [-0.7, -0.35, 0.0, 0.35, 0.7];
/// Sample positions beside the line, in line widths from its middle.
const BESIDE_WIDTHS: [f64; 2] = [-1.6, 1.6];
/// Distance of lines, in their widths, below which they may be the flanks of one.
const FLANK_WIDTHS: f64 = 3.0;
/// A point counts if its height exceeds this fraction of the brightest coloured lines': a laser on black paper does,
/// randomly coloured camera noise does not.
const FAINT_FRACTION: f32 = 0.1;
/// A simpler channel is preferred if it reaches this fraction of the best score: differences of channels have the noise
/// of both.
const PLAINER_FRACTION: f64 = 0.98;

/// The result for one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelScore {
    /// The channel.
    pub channel: Channel,
    /// Points on coloured lines.
    pub n_laser_points: usize,
    /// Points whose light is equally bright in all colours.
    pub n_other_points: usize,
    /// How well the channel shows the laser: points on coloured lines minus the others, each weighted by the square
    /// root of its height over the brightest lines', so that many faint points with random colours do not outweigh the
    /// laser.
    pub score: f64,
}

impl ChannelScore {
    /// The score for the laser's colour; luma shows lasers of any one colour.
    fn new(channel: Channel, points: &[ChannelPoint], brightest: f32) -> Self {
        let colours = channel.colour().map_or(0..3, |colour| colour..colour + 1);
        let scores = colours.map(|colour| Self::of_colour(channel, colour, points, brightest));
        scores.max_by(|a, b| a.score.total_cmp(&b.score)).expect("there is at least one colour")
    }

    fn of_colour(channel: Channel, colour: usize, points: &[ChannelPoint], brightest: f32) -> Self {
        let mut view = Self { channel, n_laser_points: 0, n_other_points: 0, score: 0.0 };
        for seen in points.iter().filter(|seen| seen.height >= FAINT_FRACTION * brightest) {
            let of_height = f64::from((seen.height / brightest).min(1.0)).sqrt();
            let weight = of_height * if seen.is_clipped { CLIPPED_WEIGHT } else { 1.0 };
            match seen.light {
                Light::Clipped => {}
                Light::Coloured(own) if own == colour => {
                    view.n_laser_points += 1;
                    view.score += weight;
                }
                Light::Coloured(_) | Light::White => {
                    view.n_other_points += 1;
                    view.score -= weight;
                }
            }
        }
        view
    }
}

/// Extracts coloured lines from all channels of some images of one camera and laser.
///
/// `images`: with the laser on; if there is a background image, it is already subtracted. `params`: settings of the
/// extraction, one for each direction the lines may run in. Returns the channel to use, and the result for each.
/// Without any coloured line it is luma.
pub fn laser_channel(images: &[ColourImage], params: &[CentrelineParams]) -> (Channel, Vec<ChannelScore>) {
    let points = Channel::ALL.map(|channel| points_in(channel, images, params));
    let brightest = points.iter().filter_map(|points| bright_height(points)).reduce(f32::max).unwrap_or(1.0);
    let views: Vec<ChannelScore> = Channel::ALL
        .iter()
        .zip(&points)
        .map(|(&channel, points)| ChannelScore::new(channel, points, brightest))
        .collect();
    (best_of(&views), views)
}

/// A point of a line in one channel.
struct ChannelPoint {
    /// Grey levels above its surroundings.
    height: f32,
    /// The light of the line.
    light: Light,
    /// Whether its light is clipped in the channel.
    is_clipped: bool,
}

/// The excess of a line over its surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Light {
    /// Mostly of one colour: 0 red, 1 green, 2 blue.
    Coloured(usize),
    /// Of several colours.
    White,
    /// Clipped across the whole line, or beside it: of unknown colour.
    Clipped,
}

/// Height of the brightest coloured lines, robust against a few glints.
fn bright_height(points: &[ChannelPoint]) -> Option<f32> {
    let mut heights: Vec<f32> =
        points.iter().filter(|seen| matches!(seen.light, Light::Coloured(_))).map(|seen| seen.height).collect();
    heights.sort_unstable_by(f32::total_cmp);
    heights.get(heights.len() * 19 / 20).copied()
}

fn best_of(views: &[ChannelScore]) -> Channel {
    let best = views.iter().filter(|view| view.n_laser_points > 0).map(|view| view.score).reduce(f64::max);
    let Some(best) = best else { return Channel::Luma };
    // Where clutter outweighs the laser in every channel, the best negative score is used.
    let enough = best - (1.0 - PLAINER_FRACTION) * best.abs();
    let good = views.iter().find(|view| view.n_laser_points > 0 && view.score >= enough);
    good.map_or(Channel::Luma, |view| view.channel)
}

fn points_in(channel: Channel, images: &[ColourImage], params: &[CentrelineParams]) -> Vec<ChannelPoint> {
    let mut points = Vec::new();
    let (mut extractor, mut lines) = (CentrelineExtractor::default(), Centrelines::default());
    for colour_image in images {
        let image = colour_image.channel(channel);
        for params in params {
            extractor.find(&image, params, &mut lines);
            points.extend(apart(&lines).into_iter().map(|point| ChannelPoint {
                height: point.intensity,
                light: light_of(colour_image, point),
                is_clipped: is_clipped(colour_image, point, channel),
            }));
        }
    }
    points
}

/// The points of lines, of close ones in a column (row) only the first: the flanks of a clipped line are one line.
fn apart(lines: &Centrelines) -> Vec<&CentrelinePoint> {
    let place = |point: &CentrelinePoint| point.along_across(lines.direction);
    let mut points: Vec<&CentrelinePoint> = lines.segments.iter().flat_map(|segment| &segment.points).collect();
    points.sort_by(|a, b| {
        let ((a_along, a_across), (b_along, b_across)) = (place(a), place(b));
        a_along.total_cmp(&b_along).then(a_across.total_cmp(&b_across))
    });
    points.dedup_by(|next, last| {
        let ((along, across), (last_along, last_across)) = (place(next), place(last));
        let widths_px = f64::from(next.width_px + last.width_px) / 2.0;
        along == last_along && across - last_across < FLANK_WIDTHS * widths_px
    });
    points
}

/// Whether the light at a point is clipped in a channel: for luma, which is mostly green, if green is; for a difference of
/// colours if one of them is on the line or beside it, where the difference shows the flanks of clipped light.
fn is_clipped(image: &ColourImage, point: &CentrelinePoint, channel: Channel) -> bool {
    let clipped = |at_widths| light_at(image, point, at_widths).map(|level| level >= CLIPPED * image.full_scale());
    match channel.colour() {
        None => clipped(0.0)[1],
        Some(colour) if channel == channel.for_boards() => clipped(0.0)[colour],
        Some(_) => INSIDE_WIDTHS.iter().chain(&BESIDE_WIDTHS).any(|&at| clipped(at).contains(&true)),
    }
}

/// The line's excess over its surroundings, judged from light that is not clipped.
fn light_of(image: &ColourImage, point: &CentrelinePoint) -> Light {
    let inside = mean_light(image, point, &INSIDE_WIDTHS);
    let Some((inside, beside)) = inside.zip(mean_light(image, point, &BESIDE_WIDTHS)) else {
        return Light::Clipped;
    };
    let added = [0, 1, 2].map(|c| (inside[c] - beside[c], c));
    let [(other, _), (own, colour)] = two_largest(added);
    if own > 0.0 && own - other > COLOURED_FRACTION * own { Light::Coloured(colour) } else { Light::White }
}

/// The second largest and the largest of three.
fn two_largest(mut of_colours: [(f32, usize); 3]) -> [(f32, usize); 2] {
    of_colours.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    [of_colours[1], of_colours[2]]
}

/// Mean red, green and blue at some distances from a point across its line, where no colour is clipped.
fn mean_light(image: &ColourImage, point: &CentrelinePoint, at_widths: &[f64]) -> Option<[f32; 3]> {
    let lights = at_widths.iter().map(|&at| light_at(image, point, at));
    let is_known = |light: &[f32; 3]| light.iter().all(|&level| level < CLIPPED * image.full_scale());
    let known: Vec<[f32; 3]> = lights.filter(is_known).collect();
    let mean = [0, 1, 2].map(|c| known.iter().map(|light| light[c]).sum::<f32>() / known.len() as f32);
    (!known.is_empty()).then_some(mean)
}

/// Red, green and blue at a distance from a point across its line; the image's border is extended.
fn light_at(image: &ColourImage, point: &CentrelinePoint, at_widths: f64) -> [f32; 3] {
    let clamped = |at: f64, size: usize| at.round().clamp(0.0, (size - 1) as f64) as usize;
    let across_px = at_widths * f64::from(point.width_px);
    let u = clamped(point.u_px + across_px * point.normal[0], image.width());
    let v = clamped(point.v_px + across_px * point.normal[1], image.height());
    image.at(u, v)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::Pixels;

    /// A green laser so bright that green is clipped and its middle is nearly white, along row 60.
    fn overexposed() -> ColourImage {
        let pixel = |idx: usize| {
            let across = ((idx / 400) as f64 - 60.2) / 8.0;
            let light = (-across * across * 4.0 * 2.0_f64.ln()).exp();
            let noise = (idx * 7919 % 4) as f64;
            let [own, other] = [600.0 * light, 225.0 * light.powf(1.3)];
            [other, own, other].map(|level| (12.0 + level + noise).min(255.0).round() as u8)
        };
        ColourImage::new(400, 120, Pixels::Eight((0..400 * 120).flat_map(pixel).collect())).unwrap()
    }

    #[test]
    fn the_colour_of_an_overexposed_laser_is_judged_beside_its_clipped_middle() {
        let (channel, scores) = laser_channel(&[overexposed()], &[CentrelineParams::default()]);
        assert_eq!(channel, Channel::Green, "{scores:?}");
        let green = scores.iter().find(|score| score.channel == Channel::Green).unwrap();
        assert!(green.n_laser_points > 380 && green.n_other_points == 0, "{green:?}");
    }

    #[test]
    fn light_of_several_colours_is_no_laser_in_luma() {
        // Stripes of red, green and blue light, as on painted surfaces, and two of a red laser.
        let stripe = |v: usize| match v {
            40 | 200 => [120, 0, 0],
            80 => [0, 120, 0],
            120 => [0, 0, 120],
            160 => [60, 60, 60],
            _ => [0, 0, 0],
        };
        let pixel = |idx: usize| {
            let near = (0..5).map(|k| stripe((idx / 400 + k).saturating_sub(2))).max().unwrap();
            near.map(|level: u8| level + 10 + (idx * 7919 % 3) as u8)
        };
        let image = ColourImage::new(400, 240, Pixels::Eight((0..400 * 240).flat_map(pixel).collect())).unwrap();
        let (_, scores) = laser_channel(&[image], &[CentrelineParams::default()]);
        let luma = scores.iter().find(|score| score.channel == Channel::Luma).unwrap();
        let per_line = luma.n_laser_points / 2;
        assert!((350..=400).contains(&per_line) && luma.n_other_points >= 2 * per_line, "{luma:?}");
    }
}
