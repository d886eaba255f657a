//! Pictures of what was found, drawn over the image it was found in.

use std::io::Cursor;

use image::{ImageFormat, Rgb, RgbImage};
use vision::{Centrelines, GreyImage};

use crate::drawing::palette::order_rgb;
use pipeline::{Failure, FailureKind};

/// Longest side of a picture that is enlarged to show sub-pixel positions; larger images are drawn as they are.
const ENLARGE_BELOW_PX: usize = 1000;

/// Brightest grey under a drawing, of 255: colours stand out of the brightest stripe.
const BACKGROUND_PEAK: f32 = 140.0;

/// Black around every point of a line: it is seen on a stripe of any brightness and width.
const RIM: [(i64, i64); 8] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];

/// Brightest grey under a drawing for a page: the lines stand out from what lit them.
const PAGE_PEAK: f32 = 150.0;

/// Share of the pixels that may be brighter than the brightest grey shown.
const CLIPPED_SHARE: f32 = 0.001;

/// A laser image with its line pieces in alternating colours.
pub fn overlay_by_segment(image: &GreyImage, lines: &Centrelines) -> RgbImage {
    let points = lines.segments.iter().enumerate().flat_map(|(idx, segment)| {
        let colour = order_rgb((idx % 5) as i8 - 2);
        segment.points.iter().map(move |point| (point.u_px, point.v_px, colour))
    });
    overlay(image, points)
}

/// A photograph as it was taken with the line pieces drawn over it, wide enough to be seen in a smaller copy.
pub fn lines_over(photograph: &GreyImage, lines: &Centrelines) -> RgbImage {
    const HALF_WIDTH_PX: i64 = 1;
    let mut picture = background(photograph, 1, PAGE_PEAK);
    let (width, height) = (i64::from(picture.width()), i64::from(picture.height()));
    for (idx, segment) in lines.segments.iter().enumerate() {
        let colour = Rgb(order_rgb((idx % 5) as i8 - 2));
        for point in &segment.points {
            let (u, v) = (point.u_px.round() as i64, point.v_px.round() as i64);
            for (x, y) in (-HALF_WIDTH_PX..=HALF_WIDTH_PX).map(|across| (u + across, v)) {
                if (0..width).contains(&x) && (0..height).contains(&y) {
                    picture.put_pixel(x as u32, y as u32, colour);
                }
            }
        }
    }
    picture
}

fn overlay(image: &GreyImage, points: impl Iterator<Item = (f64, f64, [u8; 3])>) -> RgbImage {
    let zoom = if image.width().max(image.height()) < ENLARGE_BELOW_PX { 2 } else { 1 };
    let mut picture = background(image, zoom, BACKGROUND_PEAK);
    let (width, height) = (i64::from(picture.width()), i64::from(picture.height()));
    // Pixel (0, 0) is the centre of the top-left pixel, also of the enlarged ones.
    let place = |at_px: f64| ((at_px + 0.5) * zoom as f64).floor() as i64;
    let points: Vec<(i64, i64, [u8; 3])> = points.map(|(u, v, colour)| (place(u), place(v), colour)).collect();
    let mut put = |x: i64, y: i64, colour: [u8; 3]| {
        if (0..width).contains(&x) && (0..height).contains(&y) {
            picture.put_pixel(x as u32, y as u32, Rgb(colour));
        }
    };
    // All rims first: a line must not be cut by the rim of its neighbour.
    for &(x, y, _) in &points {
        RIM.iter().for_each(|&(dx, dy)| put(x + dx, y + dy, [0; 3]));
    }
    points.into_iter().for_each(|(x, y, colour)| put(x, y, colour));
    picture
}

/// The image in grey up to `brightest` of 255, stretched so that dim lines can be seen.
pub fn background(image: &GreyImage, zoom: usize, brightest: f32) -> RgbImage {
    let peak = bright_level(image);
    RgbImage::from_fn((image.width() * zoom) as u32, (image.height() * zoom) as u32, |x, y| {
        let level = image.at(x as usize / zoom, y as usize / zoom) / peak;
        // Square root: what the eye sees as even steps.
        let grey = (level.clamp(0.0, 1.0).sqrt() * brightest) as u8;
        Rgb([grey; 3])
    })
}

/// The grey level that all but a few of the pixels stay below.
pub fn bright_level(image: &GreyImage) -> f32 {
    const BINS: usize = 256;
    let mut histogram = [0usize; BINS];
    for v in 0..image.height() {
        for u in 0..image.width() {
            let bin = image.at(u, v) / image.full_scale() * (BINS - 1) as f32;
            histogram[bin as usize] += 1;
        }
    }
    let allowed = (image.width() * image.height()) as f32 * CLIPPED_SHARE;
    let mut above = 0usize;
    for (bin, count) in histogram.iter().enumerate().rev() {
        above += count;
        if above as f32 > allowed {
            return (bin + 1) as f32 / BINS as f32 * image.full_scale();
        }
    }
    image.full_scale()
}

/// The picture as a PNG file's bytes.
pub fn encode_png(picture: &RgbImage) -> Result<Vec<u8>, Failure> {
    encode(picture, ImageFormat::Png)
}

/// The picture as a JPEG file's bytes: a third of a PNG's size where there is grain.
pub fn encode_jpeg(picture: &RgbImage) -> Result<Vec<u8>, Failure> {
    encode(picture, ImageFormat::Jpeg)
}

fn encode(picture: &RgbImage, format: ImageFormat) -> Result<Vec<u8>, Failure> {
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, format)
        .map_err(|error| Failure::new(FailureKind::Internal, "cannot encode a picture").because(&error))?;
    Ok(bytes.into_inner())
}

/// A picture with transparency as a PNG file's bytes.
pub fn encode_rgba_png(picture: &image::RgbaImage) -> Result<Vec<u8>, Failure> {
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, ImageFormat::Png)
        .map_err(|error| Failure::new(FailureKind::Internal, "cannot encode a picture").because(&error))?;
    Ok(bytes.into_inner())
}
