//! Covariances of the components of all characteristics, from noise and from errors common to all points.
//!
//! Every mode of the calibration is propagated through the whole computation: the pixels are re-triangulated, all features
//! and the datum frame are refitted, and all components are recomputed (eq. 8 of `docs/maths/metrology.md`).

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3};
use optics::{PartFrame, Rigid};
use rayon::prelude::*;

use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::chain::{Chain, PointSet, PointSetUse};
use crate::evaluation::fitted::{Fitted, MAX_FEATURE_PARAMETERS};
use crate::evaluation::rims::contour::Contour;
use crate::evaluation::rims::crossings::Crossing;
use crate::evaluation::rims::rim::{Rim, RimShift};
use crate::evaluation::values::{Primitive, State};
use crate::fitting::fit::{Matrix, Weighted, fit};
use crate::fitting::footprint::footprint_mm;
use crate::fitting::sample::thinned;
use crate::interface::shape::Shape;
use crate::measuring::noise::{FeatureNoise, shape_covariance, speckle_redundancy};
use crate::measuring::systematic::{Pixel, Retriangulation, Variant};
use crate::params::{AVERAGING_SIGMA, FOOTPRINT_SIGMA, NOISE_POINTS};

/// Step of the numerical derivatives by a feature's parameters (mm or rad).
const DERIVATIVE_STEP: f64 = 1e-6;

/// Effect of the noise on the features.
pub(crate) struct Noise {
    /// Covariance of every feature's parameters; `None` without parameters.
    pub(crate) covariances: Vec<Option<Matrix>>,
    /// RMS along the normal predicted from the noise, of every surface, mm.
    pub(crate) expected_mm: Vec<f64>,
}

/// Covariances of all features from the noise of their points.
pub(crate) fn noise(chain: &Chain, retriangulation: Option<&Retriangulation>) -> Noise {
    let samples = chain.samples;
    let of_feature = |(idx, fitted): (usize, &Result<Fitted, _>)| match fitted {
        Ok(Fitted::Surface(found)) => {
            let few = thinned(&found.inliers, NOISE_POINTS);
            let own = retriangulation.filter(|_| samples.sigma_known).zip(chain.set_of(idx, PointSetUse::Fit));
            let noise = match own {
                Some((retriangulation, set)) => retriangulation.noise_of(samples, set, &few),
                None => FeatureNoise { sigma_mm: few.iter().map(|&idx| samples.at(idx).sigma_mm).collect() },
            };
            let (covariance, _, expected_mm) =
                shape_covariance(samples, (&found.inliers, &few), &found.shape, &noise);
            (covariance, expected_mm)
        }
        Ok(Fitted::Rim(rim)) => {
            let inliers: Vec<u32> = rim.crossings.iter().map(|crossing| crossing.sample_idx).collect();
            let places: Vec<Vector3<f64>> =
                rim.crossings.iter().map(|c| samples.position(c.sample_idx) + c.offset).collect();
            (rim.covariance(&places, speckle_redundancy(samples, &inliers)), 0.0)
        }
        _ => (None, 0.0),
    };
    let all: Vec<_> = chain.fitted.par_iter().enumerate().map(of_feature).collect();
    Noise {
        covariances: all.iter().map(|(covariance, _)| *covariance).collect(),
        expected_mm: all.iter().map(|(_, expected_mm)| *expected_mm).collect(),
    }
}

/// Covariance of the components of every characteristic from the noise of all features.
pub(crate) fn by_noise(chain: &Chain, base: &State, noise: &Noise) -> Vec<Matrix3<f64>> {
    let primitives = chain.primitives();
    let steps: Vec<(usize, usize)> = (0..chain.fitted.len())
        .flat_map(|feature| (0..parameters(&primitives[feature])).map(move |parameter| (feature, parameter)))
        .collect();
    let slopes: Vec<Vec<Vector3<f64>>> = steps
        .par_iter()
        .map(|&(feature, parameter)| {
            let at = |size: f64| {
                let mut moved = primitives.clone();
                moved[feature] = stepped(&primitives[feature], parameter, size);
                chain.components(&chain.state(&moved, base.points.clone()), |idx| chain.depends_on(idx, feature))
            };
            let slope = |(plus, minus): (Option<Vector3<f64>>, Option<Vector3<f64>>)| {
                plus.zip(minus).map_or(Vector3::zeros(), |(plus, minus)| (plus - minus) / (2.0 * DERIVATIVE_STEP))
            };
            at(DERIVATIVE_STEP).into_iter().zip(at(-DERIVATIVE_STEP)).map(slope).collect()
        })
        .collect();
    (0..chain.plan.characteristics.len())
        .map(|idx| {
            let mut variance = Matrix3::zeros();
            for (row, &(feature, i)) in steps.iter().enumerate() {
                let Some(covariance) = &noise.covariances[feature] else { continue };
                for (column, _) in steps.iter().enumerate().filter(|(_, (other, _))| *other == feature) {
                    let share = covariance[(i, steps[column].1)];
                    variance += slopes[row][idx] * slopes[column][idx].transpose() * share;
                }
            }
            variance
        })
        .collect()
}

