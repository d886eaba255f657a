//! Comparison of a cloud with the nominal surface of its part.

use std::collections::HashSet;

use nalgebra::Vector3;
use optics::{Calibration, PartFrame, Rigid};
use rayon::prelude::*;
use scanning::Cloud;

use crate::cad::areas::Cells;
use crate::cad::best_fit::{self, FitPoint, best_fit};
use crate::cad::budget::{Budget, CommonErrors, ComparisonPose, budget, fit_point};
use crate::cad::cell_means::{ComparedPoint, cell_means, statistics, worst};
use crate::cad::comparison::{AlignTo, CompareRequest, Comparison};
use crate::cad::largest::largest;
use crate::cad::nominal::Nominal;
use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::datum_pose::datum_pose;
use crate::fitting::features::light_in_camera;
use crate::fitting::sample::{Samples, thinned};
use crate::interface::findings::Missing;
use crate::interface::part_verdict::PartVerdict;
use crate::interface::region::Region;
use crate::interface::request::MeasureError;
use crate::interface::verdict::Limits;
use crate::measuring::measure::verdict_if_proven;
use crate::measuring::missing::missing;
use crate::measuring::noise::redundancy;
use crate::params::{
    BEST_FIT_POINTS, CELL_POINTS, CELLS_PER_DIAGONAL, DEFAULT_CAPTURE_RELATIVE, DEFAULT_REACH_RELATIVE,
    MIN_COSINE, MIN_FEATURE_POINTS,
};

/// Points looked up in sequence, each starting at the facet nearest to its predecessor.
const CHUNK_POINTS: usize = 4096;

/// Compares a cloud with a nominal surface.
///
/// `calibration`: the one the scan was made with; without it no uncertainty is complete, and there is no verdict.
/// Errors absorbed by a best fit appear neither in the deviations nor in their uncertainty.
///
/// # Errors
/// [`MeasureError`].
pub fn compare(
    cloud: &Cloud,
    calibration: Option<&Calibration>,
    nominal: &Nominal,
    request: &CompareRequest,
) -> Result<Comparison, MeasureError> {
    let samples = Samples::from_cloud(cloud, request.region.as_ref(), calibration.and_then(light_in_camera));
    if samples.len() < MIN_FEATURE_POINTS {
        return Err(MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: samples.len() });
    }
    let reach_mm = request.reach_mm.unwrap_or(DEFAULT_REACH_RELATIVE * nominal.diagonal_mm);
    let capture_mm = request.capture_mm.unwrap_or(DEFAULT_CAPTURE_RELATIVE * nominal.diagonal_mm);
    let all = samples.indices();
    let datums = match &request.align {
        AlignTo::Surface { .. } => None,
        AlignTo::Datums(plan) | AlignTo::DatumsThenSurface(plan) => Some(datum_pose(plan, cloud, calibration)?),
    };
    let fit = match (&request.align, &datums) {
        (AlignTo::Datums(_), _) => None,
        (AlignTo::Surface { start }, _) => Some(*start),
        (AlignTo::DatumsThenSurface(_), datums) => datums.as_ref().map(|datums| datums.pose),
    };
    let redundancy = redundancy(&samples, &all);
    // A table around the part would leave it few of the points.
    let near = match fit.or(datums.as_ref().map(|datums| datums.pose)) {
        Some(pose) => near(&samples, nominal, &pose, capture_mm),
        None => all,
    };
    let few = thinned(&near, BEST_FIT_POINTS);
    let fit_points: Vec<FitPoint> = few.iter().map(|idx| fit_point(&samples, *idx)).collect();
    let fit = fit
        .map(|start| best_fit(nominal, &fit_points, &start, (capture_mm, reach_mm), request.tolerance_mm))
        .transpose()?;
    let pose = fit.as_ref().map(|fit| fit.pose).or(datums.as_ref().map(|datums| datums.pose));
    let pose = pose.unwrap_or_else(|| Rigid::new(nalgebra::Rotation3::identity(), Vector3::zeros()));

    let region = request.surface_region.as_ref();
    let mut compared = compared(&samples, nominal, &pose, reach_mm);
    compared.retain(|point| region.is_none_or(|region| region.contains(&point.at.cast())));
    if compared.is_empty() {
        return Err(MeasureError::NoOverlap { n_points: 0, reach_mm });
    }
    let mut cells = cells(nominal, &mut compared, region);
    let (middle, lever_mm) = best_fit::middle(&fit_points, &pose);
    let alignment = ComparisonPose { fit: fit.as_ref(), datums: datums.as_ref(), pose, middle, lever_mm };
    let shared = CommonErrors::new(&samples, nominal, calibration, &alignment, reach_mm)?;
    let of_pose = alignment.covariance(redundancy, few.len(), near.len());
    let budget = |point: &ComparedPoint| budget(&samples, nominal, &alignment, &shared, &of_pose, point);
    let budgets: Vec<Budget> = compared.par_iter().map(budget).collect();

    let cell_means = cell_means(&mut cells, &compared, &budgets, redundancy);
    let mut missing = missing(&samples, calibration, true);
    if shared.has_failed {
        missing.push(Missing::CalibrationModes);
    }
    let mut deviations_mm = vec![f32::NAN; cloud.points.len()];
    let mut u_mm = vec![f32::NAN; cloud.points.len()];
    for (point, budget) in compared.iter().zip(&budgets) {
        let idx = samples.cloud_idx(point.sample) as usize;
        (deviations_mm[idx], u_mm[idx]) = (point.deviation_mm, budget.noise_mm.hypot(budget.shared_mm));
    }
    let statistics = statistics(&cells, &compared, &cell_means, request.tolerance_mm, samples.len());
    let largest = largest(&cells, &cell_means);
    let verdict = request.tolerance_mm.map(|tolerance_mm| match &largest {
        Some(largest) => {
            let u_mm = largest.expanded_uncertainty_mm();
            let limits = Limits::symmetric(tolerance_mm);
            verdict_if_proven(largest.deviation_mm, &limits, u_mm, missing.is_empty()).into()
        }
        None => PartVerdict::Invalid,
    });
    let mut notes = Vec::new();
    if fit.is_some() {
        notes.push(
            "aligned by best fit to all points: errors absorbed by the alignment do not appear in the deviations"
                .to_owned(),
        );
    }
    let locked = fit.as_ref().map_or_else(Vec::new, |fit| fit.locked.clone());
    notes.extend(
        locked.iter().map(|freedom| format!("the points do not constrain {freedom}; it was left unchanged")),
    );
    notes.extend(missing.iter().map(|missing| format!("U is incomplete: it lacks {missing}")));
    Ok(Comparison {
        datum_from_part: pose,
        locked,
        fit_rms_mm: fit.as_ref().map(|fit| fit.rms_mm),
        worst: worst(&cell_means, cells.side_mm),
        largest,
        statistics,
        deviations_mm,
        u_mm,
        tolerance_mm: request.tolerance_mm,
        missing,
        verdict,
        notes,
    })
}

