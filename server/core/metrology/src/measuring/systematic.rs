//! Uncertainty from the calibration: the same pixels are triangulated with every one-σ step of its parameters.
//!
//! U_sys² = Σ over modes of the mean square of M(+mode) − M and M(−mode) − M: for a value that is linear in the mode
//! this is (ΔM/2)² with ΔM = M(+) − M(−); for one at an extremum (flatness) it does not vanish.

use nalgebra::{Vector2, Vector3};
use optics::stage::StageUncertainty;
use optics::{Calibration, CameraFrame, PointMm, Stage, StagePosition};
use rayon::prelude::*;
use statistics::median;
use vision::AveragingBias;

use crate::fitting::averaging::Course;
use crate::fitting::features::FeatureFit;
use crate::fitting::fit::{Points as _, Weighted, fit};
use crate::fitting::footprint::footprint_mm;
use crate::fitting::robust::Near;
use crate::fitting::sample::{Samples, thinned};
use crate::interface::request::{MeasureError, Tool};
use crate::interface::shape::Shape;
use crate::measuring::measure::Measurand;
use crate::measuring::noise::{FeatureNoise, correlation_px};
use crate::measuring::temperature::wavelength_drift;
use crate::measuring::value::{FirstPoints, value};
use crate::params::{MAX_MISMATCH_RELATIVE, MIN_NOISE_RATIO, SYSTEMATIC_POINTS};

/// A point with the data needed to triangulate it again.
pub(crate) struct Pixel {
    pub(crate) sample_idx: u32,
    order: i8,
    pixel: Vector2<f64>,
    pub(crate) ray: Vector3<f64>,
    phi_rad: f64,
    /// The point in the camera frame, with the unperturbed calibration.
    hit_in_camera: PointMm<CameraFrame>,
    /// Unit normal of the light sheet there, part frame.
    pub(crate) sheet_normal: Vector3<f64>,
    /// X_camera − X_part.
    carried: Vector3<f64>,
    /// Stage position of its frame; for a linear stage relative to the middle of the pixels' positions, so that the
    /// effect of the stage's parameters does not depend on its zero.
    position: StagePosition,
    /// Distance of the point from its re-triangulated position, mm.
    mismatch_mm: f64,
    /// Distance of the point from the camera, mm.
    distance_mm: f64,
    pub(crate) weight: f64,
    /// Contribution of the calibration to the σ along the ray, mm.
    systematic_sigma_mm: f64,
    /// The line there, on a curved feature.
    course: Option<Course>,
}

impl Pixel {
    pub(crate) fn order(&self) -> i8 {
        self.order
    }

    pub(crate) fn systematic_sigma_mm(&self) -> f64 {
        self.systematic_sigma_mm
    }

    /// Displacement of the point at `position` on a feature by averaging along the line, outwards, mm; 0 on a plane.
    pub(crate) fn averaging_mm(&self, shape: &Shape, position: &Vector3<f64>, averaging: &AveragingBias) -> f64 {
        self.course.as_ref().map_or(0.0, |course| course.displacement_mm(shape, position, averaging))
    }
}

/// The calibration, perturbed or not.
pub(crate) struct Variant {
    calibration: Calibration,
    /// Whether the hits in the camera frame are those of the unperturbed calibration: only the stage differs, if anything.
    has_same_hits: bool,
}

/// The pixels of the features, thinned.
pub(crate) struct Retriangulation<'a> {
    calibration: &'a Calibration,
    unperturbed: Variant,
    features: Vec<Vec<Pixel>>,
    /// What averaging along the lines did to them.
    averaging: AveragingBias,
    /// Motion of the part by the calibration's own stage at the middle of the positions.
    carried_to_middle: Vector3<f64>,
}

impl<'a> Retriangulation<'a> {
    /// Triangulates the pixels of the features' points and checks that they reproduce the cloud.
    ///
    /// # Errors
    /// [`MeasureError::CalibrationMismatch`].
    pub(crate) fn new(
        samples: &Samples,
        features: &[FeatureFit],
        calibration: &'a Calibration,
    ) -> Result<Self, MeasureError> {
        let sets: Vec<(&[u32], &Shape)> =
            features.iter().map(|feature| (&*feature.inliers, &feature.shape)).collect();
        Self::of_sets(samples, &sets, SYSTEMATIC_POINTS / features.len().max(1), calibration)
    }

