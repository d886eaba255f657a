//! Elliptic blobs that are darker, or brighter, than their surroundings.

use crate::GreyImage;

use super::super::params::{BLOB_MAX_ASPECT, BLOB_MAX_FILL_ERROR, BLOB_MIN_AREA_PX, BLOB_THRESHOLD_SPREADS};

/// Whether blobs are darker or brighter than their surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Polarity {
    Dark,
    Bright,
}

/// A connected blob, by its moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Blob {
    /// Centroid.
    pub centre_px: [f64; 2],
    /// Second central moments over the area: uu, uv, vv (px²).
    pub spread_px2: [f64; 3],
}

impl Blob {
    pub(super) fn distance_px(&self, other: &Self) -> f64 {
        (self.centre_px[0] - other.centre_px[0]).hypot(self.centre_px[1] - other.centre_px[1])
    }
}

/// Elliptic blobs that do not touch the image border. A pixel belongs to a blob if it differs enough from the mean of
/// the square of half-side `radius_px` around it.
pub(super) fn find_blobs(image: &GreyImage, polarity: Polarity, radius_px: usize) -> Vec<Blob> {
    let (width, height) = (image.width(), image.height());
    let mut inside = above_threshold(image, polarity, radius_px);
    let mut blobs = Vec::new();
    let mut open = Vec::new();
    for first in 0..width * height {
        if !inside[first] {
            continue;
        }
        inside[first] = false;
        open.push(first);
        let mut moments = Moments::default();
        let mut at_rim = false;
        while let Some(at) = open.pop() {
            let (u, v) = (at % width, at / width);
            moments.add([u as f64 - (first % width) as f64, v as f64 - (first / width) as f64]);
            at_rim |= u == 0 || v == 0 || u + 1 == width || v + 1 == height;
            let mut visit = |next: usize| {
                if std::mem::take(&mut inside[next]) {
                    open.push(next);
                }
            };
            if u > 0 {
                visit(at - 1);
            }
            if u + 1 < width {
                visit(at + 1);
            }
            if v > 0 {
                visit(at - width);
            }
            if v + 1 < height {
                visit(at + width);
            }
        }
        if !at_rim && moments.n >= BLOB_MIN_AREA_PX {
            blobs.extend(moments.ellipse([(first % width) as f64, (first / width) as f64]));
        }
    }
    blobs
}

/// Sums over the pixels of a blob.
#[derive(Default)]
struct Moments {
    n: f64,
    first: [f64; 2],
    second: [f64; 3],
}

impl Moments {
    fn add(&mut self, [u, v]: [f64; 2]) {
        self.n += 1.0;
        self.first = [self.first[0] + u, self.first[1] + v];
        self.second = [self.second[0] + u * u, self.second[1] + u * v, self.second[2] + v * v];
    }

    /// The blob, if it is an ellipse: then its area is 4π times the square root of the determinant of its spread.
    fn ellipse(&self, origin: [f64; 2]) -> Option<Blob> {
        let mean = self.first.map(|sum| sum / self.n);
        let [uu, uv, vv] = self.second.map(|sum| sum / self.n);
        let [uu, uv, vv] = [uu - mean[0] * mean[0], uv - mean[0] * mean[1], vv - mean[1] * mean[1]];
        let (half_sum, determinant) = (0.5 * (uu + vv), uu * vv - uv * uv);
        let apart = (half_sum * half_sum - determinant).max(0.0).sqrt();
        let is_filled =
            (self.n / (4.0 * std::f64::consts::PI * determinant.sqrt()) - 1.0).abs() < BLOB_MAX_FILL_ERROR;
        let is_round = half_sum + apart < BLOB_MAX_ASPECT * BLOB_MAX_ASPECT * (half_sum - apart);
        let centre_px = [origin[0] + mean[0], origin[1] + mean[1]];
        (determinant > 0.0 && is_filled && is_round).then_some(Blob { centre_px, spread_px2: [uu, uv, vv] })
    }
}

/// Pixels that differ from the mean of their surroundings by a fraction of the surroundings' spread.
fn above_threshold(image: &GreyImage, polarity: Polarity, radius_px: usize) -> Vec<bool> {
    let (width, height) = (image.width(), image.height());
    let sign = if polarity == Polarity::Dark { -1.0 } else { 1.0 };
    let mut sums = vec![[0.0f64; 2]; (width + 1) * (height + 1)];
    for v in 0..height {
        let mut row = [0.0; 2];
        for u in 0..width {
            let level = f64::from(image.at(u, v));
            row = [row[0] + level, row[1] + level * level];
            let above = sums[v * (width + 1) + u + 1];
            sums[(v + 1) * (width + 1) + u + 1] = [above[0] + row[0], above[1] + row[1]];
        }
    }
    let mut above_threshold = Vec::with_capacity(width * height);
    for v in 0..height {
        let (v0, v1) = (v.saturating_sub(radius_px), (v + radius_px + 1).min(height));
        for u in 0..width {
            let (u0, u1) = (u.saturating_sub(radius_px), (u + radius_px + 1).min(width));
            let n = ((u1 - u0) * (v1 - v0)) as f64;
            let mean = |k: usize| {
                let at = |u: usize, v: usize| sums[v * (width + 1) + u][k];
                (at(u1, v1) - at(u0, v1) - at(u1, v0) + at(u0, v0)) / n
            };
            let spread = (mean(1) - mean(0) * mean(0)).max(0.0).sqrt();
            let above = sign * (f64::from(image.at(u, v)) - mean(0));
            above_threshold.push(above > BLOB_THRESHOLD_SPREADS * spread);
        }
    }
    above_threshold
}
