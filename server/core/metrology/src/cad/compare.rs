//! A cloud against the surface its part should have.

use std::borrow::Cow;

use nalgebra::{Matrix6, Vector3, Vector6};
use optics::{Calibration, PartFrame, Rigid};
use rayon::prelude::*;
use remedy::Remedy;
use scanning::Cloud;

use crate::cad::areas::Cells;
use crate::cad::best_fit::{self, BestFit, FitPoint, Row, best_fit, slopes};
use crate::cad::nominal::Nominal;
use crate::cad::statistics::{DeviationStatistics, WorstPlace, weighted};
use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::datum_pose::{DatumPose, datum_pose};
use crate::fitting::features::light_in_camera;
use crate::fitting::sample::{Samples, thinned};
use crate::interface::doubts::Missing;
use crate::interface::part_verdict::PartVerdict;
use crate::interface::region::Region;
use crate::interface::request::MeasureError;
use crate::interface::shape::Shape;
use crate::interface::verdict::Limits;
use crate::measuring::measure::judged;
use crate::measuring::noise::redundancy;
use crate::measuring::systematic::Retriangulation;
use crate::measuring::temperature::wavelength_drift;
use crate::params::{
    BEST_FIT_POINTS, CELLS_PER_DIAGONAL, COMPARED_SYSTEMATIC_POINTS, COVERAGE_FACTOR, FOOTPRINT_SHARE,
    MIN_CELL_POINTS, MIN_COSINE, MIN_FEATURE_POINTS, USUAL_CAPTURE_SHARE, USUAL_REACH_SHARE, WORST_PLACE_CELLS,
    WORST_PLACES,
};
use crate::plan::document::Plan;

/// Points looked up one after the other, each from where its neighbour was nearest.
const CHUNK_POINTS: usize = 4096;

/// How a scan is brought to the frame of its nominal surface.
#[derive(Debug, Clone, PartialEq)]
pub enum AlignTo {
    /// By all of its points, from a pose that is near.
    Surface {
        /// The first pose.
        start: Rigid<DatumFrame, PartFrame>,
    },
    /// By the datums of a plan, in whose frame the surface is drawn.
    Datums(Box<Plan>),
    /// By the datums, then by all points.
    DatumsThenSurface(Box<Plan>),
}

/// How a cloud is compared.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareRequest {
    /// The alignment.
    pub align: AlignTo,
    /// Largest permitted deviation to either side, mm; asks for a verdict.
    pub tolerance_mm: Option<f64>,
    /// Points further from the surface do not belong to it, mm; 2 % of its diagonal if absent.
    pub reach_mm: Option<f64>,
    /// How far a best fit may start from the surface, mm; 6 % of its diagonal if absent.
    pub capture_mm: Option<f64>,
    /// Points outside (part frame) are not looked at.
    pub region: Option<Region>,
}

/// What a comparison says.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The pose.
    pub datum_from_part: Rigid<DatumFrame, PartFrame>,
    /// Freedoms that a best fit could not hold and left as they were, in words.
    pub locked: Vec<String>,
    /// RMS of the points of a best fit, mm.
    pub fit_rms_mm: Option<f64>,
    /// Deviations by area.
    pub statistics: DeviationStatistics,
    /// The places that are furthest off, worst first.
    pub worst: Vec<WorstPlace>,
    /// Signed distance of every point of the cloud, mm: positive outside; NaN where there is nothing to compare with.
    pub deviations_mm: Vec<f32>,
    /// Its standard uncertainty, mm.
    pub u_mm: Vec<f32>,
    /// The tolerance asked for.
    pub tolerance_mm: Option<f64>,
    /// What the uncertainty should hold and does not.
    pub missing: Vec<Missing>,
    /// The verdict on the covered surface, if there is a tolerance.
    pub verdict: Option<PartVerdict>,
    /// What a reader must know, in sentences.
    pub notes: Vec<String>,
}

