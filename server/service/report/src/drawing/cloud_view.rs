//! Views of a cloud: heights above its dominant plane, from above and from two sides.

use image::RgbaImage;
use maud::{Markup, html};
use nalgebra::{Matrix3, Vector3};
use scanning::Cloud;

use super::page::figure;
use super::plot::{Axis, Plot};
use super::top_grid::TopGrid;
use crate::drawing::palette::order_hex;
use pipeline::Failure;

/// Maximum number of dots per order in a side view.
const MAX_DOTS: usize = 1800;

/// Number of points used for the dominant plane.
const PLANE_POINTS: usize = 8000;

/// Iterations of reweighting towards the dominant plane.
const PLANE_ROUNDS: usize = 30;

/// Residual at which the weight of a point is one half in the last iterations, mm.
const PLANE_SCALE_MM: f64 = 0.05;

/// Fraction of the points beyond either end of the colour scale.
const CLIPPED_FRACTION: f64 = 0.002;

/// From low to high: dark violet, blue, green, yellow.
const HEIGHT_COLOURS: [[f64; 3]; 6] = [
    [53.0, 29.0, 92.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [190.0, 220.0, 60.0],
    [253.0, 231.0, 37.0],
];

/// A point of the view: across (x), along (y), height above the plane, mm.
struct HeightPoint {
    x_mm: f64,
    y_mm: f64,
    height_mm: f64,
    order: i8,
}

/// The heights of a cloud.
pub struct CloudView {
    grid: TopGrid,
    points: Vec<HeightPoint>,
    low_mm: f64,
    high_mm: f64,
}

impl CloudView {
    /// Heights of all points above the plane that most of them lie on; up is towards the camera.
    pub fn new(cloud: &Cloud) -> Self {
        let [offset, by_x, by_y] = dominant_plane(cloud);
        let scale = (1.0 + by_x * by_x + by_y * by_y).sqrt();
        let points: Vec<HeightPoint> = cloud
            .points
            .iter()
            .map(|p| HeightPoint {
                x_mm: p.x_mm,
                y_mm: p.y_mm,
                height_mm: (offset + by_x * p.x_mm + by_y * p.y_mm - p.z_mm) / scale,
                order: p.order,
            })
            .collect();
        let mut heights: Vec<f64> = points.iter().map(|point| point.height_mm).collect();
        heights.sort_by(f64::total_cmp);
        let quantile =
            |fraction: f64| heights.get((fraction * heights.len() as f64) as usize).copied().unwrap_or(0.0);
        Self {
            grid: TopGrid::new(cloud),
            low_mm: quantile(CLIPPED_FRACTION),
            high_mm: quantile(1.0 - CLIPPED_FRACTION),
            points,
        }
    }

    /// The heights at the ends of the colour scale, mm.
    pub fn heights_mm(&self) -> [f64; 2] {
        [self.low_mm, self.high_mm]
    }

    /// Heights as colours over x and y, as the camera sees the part, with width and height of the image, mm.
    pub fn top_image(&self) -> (RgbaImage, [f64; 2]) {
        let mut sums = vec![(0.0, 0u32); self.grid.n_cells()];
        for point in &self.points {
            let sum = &mut sums[self.grid.cell(point.x_mm, point.y_mm)];
            *sum = (sum.0 + point.height_mm, sum.1 + 1);
        }
        let colour = |idx: usize| match sums[idx] {
            (_, 0) => None,
            (sum, n) => Some(self.colour(sum / f64::from(n))),
        };
        (self.grid.image(colour), self.grid.size_mm())
    }

    /// The top view with axes, for a page.
    pub fn top_view(&self) -> Result<Markup, Failure> {
        let plot = self.grid.plot(&self.top_image().0)?;
        Ok(figure(
            plot.svg(),
            &format!(
                "From above, as the camera sees it: height from {:.2} mm (violet) to {:.2} mm (yellow).",
                self.low_mm, self.high_mm
            ),
        ))
    }

    /// Height over x and height over y.
    pub fn side_views(&self) -> Markup {
        let drawing = html! {
            (self.side("x, mm", |point| point.x_mm))
            (self.side("y, mm", |point| point.y_mm))
        };
        figure(drawing, "From two sides; colours are orders. Heights are drawn on a separate scale.")
    }

    fn side(&self, title: &str, place: impl Fn(&HeightPoint) -> f64) -> Markup {
        let x = Axis::around(self.points.iter().map(&place), title);
        let room = ((self.high_mm - self.low_mm) * 0.08).max(0.05);
        let y = Axis::new(self.low_mm - room, self.high_mm + room, "height, mm");
        let mut plot = Plot::new(x, y, 520.0, 118.0);
        let mut orders: Vec<i8> = self.points.iter().map(|point| point.order).collect();
        orders.sort_unstable();
        orders.dedup();
        for order in orders {
            let of_order = self.points.iter().filter(|point| point.order == order);
            let stride = of_order.clone().count().div_ceil(MAX_DOTS).max(1);
            let dots = of_order.step_by(stride).map(|point| (place(point), point.height_mm));
            plot.dots(dots, 1.6, &format!("stroke:{};opacity:.6", order_hex(order)));
        }
        plot.svg()
    }

    fn colour(&self, height_mm: f64) -> [u8; 3] {
        let fraction = ((height_mm - self.low_mm) / (self.high_mm - self.low_mm).max(1e-9)).clamp(0.0, 1.0);
        let place = fraction * (HEIGHT_COLOURS.len() - 1) as f64;
        let idx = (place as usize).min(HEIGHT_COLOURS.len() - 2);
        let mix = |channel: usize| {
            let (from, to) = (HEIGHT_COLOURS[idx][channel], HEIGHT_COLOURS[idx + 1][channel]);
            (from + (to - from) * (place - idx as f64)) as u8
        };
        [0, 1, 2].map(mix)
    }
}

/// z = offset + by_x·x + by_y·y, by iteratively reweighted least squares, towards the plane with most points.
///
/// For display only; what is measured comes from `metrology`.
fn dominant_plane(cloud: &Cloud) -> [f64; 3] {
    let stride = cloud.points.len().div_ceil(PLANE_POINTS).max(1);
    let points: Vec<_> = cloud.points.iter().step_by(stride).collect();
    let mut plane = Vector3::new(0.0, 0.0, 0.0);
    let mut scale_mm = f64::INFINITY;
    for round in 0..PLANE_ROUNDS {
        let mut normal = Matrix3::zeros();
        let mut right = Vector3::zeros();
        for point in &points {
            let row = Vector3::new(1.0, point.x_mm, point.y_mm);
            let residual = (point.z_mm - row.dot(&plane)) / scale_mm;
            let weight = 1.0 / (1.0 + residual * residual);
            normal += row * row.transpose() * weight;
            right += row * point.z_mm * weight;
        }
        match normal.try_inverse() {
            Some(inverse) => plane = inverse * right,
            None => break,
        }
        // From coarse to fine, so that the largest face dominates.
        scale_mm = (8.0 * 0.75f64.powi(round as i32)).max(PLANE_SCALE_MM);
    }
    plane.into()
}
