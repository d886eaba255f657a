//! A whole plan on a cloud.

use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};
use optics::{Calibration, PartFrame, Rigid};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use scanning::Cloud;
use statistics::median;

use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::chain::{Chain, Set, SetUse, closure};
use crate::evaluation::fitted::{self, Fitted};
use crate::evaluation::judge;
use crate::evaluation::result::{CharacteristicResult, FeatureResult, PlanResult};
use crate::evaluation::select::{Lines, candidates};
use crate::evaluation::uncertainty::{self, Noise, Systematic};
use crate::evaluation::values::{AngleAxes, Primitive, State, align, band, form_residuals, geometries};
use crate::fitting::features::{Found, Search, light_in_camera};
use crate::fitting::fitness;
use crate::fitting::robust::SIGMA_PER_MAD;
use crate::fitting::sample::Samples;
use crate::interface::doubts::{Finding, Missing};
use crate::interface::part_verdict::{CharacteristicKey, PartVerdict, part_verdict};
use crate::interface::request::MeasureError;
use crate::interface::shape::Shape;
use crate::interface::verdict::Limits;
use crate::measuring::form::{Flatness, keep_form, without_noise};
use crate::measuring::measure;
use crate::measuring::systematic::Retriangulation;
use crate::measuring::temperature::wavelength_drift;
use crate::params::{FLATNESS_TRIM_SIGMAS, MIN_FEATURE_POINTS, MIN_SYSTEMATIC_POINTS, SYSTEMATIC_POINTS};
use crate::plan::characteristic::{Characteristic, Measure};
use crate::plan::document::Plan;
use crate::plan::feature::FeatureShape;

/// Measures all characteristics of a plan on a cloud, each with value, uncertainty and verdict.
///
/// `calibration`: the one the scan was made with; without it no uncertainty is complete, and no verdict is reached.
/// What cannot be found or measured is said in its place and keeps the others from nothing.
/// Same arguments, same result, whatever the number of threads.
///
/// # Errors
/// [`MeasureError::CalibrationMismatch`], and [`MeasureError::TooFewPoints`] for a cloud of next to nothing.
pub fn evaluate(
    plan: &Plan,
    cloud: &Cloud,
    calibration: Option<&Calibration>,
) -> Result<PlanResult, MeasureError> {
    let samples = Samples::from_cloud(cloud, None, calibration.and_then(light_in_camera));
    if samples.len() < MIN_FEATURE_POINTS {
        return Err(MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: samples.len() });
    }
    let (fitted, alignment) = fit_features(plan, &samples);
    let mut chain = Chain::new(plan, &samples, fitted);
    let (forms, form_points) = forms(&chain);
    chain.sets = sets(&chain, &forms);
    let retriangulation = retriangulation(&chain, calibration)?;
    let base = chain.state(&chain.primitives(), form_points);
    chain.angles = plan
        .characteristics
        .iter()
        .map(|characteristic| {
            let nominal = characteristic.nominal_deg;
            AngleAxes::of(plan, &characteristic.measure, &base, nominal)
        })
        .collect();
    let noise = uncertainty::noise(&chain, retriangulation.as_ref());
    let by_noise = uncertainty::by_noise(&chain, &base, &noise);
    let by_modes = retriangulation.as_ref().map(|retriangulation| uncertainty::by_modes(&chain, retriangulation));
    let components = chain.components(&base, |_| true);
    let features: Vec<FeatureResult> =
        (0..plan.features.len()).into_par_iter().map(|idx| feature_result(&chain, &base, &noise, idx)).collect();
    let judge = Judge { chain: &chain, base: &base, forms: &forms, features: &features, calibration };
    let characteristics: Vec<CharacteristicResult> = (0..plan.characteristics.len())
        .map(|idx| judge.characteristic(idx, components[idx].as_ref(), &by_noise[idx], by_modes.as_ref()))
        .collect();
    Ok(PlanResult {
        verdict: verdict_of(plan, &characteristics),
        features,
        datum_from_part: base.datum_from_part,
        alignment_failure: alignment.and_then(Result::err),
        characteristics,
    })
}

