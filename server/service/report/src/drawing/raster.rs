//! Raster images: detected lines drawn over images, and encoding.

use std::io::Cursor;

use image::{ImageFormat, Rgb, RgbImage};
use vision::{Centrelines, GreyImage};

use crate::drawing::palette::order_rgb;
use pipeline::{Failure, FailureKind};

/// Images whose longest side is below this are enlarged to show sub-pixel positions.
const ENLARGE_BELOW_PX: usize = 1000;

/// Maximum grey level of the image under the lines, of 255, so that colours remain visible on bright stripes.
const BACKGROUND_PEAK: f32 = 140.0;

/// Black outline of every point, so that it is visible on stripes of any brightness and width.
const OUTLINE: [(i64, i64); 8] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];

/// Maximum grey level of a photograph under its lines, of 255.
const PAGE_PEAK: f32 = 150.0;

/// Fraction of the pixels that may be brighter than the maximum grey level.
const CLIPPED_FRACTION: f32 = 0.001;

/// A laser image with its line segments in alternating colours.
pub fn overlay_by_segment(image: &GreyImage, lines: &Centrelines) -> RgbImage {
    let points = lines.segments.iter().enumerate().flat_map(|(idx, segment)| {
        let colour = order_rgb((idx % 5) as i8 - 2);
        segment.points.iter().map(move |point| (point.u_px, point.v_px, colour))
    });
    overlay(image, points)
}

/// A photograph with its line segments in alternating colours, wide enough to be visible in a thumbnail.
pub fn lines_over(photograph: &GreyImage, lines: &Centrelines) -> RgbImage {
    const HALF_WIDTH_PX: i64 = 1;
    let mut canvas = background(photograph, 1, PAGE_PEAK);
    let (width, height) = (i64::from(canvas.width()), i64::from(canvas.height()));
    for (idx, segment) in lines.segments.iter().enumerate() {
        let colour = Rgb(order_rgb((idx % 5) as i8 - 2));
        for point in &segment.points {
            let (u, v) = (point.u_px.round() as i64, point.v_px.round() as i64);
            for (x, y) in (-HALF_WIDTH_PX..=HALF_WIDTH_PX).map(|across| (u + across, v)) {
                if (0..width).contains(&x) && (0..height).contains(&y) {
                    canvas.put_pixel(x as u32, y as u32, colour);
                }
            }
        }
    }
    canvas
}

fn overlay(image: &GreyImage, points: impl Iterator<Item = (f64, f64, [u8; 3])>) -> RgbImage {
    let zoom = if image.width().max(image.height()) < ENLARGE_BELOW_PX { 2 } else { 1 };
    let mut canvas = background(image, zoom, BACKGROUND_PEAK);
    let (width, height) = (i64::from(canvas.width()), i64::from(canvas.height()));
    // Pixel (0, 0) is the centre of the top-left pixel, also of the enlarged ones.
    let place = |at_px: f64| ((at_px + 0.5) * zoom as f64).floor() as i64;
    let points: Vec<(i64, i64, [u8; 3])> = points.map(|(u, v, colour)| (place(u), place(v), colour)).collect();
    let mut put = |x: i64, y: i64, colour: [u8; 3]| {
        if (0..width).contains(&x) && (0..height).contains(&y) {
            canvas.put_pixel(x as u32, y as u32, Rgb(colour));
        }
    };
    // All outlines first, so that no line is covered by the outline of its neighbour.
    for &(x, y, _) in &points {
        OUTLINE.iter().for_each(|&(dx, dy)| put(x + dx, y + dy, [0; 3]));
    }
    points.into_iter().for_each(|(x, y, colour)| put(x, y, colour));
    canvas
}

/// The image in grey levels up to `brightest` of 255, stretched so that dim lines are visible.
pub fn background(image: &GreyImage, zoom: usize, brightest: f32) -> RgbImage {
    let peak = bright_level(image);
    RgbImage::from_fn((image.width() * zoom) as u32, (image.height() * zoom) as u32, |x, y| {
        let level = image.at(x as usize / zoom, y as usize / zoom) / peak;
        // Square root: what the eye sees as even steps.
        let grey = (level.clamp(0.0, 1.0).sqrt() * brightest) as u8;
        Rgb([grey; 3])
    })
}

/// The grey level that all but `CLIPPED_FRACTION` of the pixels stay below.
pub fn bright_level(image: &GreyImage) -> f32 {
    const BINS: usize = 256;
    let mut histogram = [0usize; BINS];
    for v in 0..image.height() {
        for u in 0..image.width() {
            let bin = image.at(u, v) / image.full_scale() * (BINS - 1) as f32;
            histogram[bin as usize] += 1;
        }
    }
    let allowed = (image.width() * image.height()) as f32 * CLIPPED_FRACTION;
    let mut above = 0usize;
    for (bin, count) in histogram.iter().enumerate().rev() {
        above += count;
        if above as f32 > allowed {
            return (bin + 1) as f32 / BINS as f32 * image.full_scale();
        }
    }
    image.full_scale()
}

/// Encodes an image as PNG.
pub fn encode_png(rgb: &RgbImage) -> Result<Vec<u8>, Failure> {
    encode(rgb, ImageFormat::Png)
}

/// Encodes an image as JPEG: a third of the size of PNG for noisy images.
pub fn encode_jpeg(rgb: &RgbImage) -> Result<Vec<u8>, Failure> {
    encode(rgb, ImageFormat::Jpeg)
}

fn encode(rgb: &RgbImage, format: ImageFormat) -> Result<Vec<u8>, Failure> {
    let mut bytes = Cursor::new(Vec::new());
    rgb.write_to(&mut bytes, format)
        .map_err(|error| Failure::new(FailureKind::Internal, "cannot encode an image").because(&error))?;
    Ok(bytes.into_inner())
}

/// Encodes an image with transparency as PNG.
pub fn encode_rgba_png(rgba: &image::RgbaImage) -> Result<Vec<u8>, Failure> {
    let mut bytes = Cursor::new(Vec::new());
    rgba.write_to(&mut bytes, ImageFormat::Png)
        .map_err(|error| Failure::new(FailureKind::Internal, "cannot encode an image").because(&error))?;
    Ok(bytes.into_inner())
}
