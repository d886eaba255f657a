//! The points of a cloud as the fits see them.

use nalgebra::Vector3;
use optics::{CameraFrame, PartFrame, PointMm};
use scanning::{Cloud, CloudPoint, StagePositions};

use crate::footprint::line_sigma_mm;
use crate::params::{BORDER_SIGMAS, MIN_COSINE, MIN_SIGMA_SHARE, UNKNOWN_SIGMA_PER_EXTENT, USUAL_LINE_SIGMA_MM};
use crate::request::Region;
use crate::shape::Shape;

/// One point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) in_part: PointMm<PartFrame>,
    /// Where the camera was when it saw the point: the stage carries the part, so the camera moves in the part frame.
    pub(crate) camera_in_part: PointMm<PartFrame>,
    /// Unit vector from the camera to the point, part frame.
    pub(crate) ray: Vector3<f64>,
    /// Unit vector from the point to where its light came from, part frame, if that is known.
    pub(crate) to_light: Option<Vector3<f64>>,
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
            _ => shape.normal_at(&shape.foot_on_ray(&self.in_part.xyz, &self.ray)),
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
    /// Where the stage stood; absent if the cloud does not say. Then rays are drawn as if it had stood at 0.
    pub(crate) stage: Option<StagePositions>,
    /// Thickness of the light sheets (one σ, mm), if the cloud states it.
    pub(crate) line_sigma_mm: Option<f64>,
    /// Whether the points carried a σ of their own.
    pub(crate) sigma_known: bool,
    /// Median σ, mm.
    pub(crate) sigma_mm: f64,
    /// Diagonal of the box around the points, mm.
    pub(crate) extent_mm: f64,
}

impl Samples {
    /// `light_in_camera`: where the light comes from, if the calibration says.
    pub(crate) fn from_cloud(
        cloud: &Cloud,
        region: Option<&Region>,
        light_in_camera: Option<PointMm<CameraFrame>>,
    ) -> Self {
        let stage = StagePositions::from_comments(&cloud.comments)
            .filter(|stage| cloud.points.iter().all(|point| stage.position_mm(point.frame).is_some()));
        let carried = |point: PointMm<CameraFrame>, frame: u32| match &stage {
            Some(stage) => stage.part_from_camera(&point, frame),
            None => Some(PointMm::new(point.xyz)),
        };
        let sample = |(cloud_idx, point): (usize, &CloudPoint)| {
            let in_part = PointMm::new(Vector3::new(point.x_mm, point.y_mm, point.z_mm));
            let finite = in_part.xyz.iter().all(|value| value.is_finite());
            if !finite || region.is_some_and(|region| !region.contains(&in_part.xyz)) {
                return None;
            }
            let camera_in_part = carried(PointMm::new(Vector3::zeros()), point.frame)?;
            let ray = (in_part - camera_in_part).try_normalize(f64::MIN_POSITIVE)?;
            let light_in_part = light_in_camera.and_then(|light| carried(light, point.frame));
            let to_light = light_in_part.map(|light| (light - in_part).normalize());
            let sigma_mm = f64::from(point.sigma_mm);
            Some(Sample { in_part, camera_in_part, ray, to_light, sigma_mm, order: point.order, cloud_idx })
        };
        let mut all: Vec<Sample> = cloud.points.iter().enumerate().filter_map(sample).collect();
        let extent_mm = extent(&all);
        let mut known: Vec<f64> = all.iter().map(|s| s.sigma_mm).filter(|s| s.is_finite() && *s > 0.0).collect();
        let sigma_known = !known.is_empty();
        let sigma_mm = if sigma_known { median(&mut known) } else { extent_mm * UNKNOWN_SIGMA_PER_EXTENT };
        for sample in &mut all {
            let own = sample.sigma_mm;
            let usable = own.is_finite() && own > 0.0;
            sample.sigma_mm = if usable { own.max(MIN_SIGMA_SHARE * sigma_mm) } else { sigma_mm };
        }
        Self { all, stage, line_sigma_mm: line_sigma_mm(cloud), sigma_known, sigma_mm, extent_mm }
    }

    /// How far from a feature's border points are left out, mm.
    pub(crate) fn border_margin_mm(&self) -> f64 {
        BORDER_SIGMAS * self.line_sigma_mm.unwrap_or(USUAL_LINE_SIGMA_MM)
    }

    /// Where the camera stood, mean over the points of `indices`, part frame.
    pub(crate) fn mean_camera(&self, indices: &[u32]) -> Vector3<f64> {
        let sum: Vector3<f64> = indices.iter().map(|&idx| self.at(idx).camera_in_part.xyz).sum();
        sum / indices.len().max(1) as f64
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
    let (low, high) =
        samples.iter().fold(start, |(low, high), s| (low.inf(&s.in_part.xyz), high.sup(&s.in_part.xyz)));
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