/// The datum frame of a plan, and how it follows the calibration and the noise.
pub(crate) struct DatumPose {
    pub(crate) pose: Rigid<DatumFrame, PartFrame>,
    /// With every mode of the calibration, in the order of [`Retriangulation::variants`], to either side of `as_seen`.
    variants: Vec<[Option<Rigid<DatumFrame, PartFrame>>; 2]>,
    as_seen: Option<Rigid<DatumFrame, PartFrame>>,
    /// One σ of every independent share of the noise: the pose it leads to.
    by_noise: Vec<Rigid<DatumFrame, PartFrame>>,
}

impl DatumPose {
    /// What a mode does to the pose, as a motion about `middle`; `None` if it gave none.
    pub(crate) fn step(
        &self,
        mode: usize,
        side: usize,
        middle: &Vector3<f64>,
        lever_mm: f64,
    ) -> Option<Vector6<f64>> {
        motion(&self.as_seen?, &(*self.variants.get(mode)?.get(side)?)?, middle, lever_mm)
    }

    /// Covariance of the pose from the noise, as motions about `middle`.
    pub(crate) fn covariance(&self, middle: &Vector3<f64>, lever_mm: f64) -> Matrix6<f64> {
        let steps = self.by_noise.iter().filter_map(|moved| motion(&self.pose, moved, middle, lever_mm));
        steps.map(|step| step * step.transpose()).sum()
    }
}

/// The motion that takes what a pose puts at `middle` to where another puts it: shift, and turn at `lever_mm`.
fn motion<T>(
    from: &Rigid<T, PartFrame>,
    to: &Rigid<T, PartFrame>,
    middle: &Vector3<f64>,
    lever_mm: f64,
) -> Option<Vector6<f64>> {
    let in_part = from.rotation.inverse() * (middle - from.translation_mm);
    let shift = to.rotation * in_part + to.translation_mm - middle;
    // By the quaternion: the angle of a matrix is the arc cosine of its trace, which rounding puts beyond one.
    let turn = UnitQuaternion::from_rotation_matrix(&(to.rotation * from.rotation.inverse()));
    let turn = turn.scaled_axis() * lever_mm;
    Some(Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z))
        .filter(|step| step.iter().all(|x| x.is_finite()))
}

/// The datum frame of a plan on a cloud.
///
/// # Errors
/// As [`evaluate`], and what keeps the alignment from being made.
pub(crate) fn datum_pose(
    plan: &Plan,
    cloud: &Cloud,
    calibration: Option<&Calibration>,
) -> Result<DatumPose, MeasureError> {
    let of_alignment =
        closure(plan, &plan.alignment.as_ref().map_or(Vec::new(), |alignment| alignment.datums().into()));
    let mut features = plan.features.clone();
    let mut keep = of_alignment.iter();
    features.retain(|_| keep.next().copied().unwrap_or(false));
    let plan = Plan { features, characteristics: Vec::new(), ..plan.clone() };
    let samples = Samples::from_cloud(cloud, None, calibration.and_then(light_in_camera));
    let (fitted, alignment) = fit_features(&plan, &samples);
    let pose = alignment.unwrap_or(Err(MeasureError::NotDetermined { what: "datum frame" }))?;
    let mut chain = Chain::new(&plan, &samples, fitted);
    chain.sets = sets(&chain, &[]);
    let retriangulation = retriangulation(&chain, calibration)?;
    let (as_seen, variants) = match &retriangulation {
        None => (None, Vec::new()),
        Some(retriangulation) => uncertainty::pose_by_modes(&chain, retriangulation),
    };
    let noise = uncertainty::noise(&chain, retriangulation.as_ref());
    Ok(DatumPose { pose, variants, as_seen, by_noise: uncertainty::pose_by_noise(&chain, &noise) })
}