fn parameters(primitive: &Primitive) -> usize {
    match primitive {
        Primitive::Shape(shape) => shape.parameters(),
        Primitive::Contour(contour) => contour.parameters(),
        Primitive::None => 0,
    }
}

fn stepped(primitive: &Primitive, parameter: usize, size: f64) -> Primitive {
    let mut step = [0.0; MAX_FEATURE_PARAMETERS];
    step[parameter] = size;
    moved_by(primitive, &step)
}

fn moved_by(primitive: &Primitive, step: &[f64; MAX_FEATURE_PARAMETERS]) -> Primitive {
    match primitive {
        Primitive::Shape(shape) => Primitive::Shape(shape.stepped(step)),
        Primitive::Contour(contour) => Primitive::Contour(contour.stepped(step)),
        Primitive::None => Primitive::None,
    }
}

/// Effect of the common errors on the components of every characteristic.
pub(crate) struct Systematic {
    pub(crate) covariances: Vec<Matrix3<f64>>,
    /// Corrections of the components for the thickness of the lines on curved features and for averaging along them.
    pub(crate) corrections: Vec<Vector3<f64>>,
    /// Whether any mode gave no value.
    pub(crate) has_failed: Vec<bool>,
}

/// A perturbation of the re-triangulated pixels.
enum Perturbation<'a> {
    Calibration(&'a Variant),
    /// Points of curved features corrected for the thickness of the lines (one σ, mm).
    LineThickness(f64),
    /// Points of curved features corrected for averaging along the lines.
    Averaging,
    /// Rims displaced by the uncertainty of their threshold.
    Rims(RimShift),
}

/// Covariance of the components of every characteristic from the calibration, the temperature, the thickness of the lines
/// and the threshold of the rims.
pub(crate) fn by_modes(chain: &Chain, retriangulation: &Retriangulation) -> Systematic {
    let seen = |seen: Perturbation| {
        let (primitives, points) = refitted(chain, retriangulation, &seen);
        chain.components(&chain.state(&primitives, points), |_| true)
    };
    let base = seen(Perturbation::Calibration(retriangulation.unperturbed()));
    let difference = |seen: &[Option<Vector3<f64>>]| -> Vec<Option<Vector3<f64>>> {
        seen.iter().zip(&base).map(|(seen, base)| Some((*seen)? - (*base)?)).collect()
    };
    let mut modes: Vec<[Vec<Option<Vector3<f64>>>; 2]> = retriangulation
        .variants()
        .par_iter()
        .map(|pair| [0, 1].map(|side| difference(&seen(Perturbation::Calibration(&pair[side])))))
        .collect();
    for shift in [RimShift::Threshold, RimShift::Oblique] {
        let moved = difference(&seen(Perturbation::Rims(shift)));
        modes.push([moved.clone(), moved]);
    }
    let n = chain.plan.characteristics.len();
    let mut all = Systematic {
        covariances: vec![Matrix3::zeros(); n],
        corrections: vec![Vector3::zeros(); n],
        has_failed: vec![false; n],
    };
    let thickness = chain.samples.line_sigma_mm.map(|mm| (Perturbation::LineThickness(mm), FOOTPRINT_SIGMA));
    for (correction, sigma) in thickness.into_iter().chain([(Perturbation::Averaging, AVERAGING_SIGMA)]) {
        for (idx, change) in difference(&seen(correction)).into_iter().enumerate() {
            let correction = change.unwrap_or_default();
            all.corrections[idx] += correction;
            all.covariances[idx] += correction * correction.transpose() * sigma * sigma;
            all.has_failed[idx] |= change.is_none();
        }
    }
    for side in modes.iter().flatten() {
        for (idx, change) in side.iter().enumerate() {
            match change {
                Some(change) => all.covariances[idx] += change * change.transpose() / 2.0,
                None => all.has_failed[idx] = true,
            }
        }
    }
    all
}

type Pose = Rigid<DatumFrame, PartFrame>;