/// The points in the bounding box of the surface, enlarged by a margin.
fn near(samples: &Samples, nominal: &Nominal, pose: &Rigid<DatumFrame, PartFrame>, margin_mm: f64) -> Vec<u32> {
    let [low, high] = nominal.bounds_mm();
    let is_near = |idx: &u32| {
        let at = pose.rotation * samples.position(*idx) + pose.translation_mm;
        (0..3).all(|axis| (low[axis] - margin_mm..=high[axis] + margin_mm).contains(&at[axis]))
    };
    (0..samples.len() as u32).into_par_iter().filter(is_near).collect()
}

/// Cells of the surface, each with [`CELL_POINTS`] points on average of those that have any; assigns the points to them.
fn cells(nominal: &Nominal, compared: &mut [ComparedPoint], region: Option<&Region>) -> Cells {
    let mut assigned = |side_mm: f64| {
        let cells = Cells::new(nominal, side_mm, region);
        compared.par_iter_mut().for_each(|point| point.cell = cells.of(&point.at.cast()));
        let covered: HashSet<u32> = compared.iter().filter_map(|point| point.cell).collect();
        (cells, compared.len() as f64 / covered.len().max(1) as f64)
    };
    let (cells, n_per_cell) = assigned(nominal.diagonal_mm / CELLS_PER_DIAGONAL);
    if n_per_cell >= CELL_POINTS {
        return cells;
    }
    assigned(cells.side_mm * (CELL_POINTS / n_per_cell).sqrt()).0
}

/// All points with a nearest surface point within reach that is not on a free edge, in the order of the cloud.
fn compared(
    samples: &Samples,
    nominal: &Nominal,
    pose: &Rigid<DatumFrame, PartFrame>,
    reach_mm: f64,
) -> Vec<ComparedPoint> {
    let of_chunk = |chunk: usize| {
        let end = ((chunk + 1) * CHUNK_POINTS).min(samples.len());
        let mut guess = None;
        let mut compared = Vec::with_capacity(CHUNK_POINTS);
        for idx in (chunk * CHUNK_POINTS) as u32..end as u32 {
            let sample = samples.at(idx);
            let at = pose.rotation * sample.in_part.xyz + pose.translation_mm;
            let ray = pose.rotation * sample.ray;
            let Some(nearest) = nominal.nearest(&at, &ray, reach_mm * reach_mm, guess) else { continue };
            guess = Some(nearest.facet);
            let Some(normal) = nominal.normal(&nearest) else { continue };
            let way = at - nearest.at;
            compared.push(ComparedPoint {
                sample: idx,
                facet: nearest.facet,
                cell: None,
                deviation_mm: way.norm().copysign(normal.dot(&way)) as f32,
                cosine: ray.dot(&nominal.facets[nearest.facet as usize].normal).abs().max(MIN_COSINE) as f32,
                at: nearest.at.cast(),
            });
        }
        compared
    };
    let chunks: Vec<Vec<ComparedPoint>> =
        (0..samples.len().div_ceil(CHUNK_POINTS)).into_par_iter().map(of_chunk).collect();
    chunks.concat()
}