/// The verdict on the part; a characteristic with limits that has none would make it invalid.
fn verdict_of(plan: &Plan, characteristics: &[CharacteristicResult]) -> PartVerdict {
    let required: Vec<CharacteristicKey<'_>> = plan
        .characteristics
        .iter()
        .filter(|c| c.lower.is_some() || c.upper.is_some())
        .map(|c| CharacteristicKey { tool: c.measure.name(), name: Some(&c.id) })
        .collect();
    let judged =
        characteristics.iter().map(|c| (CharacteristicKey { tool: c.measure, name: Some(&c.id) }, c.verdict));
    part_verdict(judged, &required).unwrap_or(PartVerdict::Invalid)
}

type Alignment = Option<Result<Rigid<DatumFrame, PartFrame>, MeasureError>>;

/// Fits the features the alignment rests on, aligns, and fits the others where the datum frame says.
fn fit_features(plan: &Plan, samples: &Samples) -> (Vec<Result<Fitted, MeasureError>>, Alignment) {
    let lines = Lines::new(samples);
    let of_alignment = plan.alignment.as_ref().map(|alignment| closure(plan, &alignment.datums()));
    let is_first = |idx: usize| of_alignment.as_ref().is_none_or(|closure| closure[idx]);
    let mut fitted: Vec<Option<Result<Fitted, MeasureError>>> = plan.features.iter().map(|_| None).collect();
    fit_some(plan, &lines, &mut fitted, is_first, None);
    let alignment = of_alignment.is_some().then(|| {
        let so_far: Vec<Result<Fitted, MeasureError>> =
            fitted.iter_mut().map(|f| f.take().unwrap_or(Ok(Fitted::Derived))).collect();
        let primitives: Vec<Primitive> = so_far
            .iter()
            .map(|fitted| match fitted {
                Ok(Fitted::Surface(found)) => Primitive::Shape(found.shape),
                Ok(Fitted::Rim(rim)) => Primitive::Contour(rim.contour),
                _ => Primitive::None,
            })
            .collect();
        let pose = align(plan, &geometries(plan, &so_far, &primitives));
        for (idx, result) in so_far.into_iter().enumerate() {
            if is_first(idx) {
                fitted[idx] = Some(result);
            }
        }
        pose
    });
    let alignment = alignment.flatten();
    match &alignment {
        Some(Ok(pose)) => fit_some(plan, &lines, &mut fitted, |idx| !is_first(idx), Some(pose)),
        Some(Err(error)) => {
            let failure = || MeasureError::Missing { id: "alignment".into(), reason: error.to_string() };
            fitted.iter_mut().filter(|fitted| fitted.is_none()).for_each(|fitted| *fitted = Some(Err(failure())));
        }
        None => {}
    }
    (fitted.into_iter().map(|fitted| fitted.unwrap_or(Ok(Fitted::Derived))).collect(), alignment)
}

/// Fits surfaces, each by a task of its own, then the rims of planes.
fn fit_some(
    plan: &Plan,
    lines: &Lines,
    fitted: &mut [Option<Result<Fitted, MeasureError>>],
    is_wanted: impl Fn(usize) -> bool + Sync,
    pose: Option<&Rigid<DatumFrame, PartFrame>>,
) {
    let rng = |idx: usize| Pcg64Mcg::seed_from_u64(plan.seed.wrapping_add(idx as u64));
    let surfaces: Vec<Option<Result<Fitted, MeasureError>>> = plan
        .features
        .par_iter()
        .enumerate()
        .map(|(idx, feature)| {
            let is_rim = matches!(
                feature.shape,
                FeatureShape::Circle { .. } | FeatureShape::Slot { .. } | FeatureShape::Edge { .. }
            );
            (is_wanted(idx) && !is_rim).then(|| match feature.shape.selection() {
                Some(selection) => {
                    let mut search = Search { samples: lines.samples(), rng: rng(idx) };
                    fitted::surface(&mut search, &feature.shape, &candidates(lines, selection, pose))
                }
                None => Ok(Fitted::Derived),
            })
        })
        .collect();
    for (slot, surface) in fitted.iter_mut().zip(surfaces) {
        if surface.is_some() {
            *slot = surface;
        }
    }
    let planes = &*fitted;
    let rims: Vec<Option<Result<Fitted, MeasureError>>> = plan
        .features
        .par_iter()
        .enumerate()
        .map(|(idx, feature)| {
            let (FeatureShape::Circle { plane, select }
            | FeatureShape::Slot { plane, select }
            | FeatureShape::Edge { plane, select }) = &feature.shape
            else {
                return None;
            };
            is_wanted(idx).then(|| {
                let plane_idx = plan.feature_idx(plane).unwrap_or(idx);
                match &planes[plane_idx] {
                    Some(Ok(Fitted::Surface(found))) => {
                        let near = candidates(lines, select, pose);
                        fitted::rim(lines.samples(), &mut rng(idx), &feature.shape, (plane_idx, found), &near)
                    }
                    Some(Err(error)) => {
                        Err(MeasureError::Missing { id: plane.clone(), reason: error.to_string() })
                    }
                    _ => Err(MeasureError::Missing { id: plane.clone(), reason: "it is no plane".into() }),
                }
            })
        })
        .collect();
    for (slot, rim) in fitted.iter_mut().zip(rims) {
        if rim.is_some() {
            *slot = rim;
        }
    }
}

