//! The points of a cloud as used by the fits.

use nalgebra::Vector3;
use optics::{CameraFrame, Motion, PartFrame, PointMm};
use scanning::{Cloud, CloudPoint, StagePositions};
use statistics::median;

use crate::fitting::footprint::line_sigma_mm;
use crate::interface::region::Region;
use crate::interface::shape::Shape;
use crate::params::{
    BORDER_SIGMAS, DEFAULT_LINE_SIGMA_RELATIVE, MIN_COSINE, MIN_SIGMA_RATIO, UNKNOWN_SIGMA_PER_EXTENT,
};

/// One point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) in_part: PointMm<PartFrame>,
    /// Unit vector from the camera to the point, part frame.
    pub(crate) ray: Vector3<f64>,
    /// Standard deviation along the ray, mm.
    pub(crate) sigma_mm: f64,
    pub(crate) order: i8,
}

impl Sample {
    /// Fraction of an error along the ray that moves the point along the surface normal.
    ///
    /// The normal is taken where the ray meets the shape, not at the noisy point: weights that follow the noise bias
    /// the fit (a radius of 9 mm by −1 µm at σ = 30 µm).
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

/// The points evaluated. They stay in the cloud, and derived quantities are computed on demand: a cloud of a million
/// points is as large as the rest of the program.
pub(crate) struct Samples<'a> {
    pub(crate) cloud: &'a Cloud,
    /// Indices of the evaluated points in the cloud.
    cloud_indices: Vec<u32>,
    /// Position of the light source, if the calibration states it.
    light_in_camera: Option<PointMm<CameraFrame>>,
    /// Stage positions; `None` if the cloud does not state them. Rays are then computed for a stage at position 0.
    pub(crate) stage: Option<StagePositions>,
    /// Motion of the part in every frame; empty if the cloud does not state positions.
    motions: Vec<Motion>,
    /// Thickness of the light sheets (one σ, mm), if the cloud states it.
    pub(crate) line_sigma_mm: Option<f64>,
    /// Whether the points have a σ each.
    pub(crate) sigma_known: bool,
    /// Median σ, mm.
    pub(crate) sigma_mm: f64,
    /// Diagonal of the bounding box of the points, mm.
    pub(crate) extent_mm: f64,
}

impl<'a> Samples<'a> {
    /// `light_in_camera`: position of the light source, if the calibration states it.
    pub(crate) fn from_cloud(
        cloud: &'a Cloud,
        region: Option<&Region>,
        light_in_camera: Option<PointMm<CameraFrame>>,
    ) -> Self {
        let stage = StagePositions::from_comments(&cloud.comments)
            .filter(|stage| cloud.points.iter().all(|point| stage.position(point.frame).is_some()));
        let n_frames = stage.as_ref().map_or(0, |stage| stage.positions.len() as u32);
        let motions =
            stage.iter().flat_map(|stage| (0..n_frames).filter_map(|frame| stage.motion(frame))).collect();
        let mut samples = Self {
            cloud,
            cloud_indices: Vec::new(),
            light_in_camera,
            stage,
            motions,
            line_sigma_mm: line_sigma_mm(cloud),
            sigma_known: false,
            sigma_mm: 0.0,
            extent_mm: 0.0,
        };
        let is_evaluated = |point: &CloudPoint| {
            let at = position(point);
            let is_finite = at.iter().all(|value| value.is_finite());
            is_finite && region.is_none_or(|region| region.contains(&at)) && samples.ray(point).is_some()
        };
        let evaluated = (0u32..).zip(&cloud.points).filter(|(_, point)| is_evaluated(point));
        samples.cloud_indices = evaluated.map(|(idx, _)| idx).collect();
        samples.extent_mm = samples.extent();
        let mut known: Vec<f64> = samples.points().filter_map(known_sigma_mm).collect();
        samples.sigma_known = !known.is_empty();
        samples.sigma_mm = if samples.sigma_known {
            median(&mut known).unwrap_or(0.0)
        } else {
            samples.extent_mm * UNKNOWN_SIGMA_PER_EXTENT
        };
        samples
    }

    pub(crate) fn len(&self) -> usize {
        self.cloud_indices.len()
    }