/// A comparison could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// The scan is somewhere else.
    #[error("{n_points} points lie within {reach_mm:.2} mm of the surface")]
    NoOverlap {
        /// Points within reach.
        n_points: usize,
        /// The reach.
        reach_mm: f64,
    },
    /// The fit wandered.
    #[error("the best fit did not come to rest")]
    NotConverged,
    /// The datums or the cloud.
    #[error(transparent)]
    Measure(#[from] MeasureError),
}

impl Remedy for CompareError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::NoOverlap { .. } => Some("give a start pose nearer to the part, or align by datums".into()),
            Self::NotConverged => Some("align by datums, or give a start pose nearer to the part".into()),
            Self::Measure(error) => error.remedy(),
        }
    }
}

/// A point on the surface.
#[derive(Clone, Copy)]
struct Compared {
    sample: u32,
    facet: u32,
    /// Its cell, if the surface has one there.
    cell: Option<u32>,
    deviation_mm: f32,
    /// Share of an error along the ray that is along the normal.
    cosine: f32,
    at: Vector3<f32>,
}

/// Compares a cloud with a nominal surface.
///
/// `calibration`: the one the scan was made with; without it no uncertainty is complete, and no verdict is reached.
/// What a best fit has taken up cannot be seen any more, neither in the deviations nor in their uncertainty.
///
/// # Errors
/// [`CompareError`].
pub fn compare(
    cloud: &Cloud,
    calibration: Option<&Calibration>,
    nominal: &Nominal,
    request: &CompareRequest,
) -> Result<Comparison, CompareError> {
    let samples = Samples::from_cloud(cloud, request.region.as_ref(), calibration.and_then(light_in_camera));
    if samples.len() < MIN_FEATURE_POINTS {
        let error = MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: samples.len() };
        return Err(error.into());
    }
    let reach_mm = request.reach_mm.unwrap_or(USUAL_REACH_SHARE * nominal.diagonal_mm);
    let capture_mm = request.capture_mm.unwrap_or(USUAL_CAPTURE_SHARE * nominal.diagonal_mm);
    let all = samples.indices();
    let (few, redundancy) = (thinned(&all, BEST_FIT_POINTS), redundancy(&samples, &all));
    let fit_points: Vec<FitPoint> = few.iter().map(|idx| fit_point(&samples, *idx)).collect();
    let datums = match &request.align {
        AlignTo::Surface { .. } => None,
        AlignTo::Datums(plan) | AlignTo::DatumsThenSurface(plan) => Some(datum_pose(plan, cloud, calibration)?),
    };
    let fit = match (&request.align, &datums) {
        (AlignTo::Datums(_), _) => None,
        (AlignTo::Surface { start }, _) => Some(*start),
        (AlignTo::DatumsThenSurface(_), datums) => datums.as_ref().map(|datums| datums.pose),
    };
    let fit = fit
        .map(|start| best_fit(nominal, &fit_points, &start, (capture_mm, reach_mm), request.tolerance_mm))
        .transpose()?;
    let pose = fit.as_ref().map(|fit| fit.pose).or(datums.as_ref().map(|datums| datums.pose));
    let pose = pose.unwrap_or_else(|| Rigid::new(nalgebra::Rotation3::identity(), Vector3::zeros()));

    let mut cells = Cells::new(nominal, nominal.diagonal_mm / CELLS_PER_DIAGONAL);
    let compared = compared(&samples, nominal, &cells, &pose, reach_mm);
    if compared.is_empty() {
        return Err(CompareError::NoOverlap { n_points: 0, reach_mm });
    }
    let (middle, lever_mm) = best_fit::middle(&fit_points, &pose);
    let motion = Motion { fit: fit.as_ref(), datums: datums.as_ref(), pose, middle, lever_mm };
    let shared = Shared::new(&samples, nominal, calibration, &motion, reach_mm)?;
    let of_pose = motion.covariance(redundancy, few.len(), all.len());
    let budget = |point: &Compared| budget(&samples, nominal, &motion, &shared, &of_pose, point);
    let budgets: Vec<Budget> = compared.par_iter().map(budget).collect();

    let places = places(&mut cells, &compared, &budgets, redundancy);
    let missing = missing(&samples, calibration, &shared);
    let mut deviations_mm = vec![f32::NAN; cloud.points.len()];
    let mut u_mm = vec![f32::NAN; cloud.points.len()];
    for (point, budget) in compared.iter().zip(&budgets) {
        let idx = samples.cloud_idx(point.sample) as usize;
        (deviations_mm[idx], u_mm[idx]) = (point.deviation_mm, budget.noise_mm.hypot(budget.shared_mm));
    }
    let statistics = statistics(nominal, &cells, &compared, &places, request.tolerance_mm, samples.len());
    let verdict = request.tolerance_mm.map(|tolerance_mm| verdict(&places, tolerance_mm, missing.is_empty()));
    let mut notes = Vec::new();
    if fit.is_some() {
        notes.push(
            "aligned by all points: what a best fit has taken up does not show in the deviations".to_owned(),
        );
    }
    let locked = fit.as_ref().map_or_else(Vec::new, |fit| fit.locked.clone());
    notes.extend(locked.iter().map(|freedom| format!("the points do not hold {freedom}; it was left as it was")));
    notes.extend(missing.iter().map(|missing| format!("U is incomplete: it lacks {missing}")));
    Ok(Comparison {
        datum_from_part: pose,
        locked,
        fit_rms_mm: fit.as_ref().map(|fit| fit.rms_mm),
        worst: worst(&places, cells.side_mm),
        statistics,
        deviations_mm,
        u_mm,
        tolerance_mm: request.tolerance_mm,
        missing,
        verdict,
        notes,
    })
}

