//! Laser images with their detected points, coloured by order.

use std::fmt::Write as _;
use std::path::Path;

use capture::Capture;
use image::RgbImage;
use image::imageops::{FilterType, resize};
use maud::{Markup, html};
use vision::{Centrelines, GreyImage};

use super::page::{data_uri, figure};
use crate::drawing::palette::order_hex;
use crate::drawing::plot::tenths;
use crate::drawing::raster::{background, encode_jpeg};
use crate::tables::order_name;
use pipeline::Failure;

/// Maximum width of an embedded image: enough to see speckle, small enough for a page with a dozen of them.
const EMBEDDED_WIDTH_PX: u32 = 760;

/// Maximum grey level of the image under the dots, of 255.
const DIM_PEAK: f32 = 150.0;

/// Maximum number of dots per image and colour.
const MAX_DOTS: usize = 500;

/// A labelled point of an image: column, row, order.
pub type LabelledPixel = (f64, f64, i8);

/// One image of the capture with its labelled points; points without a label are drawn in grey.
pub fn labelled_image(
    capture: &Capture,
    path: &Path,
    found: Option<&Centrelines>,
    labelled: &[LabelledPixel],
    caption: &str,
) -> Result<Markup, Failure> {
    let image = capture.image(&path.display().to_string(), path)?;
    Ok(figure(drawing(&image, found, labelled)?, caption))
}

/// A thumbnail of an image.
pub fn thumbnail(original: &RgbImage, caption: &str) -> Result<Markup, Failure> {
    let (width, height) = original.dimensions();
    let thumbnail_width = width.min(EMBEDDED_WIDTH_PX);
    let small = resize(original, thumbnail_width, height * thumbnail_width / width, FilterType::Triangle);
    let uri = data_uri("image/jpeg", &encode_jpeg(&small)?);
    Ok(figure(html! { img src=(uri) alt=(caption); }, caption))
}

fn drawing(image: &GreyImage, found: Option<&Centrelines>, labelled: &[LabelledPixel]) -> Result<Markup, Failure> {
    let (width, height) = (image.width() as u32, image.height() as u32);
    let full = background(image, 1, DIM_PEAK);
    let small = match width > EMBEDDED_WIDTH_PX {
        true => resize(&full, EMBEDDED_WIDTH_PX, height * EMBEDDED_WIDTH_PX / width, FilterType::Triangle),
        false => full,
    };
    let uri = data_uri("image/jpeg", &encode_jpeg(&small)?);
    let dot = f64::from(width) / 190.0;
    let size = f64::from(width) / 45.0;
    let mut orders: Vec<i8> = labelled.iter().map(|point| point.2).collect();
    orders.sort_unstable();
    orders.dedup();
    Ok(html! {
        svg viewBox=(format!("-0.5 -0.5 {width} {height}")) role="img" {
            image href=(uri) x="-0.5" y="-0.5" width=(width) height=(height) {}
            @if let Some(found) = found {
                @let points = found.segments.iter().flat_map(|segment| &segment.points);
                (dots(&points.map(|p| (p.u_px, p.v_px)).collect::<Vec<_>>(), "#777", dot * 0.3))
            }
            @for order in orders {
                @let points = points_of(labelled, order);
                (dots(&points, &order_hex(order), dot))
                @if let Some((u_px, v_px)) = points.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)) {
                    @let x = u_px.min(f64::from(width) - 2.2 * size) + 0.5 * size;
                    @let style = format!("font-size:{size:.0}px;font-weight:650;fill:{}", order_hex(order));
                    text x=(format!("{x:.0}")) y=(format!("{:.0}", v_px - 0.5 * size)) style=(style) {
                        (order_name(order))
                    }
                }
            }
        }
    })
}

fn points_of(labelled: &[LabelledPixel], order: i8) -> Vec<(f64, f64)> {
    labelled.iter().filter(|point| point.2 == order).map(|point| (point.0, point.1)).collect()
}

fn dots(points: &[(f64, f64)], colour: &str, dot: f64) -> Markup {
    let stride = points.len().div_ceil(MAX_DOTS).max(1);
    let mut path = String::new();
    for (u_px, v_px) in points.iter().step_by(stride) {
        let _ = write!(path, "M{u_px:.1} {v_px:.1}h0");
    }
    html! { path d=(path) fill="none" stroke=(colour) stroke-width=(tenths(dot)) stroke-linecap="round" {} }
}