    /// As [`Self::new`], for sets of points near a shape, at most `limit` points of each.
    ///
    /// # Errors
    /// [`MeasureError::CalibrationMismatch`].
    pub(crate) fn of_sets(
        samples: &Samples,
        sets: &[(&[u32], &Shape)],
        limit: usize,
        calibration: &'a Calibration,
    ) -> Result<Self, MeasureError> {
        let spread = calibration.stage_uncertainty();
        let averaging = AveragingBias::new(correlation_px(samples.cloud));
        let mut mismatches = Vec::new();
        let mut lost = 0;
        let mut features: Vec<Vec<Pixel>> = sets
            .iter()
            .map(|(indices, shape)| {
                let few = thinned(indices, limit);
                let near = Near { samples, indices: &few, shape };
                let reach = (shape.largest_curvature() > 0.0).then(|| averaging.reach());
                let pixels: Vec<Pixel> = few
                    .iter()
                    .enumerate()
                    .filter_map(|(at, &idx)| {
                        pixel((samples, idx), near.at(at).weight, (calibration, &spread), reach)
                    })
                    .collect();
                lost += few.len() - pixels.len();
                mismatches.extend(pixels.iter().map(|p| p.mismatch_mm));
                pixels
            })
            .collect();
        let median_mm =
            if lost > mismatches.len() { f64::INFINITY } else { median(&mut mismatches).unwrap_or(0.0) };
        let farthest_mm = features.iter().flatten().map(|pixel| pixel.distance_mm).fold(0.0, f64::max);
        if median_mm > MAX_MISMATCH_RELATIVE * farthest_mm {
            return Err(MeasureError::CalibrationMismatch { median_mm });
        }
        let linear = calibration.stage.and_then(|stage| stage.linear());
        let direction = linear.map_or(Vector3::zeros(), |stage| stage.direction);
        let middle_mm = middle(features.iter().flatten().filter_map(|pixel| pixel.position.mm()));
        for pixel in features.iter_mut().flatten() {
            if let StagePosition::LinearMm(position_mm) = &mut pixel.position {
                *position_mm -= middle_mm;
            }
        }
        let unperturbed = Variant { calibration: calibration.clone(), has_same_hits: true };
        Ok(Self { calibration, unperturbed, features, averaging, carried_to_middle: direction * middle_mm })
    }