fn fit_point(samples: &Samples, idx: u32) -> FitPoint {
    let sample = samples.at(idx);
    FitPoint { at: sample.in_part.xyz, ray: sample.ray, sigma_mm: sample.sigma_mm }
}

/// All points with a place within reach that is not on a free edge, in the order of the cloud.
fn compared(
    samples: &Samples,
    nominal: &Nominal,
    cells: &Cells,
    pose: &Rigid<DatumFrame, PartFrame>,
    reach_mm: f64,
) -> Vec<Compared> {
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
            compared.push(Compared {
                sample: idx,
                facet: nearest.facet,
                cell: cells.of(&nearest.at),
                deviation_mm: way.norm().copysign(normal.dot(&way)) as f32,
                cosine: ray.dot(&nominal.facets[nearest.facet as usize].normal).abs().max(MIN_COSINE) as f32,
                at: nearest.at.cast(),
            });
        }
        compared
    };
    let chunks: Vec<Vec<Compared>> =
        (0..samples.len().div_ceil(CHUNK_POINTS)).into_par_iter().map(of_chunk).collect();
    chunks.concat()
}

/// The pose, and how it follows the calibration and the noise.
struct Motion<'a> {
    fit: Option<&'a BestFit>,
    datums: Option<&'a DatumPose>,
    pose: Rigid<DatumFrame, PartFrame>,
    middle: Vector3<f64>,
    lever_mm: f64,
}

impl Motion<'_> {
    /// Covariance of the pose from the noise of all points (eq. 15).
    fn covariance(&self, redundancy: f64, n_few: usize, n_all: usize) -> Matrix6<f64> {
        match (self.fit, self.datums) {
            (Some(fit), _) => fit.inverse * (redundancy * fit.ratio * fit.ratio * n_few as f64 / n_all as f64),
            (None, Some(datums)) => datums.covariance(&self.middle, self.lever_mm),
            (None, None) => Matrix6::zeros(),
        }
    }
}

/// What all points share, at some of them.
struct Shared {
    /// By order, the samples with their share along the normal (mm) and what the calibration adds to σ along the ray (mm).
    by_order: std::collections::BTreeMap<i8, Vec<(u32, f32, f32)>>,
    is_known: bool,
    has_failed: bool,
}

