//! Lines of a laser image, minus the background if there is one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use capture::{ChannelBasis, ChannelChoice, LaserChannel, read_photograph};
use statistics::median;
use vision::{CameraImage, CentrelineParams, Centrelines, Channel, GreyImage, LineDirection, Segment, WhiteLevel};

use crate::failure::Failure;
use crate::images::background::Background;
use crate::images::findings::{Finding, findings_of, pair_findings};
use crate::images::search::{Directions, LineSearch};

/// Ratio of the points found in the averaged image to those found without averaging, from which they are used instead:
/// averaging always finds a few more, at the expense of lateral resolution.
const SMOOTHING_GAIN: f64 = 1.5;
/// Length of a piece of line, in its own widths, from which it is long. On 21 of 26 photographs of chessboards without
/// laser light all pieces are shorter, on the others thin edges are longer; the longest lines of lasers are 50 and more.
const LONG_WIDTHS: f64 = 20.0;
/// Length of a piece relative to the image along it from which it is long, whatever its width.
const LONG_FRACTION: f64 = 0.25;
/// Fraction of clipped points from which they are a finding.
const CLIPPED_FRACTION: f64 = 0.2;

/// A laser image and its lines.
pub struct FoundLines {
    /// The image as read, as luma.
    pub photograph: GreyImage,
    /// One channel of it minus the background, if there is one: the input of the extraction.
    pub image: GreyImage,
    /// The lines.
    pub lines: Centrelines,
    /// Findings about the image.
    pub findings: Vec<Finding>,
    /// Quality of JPEG compression; `None` for lossless formats.
    pub jpeg_quality: Option<u8>,
}

/// Reads a laser image and finds its lines.
pub fn lines_of(path: &Path, background: Option<&Background>, search: &LineSearch) -> Result<FoundLines, Failure> {
    let photograph = read_photograph(path).map_err(|error| Failure::from(error).in_file(path))?;
    let photograph = photograph.scaled(search.white_level);
    let image = match background {
        Some(background) => background.subtracted_from(&photograph.image, path)?.channel(search.channel),
        None => photograph.image.channel(search.channel),
    };
    let mut lines = search.all_lines(&image);
    let mut findings = findings_of(&image, &lines, search);
    if let Some(found) = lines_in_noise(&image, &lines, &findings, search) {
        lines = found;
        findings = findings_of(&image, &lines, search);
        findings.push(Finding::Smoothed);
    }
    mark_saturated(&mut lines, &photograph.image, search.channel, background.is_some());
    let n_points = n_points(&lines);
    let pair =
        background.and_then(|background| pair_findings(&photograph.image, background.image(), n_points, search));
    // The edges that another pose leaves are no glints.
    let is_comparable = pair.as_ref().is_none_or(|finding| !finding.prevents_subtraction());
    let n_glints = if is_comparable { search.drop_glints(&mut lines) } else { 0 };
    if n_glints > 0 {
        findings.push(Finding::Glints { n: n_glints });
    }
    search.keep_wanted(&mut lines, image.full_scale(), photograph.jpeg_quality.is_some());
    if let Some(finding) = no_long_line(&lines, &image, search) {
        findings.insert(0, finding);
    }
    findings.extend(clipped(&lines));
    findings.extend(pair);
    let (photograph, jpeg_quality) = (photograph.image.channel(Channel::Luma), photograph.jpeg_quality);
    Ok(FoundLines { photograph, image, lines, findings, jpeg_quality })
}

fn n_points(lines: &Centrelines) -> usize {
    lines.segments.iter().map(|segment| segment.points.len()).sum()
}

/// The lines of the image averaged along its lines, if there is light without points that may be a line in noise, and
/// averaging finds it.
fn lines_in_noise(
    image: &GreyImage,
    lines: &Centrelines,
    findings: &[Finding],
    search: &LineSearch,
) -> Option<Centrelines> {
    let may_be_line =
        |finding: &Finding| matches!(finding, Finding::LightWithoutLine(light) if light.may_be_line_in_noise());
    if !findings.iter().any(may_be_line) {
        return None;
    }
    let smoothed = search.smoothed_lines(image);
    (n_points(&smoothed) as f64 > SMOOTHING_GAIN * n_points(lines) as f64).then_some(smoothed)
}

/// A finding if there is no line, or only short pieces.
fn no_long_line(lines: &Centrelines, image: &GreyImage, search: &LineSearch) -> Option<Finding> {
    if lines.segments.is_empty() {
        return Some(Finding::NoLine);
    }
    let whole_px = search.directions.each().iter().map(|direction| match direction {
        LineDirection::Rows => image.width(),
        LineDirection::Columns => image.height(),
    });
    let long_px = LONG_FRACTION * whole_px.min().unwrap_or_default() as f64;
    let mut longest_widths = 0.0f64;
    for Segment { points } in &lines.segments {
        let mut widths_px: Vec<f64> = points.iter().map(|point| f64::from(point.width_px)).collect();
        let widths = points.len() as f64 / median(&mut widths_px)?;
        if widths >= LONG_WIDTHS || points.len() as f64 >= long_px {
            return None;
        }
        longest_widths = longest_widths.max(widths);
    }
    Some(Finding::NoLongLine { longest_widths })
}

/// A finding if many points are clipped.
fn clipped(lines: &Centrelines) -> Option<Finding> {
    let points = lines.segments.iter().flat_map(|segment| &segment.points);
    let n_clipped = points.filter(|point| point.saturated).count();
    let fraction = n_clipped as f64 / n_points(lines).max(1) as f64;
    (fraction >= CLIPPED_FRACTION).then_some(Finding::Clipped { fraction })
}

/// Marks points that were saturated in the photograph, where the extraction saw something else: the image minus its
/// background, or one colour in excess of the others.
pub(crate) fn mark_saturated(
    lines: &mut Centrelines,
    photograph: &CameraImage,
    channel: Channel,
    is_difference: bool,
) {
    if is_difference || matches!(photograph, CameraImage::Colour(_)) {
        let size_px = (photograph.width(), photograph.height());
        lines.mark_saturated(size_px, |u, v| photograph.is_saturated(u, v, channel));
    }
}

/// The channel in which the images of one camera show its laser: as requested, or selected from some of the
/// images.
///
/// `background`: the background of each image, by its index, if there is one. Images that cannot be read are
/// ignored here and fail when their lines are extracted.
pub fn channel_of(
    choice: ChannelChoice,
    images: &[PathBuf],
    white: WhiteLevel,
    background: impl Fn(usize) -> Result<Option<Arc<Background>>, Failure>,
    directions: Directions,
) -> LaserChannel {
    if let Some(channel) = choice.fixed() {
        return LaserChannel { channel, basis: ChannelBasis::Given };
    }
    let read = |idx: usize| {
        let image = read_photograph(&images[idx]).ok()?.scaled(white).image;
        match background(idx).ok()? {
            Some(background) => background.subtracted_from(&image, &images[idx]).ok(),
            None => Some(image),
        }
    };
    let along = |&line_direction| CentrelineParams { line_direction, ..CentrelineParams::default() };
    let params: Vec<CentrelineParams> = directions.each().iter().map(along).collect();
    LaserChannel::decided(images.len(), read, &params)
}