/// The points on which the form of a feature is seen.
struct Form {
    characteristic: usize,
    feature: usize,
    /// Points and, of a flatness, their least-squares plane.
    inliers: Vec<u32>,
    shape: Shape,
}

/// The forms a plan asks for, and some of the points of each feature whose form is asked for.
fn forms(chain: &Chain) -> (Vec<Form>, Vec<Vec<Vector3<f64>>>) {
    let state = chain.state(&chain.primitives(), Vec::new());
    let mut forms = Vec::new();
    let mut points: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); chain.fitted.len()];
    for (idx, characteristic) in chain.plan.characteristics.iter().enumerate() {
        let measure = &characteristic.measure;
        if !measure.is_deviation() || matches!(measure, Measure::Position { .. }) {
            continue;
        }
        let Some(feature) = chain.plan.feature_idx(measure.features()[0]) else { continue };
        let form = match &chain.fitted[feature] {
            Ok(Fitted::Surface(found)) => {
                let mut plane: Found = found.clone();
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
            let few = crate::fitting::sample::thinned(&form.inliers, FORM_POINTS);
            points[feature] = few.iter().map(|idx| chain.samples.position(*idx)).collect();
            forms.push(form);
        }
    }
    (forms, points)
}

/// Points of a form that follow a small change of its features.
const FORM_POINTS: usize = 2000;

/// Points of a section that belong to its contour, and a plane along them.
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

/// The points triangulated anew for every mode of the calibration.
fn sets(chain: &Chain, forms: &[Form]) -> Vec<Set> {
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
        sets.push(Set { feature, what: SetUse::Fit, indices, shape, counts_alike: is_flatness(feature) });
    }
    for form in forms {
        if sets.iter().all(|set: &Set| set.feature != form.feature || set.what != SetUse::Form) {
            let (indices, shape) = (form.inliers.clone(), form.shape);
            sets.push(Set { feature: form.feature, what: SetUse::Form, indices, shape, counts_alike: true });
        }
    }
    sets
}

fn retriangulation<'a>(
    chain: &Chain,
    calibration: Option<&'a Calibration>,
) -> Result<Option<Retriangulation<'a>>, MeasureError> {
    let Some(calibration) = calibration.filter(|_| !chain.sets.is_empty()) else { return Ok(None) };
    let of_set = |set: &'_ Set| (set.indices.clone(), set.shape);
    let owned: Vec<(Vec<u32>, Shape)> = chain.sets.iter().map(of_set).collect();
    let sets: Vec<(&[u32], &Shape)> = owned.iter().map(|(indices, shape)| (&**indices, shape)).collect();
    let limit = (SYSTEMATIC_POINTS / sets.len()).max(MIN_SYSTEMATIC_POINTS);
    Ok(Some(Retriangulation::of_sets(chain.samples, &sets, limit, calibration)?))
}