impl Shared {
    fn new(
        samples: &Samples,
        nominal: &Nominal,
        calibration: Option<&Calibration>,
        motion: &Motion,
        reach_mm: f64,
    ) -> Result<Self, CompareError> {
        let mut shared = Self { by_order: std::collections::BTreeMap::new(), is_known: false, has_failed: false };
        let Some(calibration) = calibration else { return Ok(shared) };
        let few = thinned(&samples.indices(), COMPARED_SYSTEMATIC_POINTS);
        // Only weights would need the surface, and they are not used.
        let facing = Shape::Plane { point_mm: Vector3::zeros(), normal: Vector3::z() };
        let seen = Retriangulation::of_sets(samples, &[(&few, &facing)], COMPARED_SYSTEMATIC_POINTS, calibration)?;
        let pixels = seen.pixels(0);
        let fit_points: Vec<FitPoint> = pixels.iter().map(|pixel| fit_point(samples, pixel.sample_idx)).collect();
        let rows = best_fit::rows(nominal, &fit_points, &motion.pose, (&motion.middle, motion.lever_mm), reach_mm);
        let positions = |calibration: &Calibration| -> Vec<Option<Vector3<f64>>> {
            pixels.iter().map(|pixel| seen.part_position(calibration, pixel)).collect()
        };
        let base = positions(calibration);
        let mut squares = vec![0.0; rows.len()];
        // The points of the modes are some of those of the fit: the same equations, fewer rows.
        let inverse = motion.fit.map(|fit| {
            let hessian = best_fit::normal_equations(&rows).0;
            let held = fit.inverse.symmetric_eigen();
            let basis: Vec<Vector6<f64>> = (0..6)
                .filter(|k| held.eigenvalues[*k] > 1e-9 * held.eigenvalues.max())
                .map(|k| held.eigenvectors.column(k).into_owned())
                .collect();
            restricted_inverse(&hessian, &basis)
        });
        for (mode, pair) in seen.variants().iter().enumerate() {
            for (side, variant) in pair.iter().enumerate() {
                let along: Vec<Option<f64>> = positions(variant)
                    .iter()
                    .zip(&base)
                    .zip(&rows)
                    .map(|((moved, base), row)| {
                        let way = motion.pose.rotation * ((*moved)? - (*base)?);
                        Some(row.as_ref()?.normal.dot(&way))
                    })
                    .collect();
                let step = match (&inverse, motion.datums) {
                    (Some(inverse), _) => {
                        let pull = |(row, along): (&Option<Row>, &Option<f64>)| {
                            row.as_ref().zip(*along).map(|(row, along)| row.slopes * (row.weight * along))
                        };
                        Some(-(inverse * rows.iter().zip(&along).filter_map(pull).sum::<Vector6<f64>>()))
                    }
                    (None, Some(datums)) => datums.step(mode, side, &motion.middle, motion.lever_mm),
                    (None, None) => Some(Vector6::zeros()),
                };
                let Some(step) = step else {
                    shared.has_failed = true;
                    continue;
                };
                for ((square, row), along) in squares.iter_mut().zip(&rows).zip(&along) {
                    if let (Some(row), Some(along)) = (row, along) {
                        *square += (along + row.slopes.dot(&step)).powi(2) / 2.0;
                    }
                }
            }
        }
        for ((pixel, row), square) in pixels.iter().zip(&rows).zip(&squares) {
            if row.is_some() {
                let of_order = shared.by_order.entry(pixel.order()).or_default();
                of_order.push((pixel.sample_idx, square.sqrt() as f32, pixel.systematic_sigma_mm() as f32));
            }
        }
        shared.is_known = true;
        Ok(shared)
    }

    /// At the nearest sample of the same order: the share along the normal, and what the calibration adds to σ.
    fn at(&self, samples: &Samples, idx: u32) -> (f32, f32) {
        let Some(known) = self.by_order.get(&samples.point(idx).order) else { return (0.0, 0.0) };
        let after = known.partition_point(|(at, ..)| *at < idx);
        let beside = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|k| known.get(k));
        let nearest = beside.min_by_key(|(at, ..)| at.abs_diff(idx));
        nearest.map_or((0.0, 0.0), |(_, along_mm, of_sigma_mm)| (*along_mm, *of_sigma_mm))
    }
}

