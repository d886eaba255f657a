//! The points of a cloud as the fits see them.

use nalgebra::Vector3;
use scanning::{Cloud, CloudPoint};

use crate::params::{MIN_COSINE, MIN_SIGMA_SHARE, UNKNOWN_SIGMA_PER_EXTENT};
use crate::request::Region;
use crate::shape::Shape;

/// One point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) position: Vector3<f64>,
    /// Unit vector from the camera. Taken from the part frame's origin, where the camera is at stage position 0;
    /// elsewhere it is off by the travel over the distance, which a weight does not feel.
    pub(crate) ray: Vector3<f64>,
    /// Standard deviation along the ray, mm.
    pub(crate) sigma_mm: f64,
    pub(crate) order: i8,
    /// Index in the cloud.
    pub(crate) cloud_idx: usize,
}

impl Sample {
    /// Share of an error along the ray that moves the point along the surface normal.
    ///
    /// The normal is taken where the ray meets the shape, not at the noisy point: weights that follow the noise
    /// bias the fit (a radius of 9 mm by −1 µm at σ = 30 µm).
    pub(crate) fn cosine(&self, shape: &Shape) -> f64 {
        let normal = match shape {
            Shape::Plane { normal, .. } => *normal,
            _ => shape.normal_at(&shape.foot_on_ray(&self.position, &self.ray)),
        };
        self.ray.dot(&normal).abs().max(MIN_COSINE)
    }

    /// Standard deviation along the surface normal, mm.
    pub(crate) fn normal_sigma_mm(&self, shape: &Shape) -> f64 {
        self.sigma_mm * self.cosine(shape)
    }
}

/// The points looked at.
pub(crate) struct Samples {
    pub(crate) all: Vec<Sample>,
    /// Whether the points carried a σ of their own.
    pub(crate) sigma_known: bool,
    /// Median σ, mm.
    pub(crate) sigma_mm: f64,
    /// Diagonal of the box around the points, mm.
    pub(crate) extent_mm: f64,
}

impl Samples {
    pub(crate) fn from_cloud(cloud: &Cloud, region: Option<&Region>) -> Self {
        let chosen = |point: &CloudPoint| {
            let position = Vector3::new(point.x_mm, point.y_mm, point.z_mm);
            let finite = position.iter().all(|value| value.is_finite()) && position.norm() > 0.0;
            (finite && region.is_none_or(|region| region.contains(&position))).then_some(position)
        };
        let mut all: Vec<Sample> = cloud
            .points
            .iter()
            .enumerate()
            .filter_map(|(cloud_idx, point)| {
                let position = chosen(point)?;
                let ray = position.normalize();
                Some(Sample { position, ray, sigma_mm: f64::from(point.sigma_mm), order: point.order, cloud_idx })
            })
            .collect();
        let extent_mm = extent(&all);
        let mut known: Vec<f64> = all.iter().map(|s| s.sigma_mm).filter(|s| s.is_finite() && *s > 0.0).collect();
        let sigma_known = !known.is_empty();
        let sigma_mm = if sigma_known { median(&mut known) } else { extent_mm * UNKNOWN_SIGMA_PER_EXTENT };
        for sample in &mut all {
            let own = sample.sigma_mm;
            let usable = own.is_finite() && own > 0.0;
            sample.sigma_mm = if usable { own.max(MIN_SIGMA_SHARE * sigma_mm) } else { sigma_mm };
        }
        Self { all, sigma_known, sigma_mm, extent_mm }
    }

    pub(crate) fn indices(&self) -> Vec<u32> {
        (0..self.all.len() as u32).collect()
    }

    pub(crate) fn at(&self, idx: u32) -> &Sample {
        &self.all[idx as usize]
    }
}

fn extent(samples: &[Sample]) -> f64 {
    let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let (low, high) = samples.iter().fold(start, |(low, high), s| (low.inf(&s.position), high.sup(&s.position)));
    if samples.is_empty() { 0.0 } else { (high - low).norm() }
}

/// The median; 0 of nothing.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// At most `limit` of the indices, evenly spread.
pub(crate) fn thinned(indices: &[u32], limit: usize) -> Vec<u32> {
    if indices.len() <= limit {
        return indices.to_vec();
    }
    (0..limit).map(|k| indices[k * indices.len() / limit]).collect()
}
