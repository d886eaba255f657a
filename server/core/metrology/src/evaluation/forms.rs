//! The points used to evaluate a plan: those that features are fitted to, and those that show a form.

use nalgebra::Vector3;
use optics::Calibration;
use statistics::{SIGMA_PER_MAD, median};

use crate::evaluation::chain::{Chain, PointSet, PointSetUse};
use crate::evaluation::fitted::Fitted;
use crate::evaluation::values::{State, form_residuals};
use crate::fitting::features::FeatureFit;
use crate::fitting::sample::thinned;
use crate::interface::request::MeasureError;
use crate::interface::shape::Shape;
use crate::measuring::form::keep_form;
use crate::measuring::systematic::Retriangulation;
use crate::params::{FLATNESS_TRIM_SIGMAS, MIN_FEATURE_POINTS, MIN_SYSTEMATIC_POINTS, SYSTEMATIC_POINTS};
use crate::plan::characteristic::Measure;
use crate::plan::feature::FeatureShape;

/// The points on which the form of a feature is evaluated.
pub(crate) struct Form {
    pub(crate) characteristic: usize,
    pub(crate) feature: usize,
    /// Points and, for flatness, their least-squares plane.
    pub(crate) inliers: Vec<u32>,
    pub(crate) shape: Shape,
}

/// The forms requested by a plan, and a subset of the points of each feature whose form is requested.
pub(crate) fn forms(chain: &Chain) -> (Vec<Form>, Vec<Vec<Vector3<f64>>>) {
    let state = chain.state(&chain.primitives(), Vec::new());
    let mut forms = Vec::new();
    let mut points: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); chain.fitted.len()];
    for (idx, characteristic) in chain.plan.characteristics.iter().enumerate() {
        let measure = &characteristic.measure;
        if !measure.is_deviation() || matches!(measure, Measure::Position { .. }) {
            continue;
        }
        let toleranced = measure.features().first().and_then(|id| chain.plan.feature_idx(id));
        let Some(feature) = toleranced else { continue };
        let form = match &chain.fitted[feature] {
            Ok(Fitted::Surface(found)) => {
                let mut plane: FeatureFit = found.clone();
                keep_form(chain.samples, &mut plane).map(|()| Form {
                    characteristic: idx,
                    feature,
                    inliers: plane.inliers,
                    shape: plane.shape,
                })
            }
            Ok(Fitted::Section(indices)) => section(chain, measure, &state, indices)
                .map(|(inliers, shape)| Form { characteristic: idx, feature, inliers, shape }),
            _ => None,
        };
        if let Some(form) = form {
            let few = thinned(&form.inliers, FORM_POINTS);
            points[feature] = few.iter().map(|idx| chain.samples.position(*idx)).collect();
            forms.push(form);
        }
    }
    (forms, points)
}

/// Most points of a form that are re-evaluated for each perturbation of its features.
const FORM_POINTS: usize = 2000;

/// Points of a section that belong to its contour, and a plane through them.
fn section(chain: &Chain, measure: &Measure, state: &State, indices: &[u32]) -> Option<(Vec<u32>, Shape)> {
    let samples = chain.samples;
    let positions: Vec<Vector3<f64>> = indices.iter().map(|idx| samples.position(*idx)).collect();
    let residuals = form_residuals(chain.plan, measure, state, &positions)?;
    let mut sizes: Vec<f64> = residuals.iter().map(|residual| residual.abs()).collect();
    let trim = FLATNESS_TRIM_SIGMAS * SIGMA_PER_MAD * median(&mut sizes)?;
    let kept = indices.iter().zip(&residuals).filter(|(_, r)| **r != 0.0 && r.abs() <= trim).map(|(idx, _)| *idx);
    let kept: Vec<u32> = kept.collect();
    let middle = kept.iter().map(|idx| samples.position(*idx)).sum::<Vector3<f64>>() / kept.len().max(1) as f64;
    let FeatureShape::Section { y, .. } =
        &chain.plan.features[chain.plan.feature_idx(measure.features()[0])?].shape
    else {
        return None;
    };
    let normal = state.datum_from_part?.rotation.inverse() * Vector3::from(*y).normalize();
    (kept.len() >= MIN_FEATURE_POINTS).then_some((kept, Shape::Plane { point_mm: middle, normal }))
}

/// The points that are re-triangulated for every mode of the calibration.
pub(crate) fn sets(chain: &Chain, forms: &[Form]) -> Vec<PointSet> {
    let mut sets = Vec::new();
    let is_flatness = |feature: usize| {
        let of = |form: &&Form| form.feature == feature;
        forms.iter().filter(of).any(|form| {
            matches!(chain.plan.characteristics[form.characteristic].measure, Measure::Flatness { .. })
        })
    };
    for (feature, fitted) in chain.fitted.iter().enumerate() {
        let (indices, shape) = match fitted {
            Ok(Fitted::Surface(found)) => (found.inliers.clone(), found.shape),
            Ok(Fitted::Rim(rim)) => match &chain.fitted[rim.plane_idx] {
                Ok(Fitted::Surface(plane)) => (rim.crossings.iter().map(|c| c.sample_idx).collect(), plane.shape),
                _ => continue,
            },
            _ => continue,
        };
        sets.push(PointSet {
            feature,
            what: PointSetUse::Fit,
            indices,
            shape,
            equal_weights: is_flatness(feature),
        });
    }
    for form in forms {
        if sets.iter().all(|set: &PointSet| set.feature != form.feature || set.what != PointSetUse::Form) {
            let (indices, shape) = (form.inliers.clone(), form.shape);
            sets.push(PointSet {
                feature: form.feature,
                what: PointSetUse::Form,
                indices,
                shape,
                equal_weights: true,
            });
        }
    }
    sets
}

/// The pixels of the sets; `None` without a calibration.
///
/// # Errors
/// [`MeasureError::CalibrationMismatch`].
pub(crate) fn retriangulation<'a>(
    chain: &Chain,
    calibration: Option<&'a Calibration>,
) -> Result<Option<Retriangulation<'a>>, MeasureError> {
    let Some(calibration) = calibration.filter(|_| !chain.sets.is_empty()) else { return Ok(None) };
    let of_set = |set: &'_ PointSet| (set.indices.clone(), set.shape);
    let owned: Vec<(Vec<u32>, Shape)> = chain.sets.iter().map(of_set).collect();
    let sets: Vec<(&[u32], &Shape)> = owned.iter().map(|(indices, shape)| (&**indices, shape)).collect();
    let limit = (SYSTEMATIC_POINTS / sets.len()).max(MIN_SYSTEMATIC_POINTS);
    Ok(Some(Retriangulation::of_sets(chain.samples, &sets, limit, calibration)?))
}