/// (BᵀHB)⁻¹ in the space of B.
fn restricted_inverse(hessian: &Matrix6<f64>, basis: &[Vector6<f64>]) -> Matrix6<f64> {
    let n = basis.len();
    let small = nalgebra::DMatrix::from_fn(n, n, |i, j| (basis[i].transpose() * hessian * basis[j])[(0, 0)]);
    let Some(inverse) = small.try_inverse() else { return Matrix6::zeros() };
    let mut full = Matrix6::zeros();
    for i in 0..n {
        for j in 0..n {
            full += basis[i] * basis[j].transpose() * inverse[(i, j)];
        }
    }
    full
}

/// Standard uncertainty of a deviation, mm (eq. 17).
#[derive(Clone, Copy)]
struct Budget {
    noise_mm: f32,
    shared_mm: f32,
}

fn budget(
    samples: &Samples,
    nominal: &Nominal,
    motion: &Motion,
    shared: &Shared,
    of_pose: &Matrix6<f64>,
    point: &Compared,
) -> Budget {
    let (along_mm, of_sigma_mm) = shared.at(samples, point.sample);
    let total = samples.at(point.sample).sigma_mm as f32;
    let own = (total * total - of_sigma_mm * of_sigma_mm)
        .max(0.0)
        .sqrt()
        .max(crate::params::MIN_NOISE_SHARE as f32 * total);
    let facet = point.facet as usize;
    let slopes = slopes(&point.at.cast(), &nominal.facets[facet].normal, &motion.middle, motion.lever_mm);
    let pose = (slopes.transpose() * of_pose * slopes)[(0, 0)].max(0.0);
    let line_sigma_mm = samples.line_sigma_mm.unwrap_or(0.0);
    let thickness = FOOTPRINT_SHARE * line_sigma_mm * line_sigma_mm * f64::from(nominal.curvature[facet]) / 2.0;
    let square =
        f64::from(along_mm).powi(2) + pose + thickness * thickness + f64::from(nominal.sag_mm[facet]).powi(2);
    Budget { noise_mm: own * point.cosine, shared_mm: square.sqrt() as f32 }
}

/// A cell with its mean.
#[derive(Clone, Copy)]
struct Place {
    cell: u32,
    area_mm2: f64,
    at: Vector3<f64>,
    deviation_mm: f64,
    u_mm: f64,
    n_points: usize,
}

/// The means of all cells that points were seen in; counts the points of every cell.
fn places(cells: &mut Cells, compared: &[Compared], budgets: &[Budget], redundancy: f64) -> Vec<Place> {
    let mut sums: Vec<(Vector3<f64>, f64, f64, f64, usize)> =
        vec![(Vector3::zeros(), 0.0, 0.0, 0.0, 0); cells.cells.len()];
    for (point, budget) in compared.iter().zip(budgets) {
        let Some(cell) = point.cell else { continue };
        let sum = &mut sums[cell as usize];
        sum.0 += point.at.cast::<f64>();
        sum.1 += f64::from(point.deviation_mm);
        sum.2 += f64::from(budget.noise_mm).powi(2);
        sum.3 += f64::from(budget.shared_mm).powi(2);
        sum.4 += 1;
    }
    let mut places = Vec::new();
    for (idx, (at, deviation, noise, shared, n_points)) in sums.into_iter().enumerate() {
        cells.cells[idx].n_points = n_points;
        if n_points == 0 {
            continue;
        }
        let n = n_points as f64;
        // Points of one cell share their noise.
        let n_independent = (n / redundancy).max(1.0);
        places.push(Place {
            cell: idx as u32,
            area_mm2: cells.cells[idx].area_mm2,
            at: at / n,
            deviation_mm: deviation / n,
            u_mm: (noise / n / n_independent + shared / n).sqrt(),
            n_points,
        });
    }
    places
}