    /// The noise part of every inlier's σ: the remainder after the calibration's contribution at the nearest triangulated
    /// point of the same order.
    pub(crate) fn noise_of(&self, samples: &Samples, feature_idx: usize, inliers: &[u32]) -> FeatureNoise {
        let mut by_order: std::collections::BTreeMap<i8, Vec<(u32, f64)>> = std::collections::BTreeMap::new();
        for p in &self.features[feature_idx] {
            by_order.entry(p.order).or_default().push((p.sample_idx, p.systematic_sigma_mm));
        }
        let systematic_at = |idx: u32| {
            let known = by_order.get(&samples.at(idx).order)?;
            let after = known.partition_point(|(at, _)| *at < idx);
            let beside = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|k| known.get(k));
            beside.min_by_key(|(at, _)| at.abs_diff(idx)).map(|(_, sigma_mm)| *sigma_mm)
        };
        let sigma_mm = inliers
            .iter()
            .map(|&idx| {
                let total = samples.at(idx).sigma_mm;
                let systematic = systematic_at(idx).unwrap_or(0.0);
                (total * total - systematic * systematic).max(0.0).sqrt().max(MIN_NOISE_RATIO * total)
            })
            .collect();
        FeatureNoise { sigma_mm }
    }

    /// Standard uncertainty of the value from the calibration's covariance and the thermal drift of the light, and the
    /// number of modes that gave no value.
    pub(crate) fn standard_uncertainty(
        &self,
        measurand: &Measurand,
        features: &[FeatureFit],
    ) -> Option<(f64, usize)> {
        let shapes: Vec<Shape> = features.iter().map(|f| f.shape).collect();
        let seen = |variant: &Variant| {
            self.value_with(measurand, &shapes, variant, |p, _| self.part_position(variant, p))
        };
        let base = seen(&self.unperturbed)?;
        let squares: Vec<Option<f64>> = self
            .variants()
            .into_par_iter()
            .map(|[plus, minus]| {
                let (plus, minus) = (seen(&plus)? - base, seen(&minus)? - base);
                Some((plus * plus + minus * minus) / 2.0)
            })
            .collect();
        let failed = squares.iter().filter(|square| square.is_none()).count();
        Some((squares.into_iter().flatten().sum::<f64>().sqrt(), failed))
    }

    /// The calibration displaced by ±1 σ along every mode of its covariance, and by ±1 σ of temperature.
    pub(crate) fn variants(&self) -> Vec<[Variant; 2]> {
        let n_stage = self.calibration.stage.map_or(0, |stage| stage.parameters());
        let n_of_hits = self.calibration.covariance.nrows() - n_stage;
        let stepped = |mode: &Vec<f64>| {
            let has_same_hits = mode[..n_of_hits].iter().all(|step| *step == 0.0);
            let back: Vec<f64> = mode.iter().map(|step| -step).collect();
            [mode, &back].map(|step| Variant { calibration: self.calibration.stepped(step), has_same_hits })
        };
        let drift = wavelength_drift(self.calibration)
            .map(|pair| pair.map(|calibration| Variant { calibration, has_same_hits: false }));
        self.calibration.sigma_modes().iter().map(stepped).chain(drift).collect()
    }

    /// The pixels of a set.
    pub(crate) fn pixels(&self, set: usize) -> &[Pixel] {
        &self.features[set]
    }

    /// The unperturbed calibration.
    pub(crate) fn unperturbed(&self) -> &Variant {
        &self.unperturbed
    }

    /// What averaging along the lines did to them.
    pub(crate) fn averaging(&self) -> &AveragingBias {
        &self.averaging
    }

    /// Change of the value when every point of a curved feature moves back by what averaging along the line displaced it;
    /// 0 for flat features.
    pub(crate) fn averaging_correction(&self, measurand: &Measurand, features: &[FeatureFit]) -> Option<f64> {
        self.change(measurand, features, |p, shape, position| -p.averaging_mm(shape, position, &self.averaging))
    }

    /// Change of the value when every point of a curved feature moves back by the displacement of a line of finite
    /// thickness ([`footprint_mm`]); 0 for flat features.
    pub(crate) fn thickness_correction(
        &self,
        measurand: &Measurand,
        features: &[FeatureFit],
        line_sigma_mm: f64,
    ) -> Option<f64> {
        self.change(measurand, features, |p, shape, position| {
            footprint_mm(shape, position, &p.ray, &p.sheet_normal, line_sigma_mm)
        })
    }

    /// Change of the value when every point moves along the outward normal of its feature.
    fn change(
        &self,
        measurand: &Measurand,
        features: &[FeatureFit],
        outwards_mm: impl Fn(&Pixel, &Shape, &Vector3<f64>) -> f64,
    ) -> Option<f64> {
        let shapes: Vec<Shape> = features.iter().map(|f| f.shape).collect();
        let unperturbed = &self.unperturbed;
        let as_seen =
            self.value_with(measurand, &shapes, unperturbed, |p, _| self.part_position(unperturbed, p))?;
        let moved = self.value_with(measurand, &shapes, unperturbed, |p, shape| {
            let position = self.part_position(unperturbed, p)?;
            Some(position + shape.normal_at(&position) * outwards_mm(p, shape, &position))
        })?;
        Some(moved - as_seen)
    }

    /// The value after refitting every shape to its points at positions given by `place`; `variant` determines the
    /// camera's position.
    fn value_with(
        &self,
        measurand: &Measurand,
        shapes: &[Shape],
        variant: &Variant,
        place: impl Fn(&Pixel, &Shape) -> Option<Vector3<f64>>,
    ) -> Option<f64> {
        let mut refitted = Vec::with_capacity(shapes.len());
        let mut first_positions: Option<Vec<Vector3<f64>>> = None;
        for (shape, pixels) in shapes.iter().zip(&self.features) {
            let points: Vec<Weighted> = pixels
                .iter()
                .filter_map(|p| {
                    let weight = if measurand.tool == Tool::Flatness { 1.0 } else { p.weight };
                    Some(Weighted { position: place(p, shape)?, ray: p.ray, weight })
                })
                .collect();
            refitted.push(fit(shape, &points)?);
            first_positions.get_or_insert_with(|| points.iter().map(|p| p.position).collect());
        }
        let first = FirstPoints {
            positions: first_positions?,
            camera: self.mean_camera(variant, self.features.first()?)?,
        };
        value(measurand, &refitted, &first)
    }

    /// Position of a pixel's point under a variant, part frame.
    pub(crate) fn part_position(&self, variant: &Variant, pixel: &Pixel) -> Option<Vector3<f64>> {
        let hit = if variant.has_same_hits {
            pixel.hit_in_camera
        } else {
            variant.calibration.triangulate(pixel.order, &pixel.pixel, Some(pixel.phi_rad))?.hit_in_camera
        };
        match variant.calibration.stage {
            Some(stage) => self.part_from_camera(&stage, &hit, pixel.position),
            None => Some(hit.xyz - pixel.carried),
        }
    }

    /// A point in the camera frame at a pixel's position of the stage, part frame. The middle of the scan is taken to be
    /// the middle of the travel whose straightness and tilt were determined, so that U does not depend on the stage's zero.
    fn part_from_camera(
        &self,
        stage: &Stage,
        in_camera: &PointMm<CameraFrame>,
        position: StagePosition,
    ) -> Option<Vector3<f64>> {
        match (stage, position) {
            (Stage::Linear(axis), StagePosition::LinearMm(position_mm)) => {
                let at_middle = axis.motion_from_middle(position_mm).part_from_camera(in_camera);
                Some(at_middle.xyz - self.carried_to_middle)
            }
            _ => Some(stage.part_from_camera(in_camera, position)?.xyz),
        }
    }

    /// Mean camera position over the pixels, part frame.
    fn mean_camera(&self, variant: &Variant, pixels: &[Pixel]) -> Option<Vector3<f64>> {
        let camera = PointMm::<CameraFrame>::new(Vector3::zeros());
        let Some(stage) = variant.calibration.stage else { return Some(camera.xyz) };
        let places = pixels.iter().map(|p| self.part_from_camera(&stage, &camera, p.position));
        Some(places.sum::<Option<Vector3<f64>>>()? / pixels.len().max(1) as f64)
    }
}

