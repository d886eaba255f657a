//! Which channel of colour pictures shows the laser: decided from the pictures.
//!
//! Lines are looked for in every channel. A point is the laser's if its light is coloured: what it adds to the light
//! beside it is mostly of one colour. Edges of a board, paper and reflections add light of all colours.

use crate::colour::{Channel, ColourImage};
use crate::{CentrelineExtractor, CentrelineParams, CentrelinePoint, Centrelines};

/// Share of the added light by which a laser's own colour exceeds the others. White light adds equal parts; red lasers
/// that light up the blue pixels of a phone, too, and are bright enough to fill the red ones, stay above this.
const COLOURED_SHARE: f32 = 0.2;
/// Where the light of the line is looked at, in line widths from its middle: the flanks show the colour where the middle
/// is too bright for it.
const INSIDE_WIDTHS: [f64; 5] = [-0.7, -0.35, 0.0, 0.35, 0.7];
/// Where the light beside the line is looked at, in line widths from its middle.
const BESIDE_WIDTHS: [f64; 2] = [-1.6, 1.6];
/// Share of the brightest coloured lines' height from which a point is counted: a laser on black paper still is, the noise of
/// a camera in a dark room, coloured by chance, is not.
const FAINT_SHARE: f32 = 0.1;
/// A plainer channel is taken while it shows this share of what the best one does: differences of channels have the noise
/// of both.
const PLAINER_SHARE: f64 = 0.98;

/// What one channel shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelView {
    /// The channel.
    pub channel: Channel,
    /// Points on coloured lines.
    pub n_laser_points: usize,
    /// Points on what is as bright in all colours.
    pub n_other_points: usize,
    /// How well it shows the laser: the points on coloured lines less the others, each by the square root of its height
    /// over the brightest lines', so that many faint points outweigh neither the laser nor each other's chance colours.
    pub score: f64,
}

impl ChannelView {
    fn new(channel: Channel, points: &[Seen], brightest: f32) -> Self {
        let mut view = Self { channel, n_laser_points: 0, n_other_points: 0, score: 0.0 };
        for seen in points.iter().filter(|seen| seen.height >= FAINT_SHARE * brightest) {
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

/// Looks for coloured lines in all channels of some pictures of one camera and laser.
///
/// `pictures`: the laser is on in all; where there is a picture with the laser off, it was taken away before.
/// `params`: how lines are looked for, once for each direction they may run in.
/// Returns the channel to use, and what each of them shows. Without any coloured line it is brightness.
pub fn laser_channel(pictures: &[ColourImage], params: &[CentrelineParams]) -> (Channel, Vec<ChannelView>) {
    let points = Channel::ALL.map(|channel| points_in(channel, pictures, params));
    let brightest = points.iter().filter_map(|points| bright_height(points)).reduce(f32::max).unwrap_or(1.0);
    let views: Vec<ChannelView> = Channel::ALL
        .iter()
        .zip(&points)
        .map(|(&channel, points)| ChannelView::new(channel, points, brightest))
        .collect();
    (best_of(&views), views)
}

/// A point of a line as one channel shows it.
struct Seen {
    /// Grey levels above its surroundings.
    height: f32,
    /// Whether its light is coloured.
    is_coloured: bool,
}

/// How bright the brightest coloured lines are, without a few glints.
fn bright_height(points: &[Seen]) -> Option<f32> {
    let mut heights: Vec<f32> = points.iter().filter(|seen| seen.is_coloured).map(|seen| seen.height).collect();
    heights.sort_unstable_by(f32::total_cmp);
    heights.get(heights.len() * 19 / 20).copied()
}

fn best_of(views: &[ChannelView]) -> Channel {
    let best = views.iter().filter(|view| view.n_laser_points > 0).map(|view| view.score).reduce(f64::max);
    let Some(best) = best else { return Channel::Luma };
    // Where clutter outweighs the laser everywhere, the least bad is best.
    let enough = best - (1.0 - PLAINER_SHARE) * best.abs();
    let good = views.iter().find(|view| view.n_laser_points > 0 && view.score >= enough);
    good.map_or(Channel::Luma, |view| view.channel)
}

fn points_in(channel: Channel, pictures: &[ColourImage], params: &[CentrelineParams]) -> Vec<Seen> {
    let mut points = Vec::new();
    let (mut extractor, mut lines) = (CentrelineExtractor::default(), Centrelines::default());
    for picture in pictures {
        let image = picture.channel(channel);
        for params in params {
            extractor.find(&image, params, &mut lines);
            let found = lines.segments.iter().flat_map(|segment| &segment.points);
            points.extend(found.map(|point| Seen {
                height: point.intensity,
                is_coloured: is_coloured(picture, point, channel.colour()),
            }));
        }
    }
    points
}

/// Whether what the line adds to the light beside it is of that colour, or of any.
fn is_coloured(picture: &ColourImage, point: &CentrelinePoint, colour: Option<usize>) -> bool {
    let inside = mean_light(picture, point, &INSIDE_WIDTHS);
    let beside = mean_light(picture, point, &BESIDE_WIDTHS);
    let added = [0, 1, 2].map(|c| inside[c] - beside[c]);
    let brightest = added.iter().copied().fold(f32::MIN, f32::max);
    let own = colour.map_or(brightest, |c| added[c]);
    let mut others = added.to_vec();
    others.swap_remove(colour.unwrap_or_else(|| added.iter().position(|&a| a == brightest).unwrap_or(0)));
    let other = others.into_iter().fold(f32::MIN, f32::max);
    own > 0.0 && own - other > COLOURED_SHARE * own
}

/// Mean red, green and blue at some distances from a point across its line; outside the picture its border stands in.
fn mean_light(picture: &ColourImage, point: &CentrelinePoint, at_widths: &[f64]) -> [f32; 3] {
    let clamped = |at: f64, size: usize| at.round().clamp(0.0, (size - 1) as f64) as usize;
    let width_px = f64::from(point.width_px);
    let mut sum = [0.0; 3];
    for at in at_widths {
        let u = clamped(point.u_px + at * width_px * point.normal[0], picture.width());
        let v = clamped(point.v_px + at * width_px * point.normal[1], picture.height());
        let light = picture.at(u, v);
        (0..3).for_each(|c| sum[c] += light[c]);
    }
    sum.map(|light| light / at_widths.len() as f32)
}