fn statistics(
    nominal: &Nominal,
    cells: &Cells,
    compared: &[Compared],
    places: &[Place],
    tolerance_mm: Option<f64>,
    n_samples: usize,
) -> DeviationStatistics {
    let weight = |point: &Compared| {
        let cell = cells.cells[point.cell? as usize];
        Some((point.deviation_mm, (cell.area_mm2 / cell.n_points as f64) as f32))
    };
    let mut deviations: Vec<(f32, f32)> = compared.par_iter().filter_map(weight).collect();
    let ([mean_mm, rms_mm, std_mm], percentiles_mm) = weighted(&mut deviations);
    let ends = |pick: fn(&[(f32, f32)]) -> Option<&(f32, f32)>| {
        pick(&deviations).map_or(f64::NAN, |(d, _)| f64::from(*d))
    };
    let beyond = |by: &dyn Fn(&Place, f64) -> bool| {
        tolerance_mm.map(|tolerance_mm| {
            let out = places.iter().filter(|place| place.n_points >= MIN_CELL_POINTS && by(place, tolerance_mm));
            out.map(|place| place.area_mm2).sum()
        })
    };
    DeviationStatistics {
        n_points: compared.len(),
        n_beyond: n_samples - compared.len(),
        mean_mm,
        rms_mm,
        std_mm,
        range_mm: [ends(<[_]>::first), ends(<[_]>::last)],
        percentiles_mm,
        area_mm2: nominal.area_mm2,
        covered_mm2: places.iter().map(|place| place.area_mm2).sum(),
        out_of_tolerance_mm2: beyond(&|place, tolerance_mm| place.deviation_mm.abs() > tolerance_mm),
        surely_out_of_tolerance_mm2: beyond(&|place, tolerance_mm| {
            place.deviation_mm.abs() - COVERAGE_FACTOR * place.u_mm > tolerance_mm
        }),
    }
}

/// The verdict on the covered surface: the worst of its cells.
fn verdict(places: &[Place], tolerance_mm: f64, is_proven: bool) -> PartVerdict {
    let limits = Limits::symmetric(tolerance_mm);
    let of = |place: &Place| judged(place.deviation_mm, &limits, COVERAGE_FACTOR * place.u_mm, is_proven);
    let all = places.iter().filter(|place| place.n_points >= MIN_CELL_POINTS).map(|place| of(place).into());
    all.max().unwrap_or(PartVerdict::Invalid)
}

/// The cells that are furthest off, some way apart.
fn worst(places: &[Place], side_mm: f64) -> Vec<WorstPlace> {
    let mut sorted: Vec<&Place> = places.iter().filter(|place| place.n_points >= MIN_CELL_POINTS).collect();
    sorted
        .sort_unstable_by(|a, b| b.deviation_mm.abs().total_cmp(&a.deviation_mm.abs()).then(a.cell.cmp(&b.cell)));
    let mut worst: Vec<&Place> = Vec::new();
    for place in sorted {
        if worst.len() == WORST_PLACES {
            break;
        }
        if worst.iter().all(|known| (known.at - place.at).norm() > WORST_PLACE_CELLS * side_mm) {
            worst.push(place);
        }
    }
    let of = |place: &&Place| WorstPlace {
        at_mm: place.at.into(),
        deviation_mm: place.deviation_mm,
        expanded_uncertainty_mm: COVERAGE_FACTOR * place.u_mm,
        n_points: place.n_points,
    };
    worst.iter().map(of).collect()
}

fn missing(samples: &Samples, calibration: Option<&Calibration>, shared: &Shared) -> Vec<Missing> {
    let stage = calibration.and_then(|calibration| calibration.stage);
    let turntable = stage.and_then(|stage| stage.rotary());
    let straightness = stage.and_then(|stage| stage.linear()?.straightness);
    let parts = [
        (!samples.sigma_known, Missing::PointNoise),
        (!shared.is_known, Missing::Calibration),
        (samples.stage.is_none(), Missing::StagePositions),
        (samples.line_sigma_mm.is_none(), Missing::LineThickness),
        (calibration.is_some_and(|c| wavelength_drift(c).is_none()), Missing::Wavelength),
        (shared.has_failed, Missing::CalibrationModes),
        (calibration.is_some() && turntable.is_none() && straightness.is_none(), Missing::StageStraightness),
        (turntable.is_some_and(|axis| axis.angle_error.is_none()), Missing::StageAngle),
    ];
    parts.into_iter().filter(|(is_missing, _)| *is_missing).map(|(_, part)| part).collect()
}
