//! A laser in colour photographs, rendered with ground truth: daylight in all colour channels, and a laser mostly in
//! one.

use std::path::Path;

use image::RgbImage;
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use nalgebra::Vector2;
use twin::{Exposure, ExposureBuffers, Renderer, Scene, TruthPoint};
use vision::{CentrelinePoint, GreyImage, Pixels};

/// Fractions of a red diode's light in the red, green and blue pixels of a phone's camera.
pub const RED_LASER: [f32; 3] = [1.0, 0.08, 0.05];
/// The same of a green one.
pub const GREEN_LASER: [f32; 3] = [0.06, 1.0, 0.12];

/// White of the ambient light in each colour: warm white.
const WHITE: [f64; 3] = [1.0, 0.93, 0.85];

/// A photograph: every colour channel has independent noise. `ambient_level`: brightness of white paper, of 255.
pub fn photograph(
    renderer: &Renderer,
    scene: &Scene,
    ambient_level: f64,
    laser: [f32; 3],
    image_number: u64,
) -> RgbImage {
    let mut buffers = ExposureBuffers::default();
    let colours = [0, 1, 2].map(|c| {
        let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
        let exposure = Exposure {
            scene,
            position: 0.0,
            ambient_level: ambient_level * WHITE[c],
            ambient_exposure: 1.0,
            laser_exposure: laser[c],
            gain: 1.0,
            bits: 8,
            image_number: 3 * image_number + c as u64,
        };
        renderer.expose(&exposure, &mut buffers, &mut image);
        image
    });
    let (width, height) = (colours[0].width() as u32, colours[0].height() as u32);
    RgbImage::from_fn(width, height, |u, v| {
        image::Rgb([0, 1, 2].map(|c: usize| colours[c].at(u as usize, v as usize) as u8))
    })
}

/// Writes a JPEG with chroma subsampling as in cameras and phones: two by two pixels share one mean colour.
pub fn write_jpeg(path: &Path, image: &RgbImage, quality: u8) {
    let shared = RgbImage::from_fn(image.width(), image.height(), |u, v| {
        let luma = |rgb: [f32; 3]| 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2];
        let at =
            |u: u32, v: u32| image.get_pixel(u.min(image.width() - 1), v.min(image.height() - 1)).0.map(f32::from);
        let (first_u, first_v) = (u - u % 2, v - v % 2);
        let block = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(du, dv)| at(first_u + du, first_v + dv));
        let own = luma(at(u, v));
        // Chroma is the difference from brightness.
        image::Rgb([0, 1, 2].map(|c: usize| {
            let colour = block.iter().map(|&rgb| (rgb[c] - luma(rgb)) / 4.0).sum::<f32>();
            (own + colour).round().clamp(0.0, 255.0) as u8
        }))
    });
    let mut encoder = Encoder::new_file(path, quality).unwrap();
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder.encode(shared.as_raw(), image.width() as u16, image.height() as u16, ColorType::Rgb).unwrap();
}

/// Agreement of points with the truth of lines along rows.
#[derive(Debug)]
pub struct Agreement {
    /// Fraction of the truth with a point beside it.
    pub found: f64,
    /// Points that lie on no line.
    pub n_elsewhere: usize,
    /// Total number of points.
    pub n_points: usize,
    /// Standard deviation of the distances, px, and relative to the stated standard deviations; both from the median:
    /// where the edge of a square runs along a line, half of the line is missing and no centre is correct.
    pub spread_px: f64,
    /// See [`Agreement::spread_px`].
    pub normalised: f64,
}

/// Greatest distance of a point on a line from its truth.
const ON_LINE_PX: f64 = 2.5;
/// Rows and columns of the border where lines end.
const BORDER_PX: f64 = 12.0;

/// Compares points; the distance along the normal is converted to one along the column.
pub fn agreement(points: &[CentrelinePoint], truth: &[TruthPoint], size: Vector2<f64>) -> Agreement {
    let inside = |u: f64, v: f64| {
        (BORDER_PX..size.x - BORDER_PX).contains(&u) && (BORDER_PX..size.y - BORDER_PX).contains(&v)
    };
    let truth: Vec<&TruthPoint> = truth.iter().filter(|point| inside(point.u_px, point.v_px)).collect();
    // Points lie where the normal intersects the line, between columns; the truth is at whole ones.
    let distance = |point: &CentrelinePoint, at: &TruthPoint, next: &TruthPoint| {
        let slope = (next.v_px - at.v_px) / (next.u_px - at.u_px);
        (point.v_px - at.v_px - slope * (point.u_px - at.u_px)) / (1.0 + slope * slope).sqrt()
    };
    let (mut n_found, mut distances) = (0usize, Vec::new());
    for (at, next) in
        truth.iter().zip(truth.iter().skip(1)).filter(|(at, next)| (next.u_px - at.u_px - 1.0).abs() < 1e-6)
    {
        let here = points.iter().filter(|point| (point.u_px - at.u_px).abs() <= 0.5);
        let near = here.map(|point| (distance(point, at, next), point.sigma_px));
        let near = near.filter(|(distance, _)| distance.abs() < ON_LINE_PX);
        if let Some(near) = near.min_by(|a, b| a.0.abs().total_cmp(&b.0.abs())) {
            n_found += 1;
            distances.push(near);
        }
    }
    let n_elsewhere = points
        .iter()
        .filter(|point| inside(point.u_px, point.v_px))
        .filter(|point| {
            !truth.iter().any(|t| (t.u_px - point.u_px).abs() < 1.0 && (t.v_px - point.v_px).abs() < ON_LINE_PX)
        })
        .count();
    Agreement {
        found: n_found as f64 / truth.len() as f64,
        n_elsewhere,
        n_points: points.len(),
        spread_px: spread(distances.iter().map(|(distance, _)| *distance)),
        normalised: spread(distances.iter().map(|(distance, sigma)| distance / sigma)),
    }
}

/// Standard deviation of a normal distribution with the same median of its absolute values.
fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    1.4826 * sizes[sizes.len() / 2]
}