/// The datum frame from the re-triangulated pixels, with the calibration and with each of its variants.
pub(crate) fn pose_by_modes(
    chain: &Chain,
    retriangulation: &Retriangulation,
) -> (Option<Pose>, Vec<[Option<Pose>; 2]>) {
    let pose = |variant: &Variant| {
        let (primitives, points) = refitted(chain, retriangulation, &Perturbation::Calibration(variant));
        chain.state(&primitives, points).datum_from_part
    };
    let variants = retriangulation.variants();
    let moved = variants.par_iter().map(|pair| [0, 1].map(|side| pose(&pair[side]))).collect();
    (pose(retriangulation.unperturbed()), moved)
}

/// The datum frames perturbed by one σ of each independent component of the noise.
pub(crate) fn pose_by_noise(chain: &Chain, noise: &Noise) -> Vec<Pose> {
    let primitives = chain.primitives();
    let mut poses = Vec::new();
    for (feature, covariance) in noise.covariances.iter().enumerate() {
        let Some(covariance) = covariance else { continue };
        let eigen = covariance.symmetric_eigen();
        for k in (0..MAX_FEATURE_PARAMETERS).filter(|k| eigen.eigenvalues[*k] > 0.0) {
            let step = eigen.eigenvectors.column(k) * eigen.eigenvalues[k].sqrt();
            let mut moved = primitives.clone();
            moved[feature] = moved_by(&primitives[feature], &step.into());
            poses.extend(chain.state(&moved, Vec::new()).datum_from_part);
        }
    }
    poses
}

/// All features refitted to their perturbed pixels, and the points of those whose form is requested.
fn refitted(
    chain: &Chain,
    retriangulation: &Retriangulation,
    seen: &Perturbation,
) -> (Vec<Primitive>, Vec<Vec<Vector3<f64>>>) {
    let variant = match seen {
        Perturbation::Calibration(variant) => variant,
        _ => retriangulation.unperturbed(),
    };
    let place = |pixel: &Pixel, shape: &Shape| {
        let position = retriangulation.part_position(variant, pixel)?;
        let outwards_mm = match seen {
            Perturbation::LineThickness(line_sigma_mm) => {
                footprint_mm(shape, &position, &pixel.ray, &pixel.sheet_normal, *line_sigma_mm)
            }
            Perturbation::Averaging => -pixel.averaging_mm(shape, &position, retriangulation.averaging()),
            Perturbation::Calibration(_) | Perturbation::Rims(_) => return Some(position),
        };
        Some(position + shape.normal_at(&position) * outwards_mm)
    };
    let mut primitives = vec![Primitive::None; chain.fitted.len()];
    let mut points = vec![Vec::new(); chain.fitted.len()];
    for (set_idx, set) in chain.sets.iter().enumerate() {
        let pixels = retriangulation.pixels(set_idx);
        match (set.what, &chain.fitted[set.feature]) {
            (PointSetUse::Fit, Ok(Fitted::Surface(found))) => {
                let weighted = |pixel: &Pixel| {
                    let weight = if set.equal_weights { 1.0 } else { pixel.weight };
                    Some(Weighted { position: place(pixel, &found.shape)?, ray: pixel.ray, weight })
                };
                let weighted: Vec<Weighted> = pixels.iter().filter_map(weighted).collect();
                primitives[set.feature] = fit(&found.shape, &weighted).map_or(Primitive::None, Primitive::Shape);
            }
            (PointSetUse::Fit, Ok(Fitted::Rim(rim))) => {
                let contour = refitted_rim(
                    rim,
                    set,
                    pixels,
                    |pixel| place(pixel, &set.shape),
                    if let Perturbation::Rims(shift) = seen { *shift } else { RimShift::None },
                );
                primitives[set.feature] = contour.map_or(Primitive::None, Primitive::Contour);
            }
            _ => {}
        }
        if set.what == PointSetUse::Form {
            points[set.feature] = pixels.iter().filter_map(|pixel| place(pixel, &set.shape)).collect();
        }
    }
    (primitives, points)
}

fn refitted_rim(
    rim: &Rim,
    set: &PointSet,
    pixels: &[Pixel],
    place: impl Fn(&Pixel) -> Option<Vector3<f64>>,
    shift: RimShift,
) -> Option<Contour> {
    let crossing_of: HashMap<u32, &Crossing> = rim.crossings.iter().map(|c| (c.sample_idx, c)).collect();
    debug_assert_eq!(set.indices.len(), rim.crossings.len());
    let seen: Vec<(Vector3<f64>, &Crossing)> = pixels
        .iter()
        .filter_map(|pixel| {
            let crossing = *crossing_of.get(&pixel.sample_idx)?;
            Some((place(pixel)? + crossing.offset, crossing))
        })
        .collect();
    rim.refit(&seen, shift)
}
