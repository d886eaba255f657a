//! Search for features in a cloud of table and object.

use nalgebra::Vector3;
use optics::{Calibration, CameraFrame, LightSurfaces, PointMm};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use crate::fitting::outline::Outline;
use crate::fitting::ransac::{self, RadiusRange};
use crate::fitting::robust::{TrimmedFit, fit_trimmed, normalised_distance, within};
use crate::fitting::sample::{Sample, Samples};
use crate::interface::shape::Shape;
use crate::params::{
    MAX_CURVED_LIGHT_TANGENT, MIN_CURVED_COSINE, MIN_CURVED_COSINE_UNLIT, MIN_FEATURE_FRACTION,
    MIN_FEATURE_POINTS, MIN_INTERIOR_FRACTION, MIN_TABLE_FRACTION, NOMINAL_HINT_RELATIVE, PARALLEL_DEGREES,
    RANSAC_BAND_SIGMAS,
};

/// First trim of a refinement, σ: the hypothesis passes through noisy points and has as large an error itself.
const FIRST_TRIM_SIGMAS: f64 = 2.0 * RANSAC_BAND_SIGMAS;

/// Points within this many trims of a feature belong to it or to its edge and are excluded from the search for others.
const REMOVAL_TRIMS: f64 = 2.0;

/// Smallest radius searched for, in σ: smaller spheres are noise.
const MIN_RADIUS_SIGMAS: f64 = 20.0;

/// A feature with the points it was fitted to.
#[derive(Debug, Clone)]
pub(crate) struct FeatureFit {
    pub(crate) role: &'static str,
    pub(crate) shape: Shape,
    pub(crate) inliers: Vec<u32>,
    pub(crate) n_outliers: usize,
    pub(crate) n_border: usize,
    /// Whether points near the border could be left out.
    pub(crate) border_trimmed: bool,
    /// Points inside the outline, on the surface or off it.
    pub(crate) inside: Vec<u32>,
    pub(crate) trim: f64,
}

/// Position of a station's light source: the middle of the grating. `None` for plane models.
pub(crate) fn light_in_camera(calibration: &Calibration) -> Option<PointMm<CameraFrame>> {
    match &calibration.light {
        LightSurfaces::Grating(grating) => grating.ray(0.0, 0).map(|ray| PointMm::new(ray.origin_mm)),
        LightSurfaces::Planes(_) | LightSurfaces::Pencil(_) => None,
    }
}

/// Tangent of the light's incidence on a curved surface, times its curvature across the light sheet relative to its largest
/// curvature: 0 on a cylinder along the travel, whose surface is straight across the sheet.
///
/// The sheet's thickness lies in the plane of ray and light.
fn light_tangent(shape: &Shape, sample: &Sample, to_light: &Vector3<f64>) -> f64 {
    let normal = shape.normal_at(&sample.in_part.xyz);
    let lit = normal.dot(to_light).abs();
    let aside = to_light - sample.ray * sample.ray.dot(to_light);
    let across = (aside - normal * normal.dot(&aside)).try_normalize(0.0).unwrap_or_default();
    let relative = shape.curvature_along(&across) / shape.largest_curvature();
    (1.0 - lit * lit).max(0.0).sqrt() / lit * relative
}

/// Searches among the points of one cloud.
pub(crate) struct Search<'a> {
    pub(crate) samples: &'a Samples<'a>,
    pub(crate) rng: Pcg64Mcg,
}