fn feature_result(chain: &Chain, base: &State, noise: &Noise, idx: usize) -> FeatureResult {
    let (feature, samples) = (&chain.plan.features[idx], chain.samples);
    let mut result = FeatureResult {
        id: feature.id.clone(),
        kind: feature.shape.name(),
        geometry: base.geometries[idx].map(|geometry| match &base.datum_from_part {
            Some(pose) => geometry.moved(pose),
            None => geometry,
        }),
        n_points: 0,
        n_left_out: 0,
        rms_mm: None,
        cloud_indices: Vec::new(),
        findings: Vec::new(),
        failure: None,
    };
    match &chain.fitted[idx] {
        Ok(Fitted::Surface(found)) => {
            let fitted = measure::fitted(samples, found);
            result.findings = fitness::findings(
                samples,
                std::slice::from_ref(found),
                std::slice::from_ref(&fitted),
                &noise.expected_mm[idx..=idx],
            );
            (result.n_points, result.n_left_out) = (fitted.n_points, fitted.n_outliers + fitted.n_border);
            result.rms_mm = Some(fitted.rms_mm);
            result.cloud_indices = fitted.cloud_indices;
        }
        Ok(Fitted::Rim(rim)) => {
            (result.n_points, result.n_left_out) = (rim.crossings.len(), rim.n_left_out);
            result.rms_mm = Some(rim.rms_mm);
            result.cloud_indices = rim.crossings.iter().map(|c| samples.cloud_idx(c.sample_idx)).collect();
            result.findings = rim.misfit(samples, feature.shape.name()).into_iter().collect();
        }
        Ok(Fitted::Section(indices)) => {
            result.n_points = indices.len();
            result.cloud_indices = indices.iter().map(|idx| samples.cloud_idx(*idx)).collect();
        }
        Ok(Fitted::Derived) if result.geometry.is_none() => {
            result.failure = Some(
                missing_below(chain, feature.shape.rests_on())
                    .unwrap_or(MeasureError::NotDetermined { what: result.kind }),
            );
        }
        Ok(Fitted::Derived) => {}
        Err(error) => result.failure = Some(error.clone()),
    }
    result
}

/// The first of some features that failed.
fn missing_below(chain: &Chain, ids: Vec<&str>) -> Option<MeasureError> {
    ids.into_iter().find_map(|id| {
        let error = chain.fitted[chain.plan.feature_idx(id)?].as_ref().err()?;
        Some(MeasureError::Missing { id: id.to_owned(), reason: error.to_string() })
    })
}

struct Judge<'a> {
    chain: &'a Chain<'a>,
    base: &'a State,
    forms: &'a [Form],
    features: &'a [FeatureResult],
    calibration: Option<&'a Calibration>,
}

