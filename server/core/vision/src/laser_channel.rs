//! Selects the channel of colour images that shows the laser best.
//!
//! Lines are extracted in every channel. A point belongs to the laser if its light is coloured: the excess over its
//! surroundings is mostly of one colour. The excess at board edges, on paper and in reflections has all colours.

use crate::colour::{Channel, ColourImage};
use crate::{CentrelineExtractor, CentrelineParams, CentrelinePoint, Centrelines};

/// Fraction of the added light by which a laser's own colour exceeds the others. White light adds equal parts; even red
/// lasers that also excite the blue pixels of a phone, and saturate the red ones, stay above this.
const COLOURED_FRACTION: f32 = 0.2;
/// Sample positions across the line, in line widths from its middle: the flanks have the colour where the middle is
/// saturated.
const INSIDE_WIDTHS: [f64; 5] = [-0.7, -0.35, 0.0, 0.35, 0.7];
/// Sample positions beside the line, in line widths from its middle.
const BESIDE_WIDTHS: [f64; 2] = [-1.6, 1.6];
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
    fn new(channel: Channel, points: &[ChannelPoint], brightest: f32) -> Self {
        let mut view = Self { channel, n_laser_points: 0, n_other_points: 0, score: 0.0 };
        for seen in points.iter().filter(|seen| seen.height >= FAINT_FRACTION * brightest) {
            let weight = f64::from((seen.height / brightest).min(1.0)).sqrt();
            if seen.is_coloured {
                view.n_laser_points += 1;
                view.score += weight;
            } else {
                view.n_other_points += 1;
                view.score -= weight;
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
    /// Whether its light is coloured.
    is_coloured: bool,
}

/// Height of the brightest coloured lines, robust against a few glints.
fn bright_height(points: &[ChannelPoint]) -> Option<f32> {
    let mut heights: Vec<f32> = points.iter().filter(|seen| seen.is_coloured).map(|seen| seen.height).collect();
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
            let found = lines.segments.iter().flat_map(|segment| &segment.points);
            points.extend(found.map(|point| ChannelPoint {
                height: point.intensity,
                is_coloured: is_coloured(colour_image, point, channel.colour()),
            }));
        }
    }
    points
}

/// Whether the line's excess over its surroundings is of this colour, or of any single colour for `None`.
fn is_coloured(colour_image: &ColourImage, point: &CentrelinePoint, colour: Option<usize>) -> bool {
    let inside = mean_light(colour_image, point, &INSIDE_WIDTHS);
    let beside = mean_light(colour_image, point, &BESIDE_WIDTHS);
    let added = [0, 1, 2].map(|c| inside[c] - beside[c]);
    let brightest = added.iter().copied().fold(f32::MIN, f32::max);
    let own = colour.map_or(brightest, |c| added[c]);
    let mut others = added.to_vec();
    others.swap_remove(colour.unwrap_or_else(|| added.iter().position(|&a| a == brightest).unwrap_or(0)));
    let other = others.into_iter().fold(f32::MIN, f32::max);
    own > 0.0 && own - other > COLOURED_FRACTION * own
}

/// Mean red, green and blue at some distances from a point across its line; the image's border is extended.
fn mean_light(colour_image: &ColourImage, point: &CentrelinePoint, at_widths: &[f64]) -> [f32; 3] {
    let clamped = |at: f64, size: usize| at.round().clamp(0.0, (size - 1) as f64) as usize;
    let width_px = f64::from(point.width_px);
    let mut sum = [0.0; 3];
    for at in at_widths {
        let u = clamped(point.u_px + at * width_px * point.normal[0], colour_image.width());
        let v = clamped(point.v_px + at * width_px * point.normal[1], colour_image.height());
        let light = colour_image.at(u, v);
        (0..3).for_each(|c| sum[c] += light[c]);
    }
    sum.map(|light| light / at_widths.len() as f32)
}