impl Search<'_> {
    /// The plane with the most points.
    pub(crate) fn plane(&mut self, role: &'static str, candidates: &[u32]) -> Option<FeatureFit> {
        let start = ransac::plane(self.samples, candidates, &mut self.rng)?;
        self.finished(role, candidates, &start)
    }

    /// The plane parallel to `base` with the most points; `height_mm` restricts its distance.
    pub(crate) fn parallel_plane(
        &mut self,
        role: &'static str,
        candidates: &[u32],
        base: &Shape,
        height_mm: Option<f64>,
    ) -> Option<FeatureFit> {
        let Shape::Plane { normal, .. } = base else { return None };
        let near: Vec<u32> = match height_mm {
            None => candidates.to_vec(),
            Some(height) => {
                candidates.iter().copied().filter(|&idx| self.is_at_height(idx, base, height)).collect()
            }
        };
        let start = ransac::parallel_plane(self.samples, &near, normal, &mut self.rng)?;
        let found = self.finished(role, &near, &start)?;
        let Shape::Plane { normal: other, .. } = found.shape else { return None };
        let parallel = normal.dot(&other).abs() >= PARALLEL_DEGREES.to_radians().cos();
        parallel.then_some(found)
    }

    fn is_at_height(&self, idx: u32, base: &Shape, height_mm: f64) -> bool {
        let height = base.distance_mm(&self.samples.position(idx)).abs();
        (height - height_mm.abs()).abs() <= NOMINAL_HINT_RELATIVE * height_mm.abs()
    }

    /// The sphere with the most points; `radius_mm` restricts its size.
    pub(crate) fn sphere(
        &mut self,
        role: &'static str,
        candidates: &[u32],
        radius_mm: Option<f64>,
    ) -> Option<FeatureFit> {
        let start = ransac::sphere(self.samples, candidates, self.radii(radius_mm), &mut self.rng)?;
        self.finished(role, candidates, &start)
    }

    /// The cylinder with the most points; `radius_mm` restricts its size.
    pub(crate) fn cylinder(
        &mut self,
        role: &'static str,
        candidates: &[u32],
        radius_mm: Option<f64>,
    ) -> Option<FeatureFit> {
        let start = ransac::cylinder(self.samples, candidates, self.radii(radius_mm), &mut self.rng)?;
        self.finished(role, candidates, &start)
    }

    fn radii(&self, hint_mm: Option<f64>) -> RadiusRange {
        match hint_mm {
            Some(hint) => RadiusRange {
                min_mm: hint.abs() * (1.0 - NOMINAL_HINT_RELATIVE),
                max_mm: hint.abs() * (1.0 + NOMINAL_HINT_RELATIVE),
            },
            None => {
                RadiusRange { min_mm: MIN_RADIUS_SIGMAS * self.samples.sigma_mm, max_mm: self.samples.extent_mm }
            }
        }
    }

    /// Points that belong neither to a feature nor to its edges.
    pub(crate) fn without(&self, candidates: &[u32], feature: &FeatureFit) -> Vec<u32> {
        self.beyond(candidates, &feature.shape, REMOVAL_TRIMS * feature.trim)
    }

    fn beyond(&self, candidates: &[u32], shape: &Shape, reach: f64) -> Vec<u32> {
        let is_beyond = |&idx: &u32| normalised_distance(shape, &self.samples.at(idx)).abs() > reach;
        candidates.par_iter().copied().filter(is_beyond).collect()
    }

    /// All points but those of the table, if the cloud shows one.
    pub(crate) fn off_table(&mut self) -> Vec<u32> {
        let all = self.samples.indices();
        let table = ransac::plane(self.samples, &all, &mut self.rng)
            .and_then(|start| fit_trimmed(self.samples, &all, &start, FIRST_TRIM_SIGMAS, false))
            .filter(|table| table.inliers.len() as f64 >= MIN_TABLE_FRACTION * all.len() as f64);
        match table {
            Some(table) => self.beyond(&all, &table.shape, REMOVAL_TRIMS * table.trim),
            None => all,
        }
    }

    /// Refines a hypothesis twice: on all of its points, then without those near its border.
    fn finished(&self, role: &'static str, candidates: &[u32], start: &Shape) -> Option<FeatureFit> {
        let whole = fit_trimmed(self.samples, candidates, start, FIRST_TRIM_SIGMAS, false)?;
        let outline = Outline::of(self.samples, &whole.inliers, &self.view_of(&whole));
        let inside: Vec<u32> = match &outline {
            None => whole.inliers.clone(),
            Some(outline) => candidates
                .par_iter()
                .copied()
                .filter(|&idx| outline.contains(&self.samples.position(idx)))
                .collect(),
        };
        let inside = self.without_steep(inside, &whole.shape);
        let trimmed = fit_trimmed(self.samples, &inside, &whole.shape, whole.trim, true)?;
        let enough = (MIN_FEATURE_FRACTION * candidates.len() as f64).max(MIN_FEATURE_POINTS as f64);
        (trimmed.inliers.len() as f64 >= enough).then(|| FeatureFit {
            role,
            shape: self.facing_camera(&trimmed),
            n_outliers: inside.len() - trimmed.inliers.len(),
            n_border: within(self.samples, candidates, &trimmed.shape, trimmed.trim)
                .len()
                .saturating_sub(trimmed.inliers.len()),
            border_trimmed: outline.is_some(),
            inside,
            inliers: trimmed.inliers,
            trim: trimmed.trim,
        })
    }

    /// Points of a curved shape that are neither viewed nor lit too steeply, if enough remain.
    fn without_steep(&self, inside: Vec<u32>, shape: &Shape) -> Vec<u32> {
        if matches!(shape, Shape::Plane { .. }) {
            return inside;
        }
        let is_frontal = |&idx: &u32| {
            let sample = self.samples.at(idx);
            match self.samples.to_light(idx) {
                Some(to_light) => {
                    let is_seen = sample.cosine(shape) >= MIN_CURVED_COSINE;
                    is_seen && light_tangent(shape, &sample, &to_light) <= MAX_CURVED_LIGHT_TANGENT
                }
                None => sample.cosine(shape) >= MIN_CURVED_COSINE_UNLIT,
            }
        };
        let frontal: Vec<u32> = inside.par_iter().copied().filter(is_frontal).collect();
        if frontal.len() as f64 >= MIN_INTERIOR_FRACTION * inside.len() as f64 { frontal } else { inside }
    }

    /// Viewing direction for a feature's outline: the normal of a plane, otherwise the mean ray.
    fn view_of(&self, trimmed: &TrimmedFit) -> Vector3<f64> {
        match trimmed.shape {
            Shape::Plane { normal, .. } => normal,
            _ => self.mean_ray(&trimmed.inliers),
        }
    }

    fn facing_camera(&self, trimmed: &TrimmedFit) -> Shape {
        trimmed.shape.facing(&self.mean_ray(&trimmed.inliers))
    }

    fn mean_ray(&self, indices: &[u32]) -> Vector3<f64> {
        indices.iter().map(|&idx| self.samples.at(idx).ray).sum::<Vector3<f64>>().normalize()
    }
}