impl Judge<'_> {
    fn characteristic(
        &self,
        idx: usize,
        components: Option<&Vector3<f64>>,
        noise: &nalgebra::Matrix3<f64>,
        modes: Option<&Systematic>,
    ) -> CharacteristicResult {
        let Characteristic { id, measure, nominal_mm, nominal_deg, lower, upper, attributes } =
            &self.chain.plan.characteristics[idx];
        let form = self.form(idx);
        let has_form = !measure.is_deviation() || matches!(measure, Measure::Position { .. }) || form.is_some();
        let angle = self.chain.angles[idx].as_ref();
        let systematic = modes.map(|modes| &modes.covariances[idx]);
        let judged = components
            .filter(|_| has_form)
            .map(|components| judge::value(measure, components, (noise, systematic), angle, form.as_ref()));
        let nominal = nominal_mm.or(*nominal_deg).or(measure.is_deviation().then_some(0.0));
        let error = judged.as_ref().zip(nominal).map(|(judged, nominal)| judged.value - nominal);
        let limits = Limits { lower: *lower, upper: *upper };
        let missing = self.missing(idx, modes);
        let findings = self.findings(idx);
        let is_proven = missing.is_empty() && findings.is_empty();
        let u = judged.as_ref().map(judge::Judged::expanded_uncertainty);
        let mut notes = judged.as_ref().map_or_else(Vec::new, |judged| judged.notes.clone());
        notes.extend(missing.iter().map(|missing| format!("U is incomplete: it lacks {missing}")));
        notes.extend(findings.iter().map(|(id, finding)| format!("{id}: {finding}")));
        CharacteristicResult {
            id: id.clone(),
            measure: measure.name(),
            unit: measure.unit(),
            value: judged.as_ref().map(|judged| judged.value),
            components: components
                .filter(|_| matches!(measure, Measure::Position { .. } | Measure::Angle { about: None, .. }))
                .map(|components| (*components).into()),
            nominal,
            limits,
            error,
            u_noise: judged.as_ref().map(|judged| judged.u_noise),
            u_systematic: judged.as_ref().and_then(|judged| judged.u_systematic),
            expanded_uncertainty: u,
            verdict: judge::verdict(error.zip(u), &limits, is_proven),
            failure: judged.is_none().then(|| self.failure(idx)),
            missing,
            findings,
            notes,
            attributes: attributes.clone(),
        }
    }

    /// The form of a characteristic without the noise.
    fn form(&self, idx: usize) -> Option<Flatness> {
        let form = self.forms.iter().find(|form| form.characteristic == idx)?;
        let measure = &self.chain.plan.characteristics[idx].measure;
        let samples = self.chain.samples;
        let positions: Vec<Vector3<f64>> = form.inliers.iter().map(|idx| samples.position(*idx)).collect();
        let residuals = match measure {
            // About the least-squares plane of all of them.
            Measure::Flatness { .. } => positions.iter().map(|at| form.shape.distance_mm(at)).collect(),
            _ => form_residuals(self.chain.plan, measure, self.base, &positions)?,
        };
        Some(without_noise(samples, &form.inliers, &residuals, |residuals| band(measure, residuals)))
    }

    fn failure(&self, idx: usize) -> MeasureError {
        let measure = &self.chain.plan.characteristics[idx].measure;
        let of_features =
            (0..self.features.len()).filter(|feature| self.chain.rests_on(idx, *feature)).find_map(|feature| {
                let reason = self.features[feature].failure.as_ref()?.to_string();
                Some(MeasureError::Missing { id: self.features[feature].id.clone(), reason })
            });
        of_features.unwrap_or(MeasureError::NotDetermined { what: measure.name() })
    }

    fn findings(&self, idx: usize) -> Vec<(String, Finding)> {
        let resting = self.features.iter().enumerate().filter(|(feature, _)| self.chain.rests_on(idx, *feature));
        resting.flat_map(|(_, feature)| feature.findings.iter().map(|f| (feature.id.clone(), f.clone()))).collect()
    }

    /// What U should hold and does not (table of parts in `docs/maths/metrology.md`).
    fn missing(&self, idx: usize, modes: Option<&Systematic>) -> Vec<Missing> {
        let (chain, calibration) = (self.chain, self.calibration);
        let measure = &chain.plan.characteristics[idx].measure;
        let of =
            |feature: usize| chain.rests_on(idx, feature).then(|| chain.fitted[feature].as_ref().ok()).flatten();
        let resting = || (0..chain.fitted.len()).filter_map(of);
        let stage = calibration.and_then(|calibration| calibration.stage);
        let turntable = stage.and_then(|stage| stage.rotary());
        let straightness = stage.and_then(|stage| stage.linear()?.straightness);
        let parts = [
            (!chain.samples.sigma_known, Missing::PointNoise),
            (calibration.is_none(), Missing::Calibration),
            (chain.samples.stage.is_none(), Missing::StagePositions),
            (chain.samples.line_sigma_mm.is_none(), Missing::LineThickness),
            (calibration.is_some_and(|c| wavelength_drift(c).is_none()), Missing::Wavelength),
            (modes.is_some_and(|modes| modes.has_failed[idx]), Missing::CalibrationModes),
            (
                measure.is_between_places()
                    && turntable.is_none()
                    && straightness.is_none()
                    && calibration.is_some(),
                Missing::StageStraightness,
            ),
            (turntable.is_some_and(|axis| axis.angle_error.is_none()), Missing::StageAngle),
            (
                resting().any(|fitted| matches!(fitted, Fitted::Rim(rim) if rim.threshold_mm.is_none())),
                Missing::EdgeThreshold,
            ),
        ];
        parts.into_iter().filter(|(is_missing, _)| *is_missing).map(|(_, part)| part).collect()
    }
}