    fn points(&self) -> impl Iterator<Item = &'a CloudPoint> {
        self.cloud_indices.iter().map(|&idx| &self.cloud.points[idx as usize])
    }

    /// Index of a sample in the cloud.
    pub(crate) fn cloud_idx(&self, idx: u32) -> u32 {
        self.cloud_indices[idx as usize]
    }

    /// The cloud's point of a sample.
    pub(crate) fn point(&self, idx: u32) -> &'a CloudPoint {
        &self.cloud.points[self.cloud_idx(idx) as usize]
    }

    /// A camera-frame position in the part frame of the point's frame.
    fn carried(&self, place: &PointMm<CameraFrame>, point: &CloudPoint) -> PointMm<PartFrame> {
        let motion = self.motions.get(point.frame as usize);
        motion.map_or(PointMm::new(place.xyz), |motion| motion.part_from_camera(place))
    }

    /// Camera position for a point: the stage carries the part, so the camera moves in the part frame.
    fn camera(&self, point: &CloudPoint) -> Vector3<f64> {
        self.carried(&PointMm::new(Vector3::zeros()), point).xyz
    }

    /// Unit vector from the camera to a point; `None` for a point at the camera.
    fn ray(&self, point: &CloudPoint) -> Option<Vector3<f64>> {
        (position(point) - self.camera(point)).try_normalize(f64::MIN_POSITIVE)
    }

    /// Unit vector from a sample to its light source, part frame, if known.
    pub(crate) fn to_light(&self, idx: u32) -> Option<Vector3<f64>> {
        let point = self.point(idx);
        let light = self.carried(&self.light_in_camera?, point);
        Some((light.xyz - position(point)).normalize())
    }

    /// Width of a feature's border whose points are left out, mm.
    pub(crate) fn border_margin_mm(&self) -> f64 {
        let usual = || DEFAULT_LINE_SIGMA_RELATIVE * self.mean_distance_mm(&self.indices());
        BORDER_SIGMAS * self.line_sigma_mm.unwrap_or_else(usual)
    }

    /// Mean distance of some samples from the camera, mm.
    pub(crate) fn mean_distance_mm(&self, indices: &[u32]) -> f64 {
        let distance = |&idx: &u32| (self.position(idx) - self.camera(self.point(idx))).norm();
        indices.iter().map(distance).sum::<f64>() / indices.len().max(1) as f64
    }

    /// Mean camera position over the points of `indices`, part frame.
    pub(crate) fn mean_camera(&self, indices: &[u32]) -> Vector3<f64> {
        let sum: Vector3<f64> = indices.iter().map(|&idx| self.camera(self.point(idx))).sum();
        sum / indices.len().max(1) as f64
    }

    pub(crate) fn indices(&self) -> Vec<u32> {
        (0..self.len() as u32).collect()
    }

    /// Position of a sample, part frame, mm.
    pub(crate) fn position(&self, idx: u32) -> Vector3<f64> {
        position(self.point(idx))
    }

    pub(crate) fn at(&self, idx: u32) -> Sample {
        let point = self.point(idx);
        Sample {
            in_part: PointMm::new(position(point)),
            ray: self.ray(point).unwrap_or_else(Vector3::z),
            sigma_mm: known_sigma_mm(point).map_or(self.sigma_mm, |own| own.max(MIN_SIGMA_RATIO * self.sigma_mm)),
            order: point.order,
        }
    }

    fn extent(&self) -> f64 {
        let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let (low, high) = self.points().map(position).fold(start, |(low, high), at| (low.inf(&at), high.sup(&at)));
        if self.cloud_indices.is_empty() { 0.0 } else { (high - low).norm() }
    }
}

fn position(point: &CloudPoint) -> Vector3<f64> {
    Vector3::new(point.x_mm, point.y_mm, point.z_mm)
}

/// The σ of a point, if it has one, mm.
fn known_sigma_mm(point: &CloudPoint) -> Option<f64> {
    Some(f64::from(point.sigma_mm)).filter(|sigma_mm| sigma_mm.is_finite() && *sigma_mm > 0.0)
}

/// At most `limit` of the indices, evenly spread.
pub(crate) fn thinned(indices: &[u32], limit: usize) -> Vec<u32> {
    if indices.len() <= limit {
        return indices.to_vec();
    }
    (0..limit).map(|k| indices[k * indices.len() / limit]).collect()
}