/// Midpoint between minimum and maximum; 0 if empty.
fn middle(values: impl Iterator<Item = f64>) -> f64 {
    let ends = values.fold(None, |ends: Option<(f64, f64)>, value| {
        Some(ends.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
    });
    ends.map_or(0.0, |(low, high)| 0.5 * (low + high))
}

/// `reach`: columns over which the course of the line matters, on a curved feature.
fn pixel(
    (samples, sample_idx): (&Samples, u32),
    weight: f64,
    (calibration, spread): (&Calibration, &StageUncertainty),
    reach: Option<usize>,
) -> Option<Pixel> {
    let sample = samples.at(sample_idx);
    let point = samples.point(sample_idx);
    let pixel = Vector2::new(f64::from(point.u_px), f64::from(point.v_px));
    let hit = calibration.triangulate(point.order, &pixel, None)?;
    let carried = hit.hit_in_camera.xyz - sample.in_part.xyz;
    let position = match &samples.stage {
        Some(stage) => stage.position(point.frame)?,
        None => StagePosition::LinearMm(position_along(calibration, &carried)),
    };
    let of_stage_mm = spread.in_frame(position).sigma_mm(&hit.hit_in_camera);
    let motion = calibration.stage.and_then(|stage| stage.motion(position));
    let systematic_sigma_mm = calibration.systematic_sigma_mm(point.order, &hit)?.hypot(of_stage_mm);
    let noise_sigma_mm = (sample.sigma_mm.powi(2) - systematic_sigma_mm.powi(2)).max(0.0).sqrt();
    let in_part = |direction: &Vector3<f64>| motion.map_or(*direction, |motion| motion.part_direction(direction));
    let course = |reach| Course::at((samples, sample_idx), (calibration, &hit), noise_sigma_mm, reach, in_part);
    Some(Pixel {
        sample_idx,
        order: point.order,
        pixel,
        ray: sample.ray,
        phi_rad: hit.hit.phi_rad,
        hit_in_camera: hit.hit_in_camera,
        sheet_normal: in_part(&hit.hit.normal),
        carried,
        position,
        mismatch_mm: mismatch_mm(calibration, &hit.hit_in_camera, &carried, position),
        distance_mm: hit.hit_in_camera.xyz.norm(),
        weight,
        systematic_sigma_mm,
        course: reach.and_then(course),
    })
}

/// The stage position that best explains a point's motion, for clouds that do not state stage positions.
fn position_along(calibration: &Calibration, carried: &Vector3<f64>) -> f64 {
    let linear = calibration.stage.and_then(|stage| stage.linear());
    let direction = linear.map_or(Vector3::zeros(), |stage| stage.direction);
    let travel = direction.norm_squared();
    if travel > 0.0 { direction.dot(carried) / travel } else { 0.0 }
}

/// Distance of the point from its position according to the stage; 0 without a stage, infinite for another kind of
/// stage.
fn mismatch_mm(
    calibration: &Calibration,
    hit: &PointMm<CameraFrame>,
    carried: &Vector3<f64>,
    position: StagePosition,
) -> f64 {
    let Some(stage) = calibration.stage else { return 0.0 };
    stage.part_from_camera(hit, position).map_or(f64::INFINITY, |part| (hit.xyz - part.xyz - carried).norm())
}
