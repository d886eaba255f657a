//! Features fitted to the points of a cloud.

use optics::{PartFrame, Rigid};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::rims::contour::MAX_PARAMETERS as CONTOUR_PARAMETERS;
use crate::evaluation::rims::rim::{self, Rim};
use crate::evaluation::select::{Lines, candidates};
use crate::evaluation::values::{Primitive, align, geometries};
use crate::fitting::features::{FeatureFit, Search};
use crate::fitting::sample::Samples;
use crate::interface::request::MeasureError;
use crate::interface::shape::{MAX_PARAMETERS, Shape};
use crate::params::MIN_FEATURE_POINTS;
use crate::plan::document::Plan;
use crate::plan::feature::FeatureShape;

/// Parameters of the largest feature.
pub(crate) const MAX_FEATURE_PARAMETERS: usize = 5;
const _: () = assert!(MAX_PARAMETERS == MAX_FEATURE_PARAMETERS && CONTOUR_PARAMETERS == MAX_FEATURE_PARAMETERS);

/// A feature with the points it is based on.
pub(crate) enum Fitted {
    Surface(FeatureFit),
    Rim(Rim),
    /// Points to compare with a contour.
    Section(Vec<u32>),
    /// Constructed from other features.
    Derived,
}

/// The datum frame, or why there is none; `None` without an alignment.
pub(crate) type Alignment = Option<Result<Rigid<DatumFrame, PartFrame>, MeasureError>>;

/// Fits the features that the alignment depends on, aligns, and fits the others, selected in the datum frame.
pub(crate) fn fit_features(plan: &Plan, samples: &Samples) -> (Vec<Result<Fitted, MeasureError>>, Alignment) {
    let lines = Lines::new(samples);
    let of_alignment = plan.alignment.as_ref().map(|alignment| plan.with_dependencies(&alignment.datums()));
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

/// Fits surfaces in parallel, then the rims of planes.
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
                    surface(&mut search, &feature.shape, &candidates(lines, selection, pose))
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
                        rim::fit(lines.samples(), &mut rng(idx), &feature.shape, (plane_idx, found), &near)
                    }
                    Some(Err(error)) => {
                        Err(MeasureError::Missing { id: plane.clone(), reason: error.to_string() })
                    }
                    _ => Err(MeasureError::Missing { id: plane.clone(), reason: "it is not a plane".into() }),
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

/// Fits a surface to some of the points.
fn surface(search: &mut Search, shape: &FeatureShape, candidates: &[u32]) -> Result<Fitted, MeasureError> {
    let missing = |feature| MeasureError::FeatureNotFound { feature, n_points: candidates.len() };
    enough(candidates)?;
    let found = match shape {
        FeatureShape::Plane { .. } => search.plane("plane", candidates).ok_or(missing("plane"))?,
        FeatureShape::Sphere { radius_mm, .. } => {
            search.sphere("sphere", candidates, *radius_mm).ok_or(missing("sphere"))?
        }
        FeatureShape::Cylinder { radius_mm, .. } => {
            let mut found = search.cylinder("cylinder", candidates, *radius_mm).ok_or(missing("cylinder"))?;
            if let Shape::Cylinder { axis, .. } = &mut found.shape {
                // The sign of an axis is arbitrary: its largest component is positive.
                *axis *= axis[axis.iamax()].signum();
            }
            found
        }
        FeatureShape::Section { .. } => return Ok(Fitted::Section(candidates.to_vec())),
        _ => return Ok(Fitted::Derived),
    };
    Ok(Fitted::Surface(found))
}

fn enough(candidates: &[u32]) -> Result<(), MeasureError> {
    if candidates.len() < MIN_FEATURE_POINTS {
        return Err(MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: candidates.len() });
    }
    Ok(())
}
