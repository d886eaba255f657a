//! A scan: labelled, triangulated, registered, checked.

use nalgebra::{Vector2, Vector3};
use optics::{Calibration, DepthRangeMm, PointMm, Triangulator};
use rayon::prelude::*;
use vision::Centrelines;

use crate::cloud::{Cloud, CloudPoint};
use crate::compare::{OrderPair, Surfaces};
use crate::dropped::{DropReason, Dropped};
use crate::envelope::{DepthEnvelope, depth_envelope};
use crate::label::{Travel, label_frames, outlook};
use crate::params::{FWHM_PER_SIGMA, KINK_STEP_PX, RUN_DENIED_SHARE, THICKNESS_SAMPLES};
use crate::profile::{Profile, ProfilePoint, profile_of_frame};
use crate::sigma_table::SigmaTable;

/// One frame of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanFrame {
    /// The lines found in its image.
    pub centrelines: Centrelines,
    /// Stage position it was taken at.
    pub position_mm: f64,
}

/// Settings of a scan; the defaults serve any station.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScanParams {
    /// Depths (z of the camera frame) in which the part lies; by default those the calibration covers.
    pub depth_range_mm: Option<DepthRangeMm>,
}

/// Why a scan cannot be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScanError {
    /// Nothing to evaluate.
    #[error("the scan has no frames")]
    NoFrames,
    /// The stage moved, but its direction is unknown.
    #[error(
        "the calibration `{calibration}` knows no stage, but the scan's frames lie {travel_mm} mm apart; calibrate with at least two stage views"
    )]
    NoStage {
        /// The calibration's id.
        calibration: String,
        /// Distance between the outermost positions.
        travel_mm: f64,
    },
    /// A stage position is not a number.
    #[error("the stage position of frame {frame} is not a finite number")]
    BadPosition {
        /// Index of the frame.
        frame: usize,
    },
    /// The depth range is empty or not a number.
    #[error("the depth range {near_mm}–{far_mm} mm is empty or not positive; give near < far")]
    BadDepthRange {
        /// Nearest depth.
        near_mm: f64,
        /// Farthest depth.
        far_mm: f64,
    },
}

/// What a scan gave, besides its points.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanReport {
    /// Points in the cloud.
    pub n_points: usize,
    /// Segments of lines that went in.
    pub n_segments: usize,
    /// What was left out, and why.
    pub dropped: Dropped,
    /// Per frame and segment: the order most of its points were given.
    pub labels: Vec<Vec<Option<i8>>>,
    /// How well the orders agree where they have seen the same surface.
    pub self_consistency: Vec<OrderPair>,
    /// Where geometry alone would have labelled.
    pub envelope: DepthEnvelope,
}

/// Points and report of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanResult {
    /// The points in the part frame.
    pub cloud: Cloud,
    /// What was done.
    pub report: ScanReport,
}

/// Turns the centrelines of a scan into a cloud in the part frame.
///
/// Labels: `label::label_frames`. Registration: X_part = X_camera − s·t. σ of a point: image noise and calibration
/// covariance along its ray. Points that the surfaces of other orders deny are dropped and counted.
///
/// # Errors
/// [`ScanError`]; lines that cannot be labelled are not an error, they are counted in the report.
pub fn scan_cloud(
    frames: &[ScanFrame],
    calibration: &Calibration,
    params: &ScanParams,
) -> Result<ScanResult, ScanError> {
    let depth_range_mm = checked_depth_range(calibration, params)?;
    let shifts_mm = shifts(frames, calibration)?;
    let lines: Vec<&Centrelines> = frames.iter().map(|frame| &frame.centrelines).collect();
    let triangulator = Triangulator::new(calibration.clone());
    let labels = label_frames(&lines, &shifts_mm, &triangulator, depth_range_mm);
    let mut profiles: Vec<Profile> = lines
        .par_iter()
        .enumerate()
        .map(|(frame, lines)| profile_of_frame(lines, frame, &labels, &triangulator, depth_range_mm))
        .collect();
    let travel = Travel::of(&shifts_mm);
    let outlook = outlook(&travel, calibration, depth_range_mm, labels.direction);
    let surfaces = Surfaces::new(&profiles, &shifts_mm, &travel.order, outlook, labels.direction, calibration);
    let mut self_consistency = Vec::new();
    if let Some(surfaces) = surfaces {
        drop_contradicted(&mut profiles, &surfaces);
        self_consistency = surfaces.self_consistency(&profiles, &calibration.orders);
    }
    let report = ScanReport {
        n_points: profiles.iter().map(|profile| profile.points.len()).sum(),
        n_segments: lines.iter().map(|lines| lines.segments.len()).sum(),
        dropped: profiles.iter().fold(Dropped::default(), |mut sum, profile| {
            sum.add(&profile.dropped);
            sum
        }),
        labels: profiles.iter().map(|profile| profile.labels.clone()).collect(),
        self_consistency,
        envelope: depth_envelope(calibration, depth_range_mm),
    };
    let comments = comments(frames, &profiles, calibration);
    let points = cloud_points(frames, &profiles, calibration);
    Ok(ScanResult { cloud: Cloud { points, comments }, report })
}

fn checked_depth_range(calibration: &Calibration, params: &ScanParams) -> Result<DepthRangeMm, ScanError> {
    let range = params.depth_range_mm.unwrap_or(calibration.depth_range_mm);
    if range.near_mm > 0.0 && range.near_mm < range.far_mm && range.far_mm.is_finite() {
        return Ok(range);
    }
    Err(ScanError::BadDepthRange { near_mm: range.near_mm, far_mm: range.far_mm })
}

/// What the stage has moved the part by in each frame, in the camera frame.
fn shifts(frames: &[ScanFrame], calibration: &Calibration) -> Result<Vec<Vector3<f64>>, ScanError> {
    if frames.is_empty() {
        return Err(ScanError::NoFrames);
    }
    if let Some(frame) = frames.iter().position(|frame| !frame.position_mm.is_finite()) {
        return Err(ScanError::BadPosition { frame });
    }
    let positions = frames.iter().map(|frame| frame.position_mm);
    if let Some(stage) = calibration.stage {
        // X_part = X_camera − s·t: the shift is what is taken off.
        let origin = PointMm::new(Vector3::zeros());
        return Ok(positions.map(|position| -stage.part_from_camera(&origin, position).xyz).collect());
    }
    let low = positions.clone().fold(f64::INFINITY, f64::min);
    let high = positions.clone().fold(f64::NEG_INFINITY, f64::max);
    if high > low {
        return Err(ScanError::NoStage { calibration: calibration.id.clone(), travel_mm: high - low });
    }
    Ok(vec![Vector3::zeros(); frames.len()])
}

/// Takes away the points that the surfaces of other orders deny, and what little is left of a run of denied ones.
fn drop_contradicted(profiles: &mut [Profile], surfaces: &Surfaces) {
    profiles.par_iter_mut().enumerate().for_each(|(frame, profile)| {
        let mut kept = Vec::with_capacity(profile.points.len());
        for run in profile.points.chunk_by(neighbours) {
            let denied: Vec<bool> = run.iter().map(|point| surfaces.contradict(point, frame)).collect();
            let n_denied = denied.iter().filter(|denied| **denied).count();
            if n_denied as f64 <= RUN_DENIED_SHARE * run.len() as f64 {
                kept.extend(run.iter().zip(denied).filter(|(_, denied)| !denied).map(|(point, _)| *point));
            }
        }
        profile.dropped.add_points(DropReason::Contradicted, profile.points.len() - kept.len());
        profile.points = kept;
    });
}

/// Whether two points follow one another on one line.
fn neighbours(a: &ProfilePoint, b: &ProfilePoint) -> bool {
    let apart_px = (a.seen.u_px - b.seen.u_px).abs().max((a.seen.v_px - b.seen.v_px).abs());
    a.order == b.order && apart_px <= KINK_STEP_PX
}

fn cloud_points(frames: &[ScanFrame], profiles: &[Profile], calibration: &Calibration) -> Vec<CloudPoint> {
    let tables = sigma_tables(profiles, calibration);
    let per_frame: Vec<Vec<CloudPoint>> = profiles
        .par_iter()
        .enumerate()
        .map(|(frame, profile)| {
            let point = |point: &ProfilePoint| {
                let in_part = match calibration.stage {
                    Some(stage) => stage.part_from_camera(&point.hit_in_camera, frames[frame].position_mm).xyz,
                    None => point.hit_in_camera.xyz,
                };
                let systematic = tables
                    .iter()
                    .find(|(order, _)| *order == point.order)
                    .map_or(0.0, |(_, table)| table.sigma_mm(calibration, point.seen.u_px, point.seen.v_px));
                CloudPoint {
                    x_mm: in_part.x,
                    y_mm: in_part.y,
                    z_mm: in_part.z,
                    order: point.order,
                    frame: frame as u32,
                    u_px: point.seen.u_px as f32,
                    v_px: point.seen.v_px as f32,
                    intensity: point.seen.intensity,
                    sigma_mm: point.noise_sigma_mm.hypot(systematic) as f32,
                }
            };
            profile.points.iter().map(point).collect()
        })
        .collect();
    per_frame.into_iter().flatten().collect()
}

/// One table per order, over the pixels where it was seen.
fn sigma_tables(profiles: &[Profile], calibration: &Calibration) -> Vec<(i8, SigmaTable)> {
    let bounds = |order: i8| {
        let points = profiles.iter().flat_map(|profile| &profile.points).filter(|point| point.order == order);
        points.fold(None, |bounds: Option<[[f64; 2]; 2]>, point| {
            let at = [point.seen.u_px, point.seen.v_px];
            let [low, high] = bounds.unwrap_or([at, at]);
            Some([[0, 1].map(|axis| low[axis].min(at[axis])), [0, 1].map(|axis| high[axis].max(at[axis]))])
        })
    };
    calibration
        .orders
        .par_iter()
        .filter_map(|&order| {
            let [low, high] = bounds(order)?;
            Some((order, SigmaTable::new(calibration, order, low, high)))
        })
        .collect()
}

/// What the cloud must say about itself; the software adds its own name and version.
fn comments(frames: &[ScanFrame], profiles: &[Profile], calibration: &Calibration) -> Vec<String> {
    let mut correlations: Vec<f64> = frames.iter().map(|frame| frame.centrelines.correlation_px).collect();
    correlations.sort_by(f64::total_cmp);
    vec![
        format!("calibration {}", calibration.id),
        "units mm".into(),
        "frame part".into(),
        format!("noise_correlation_px {}", correlations[correlations.len() / 2]),
        format!("line_sigma_mm {:.4}", line_sigma_mm(profiles, calibration)),
    ]
}

/// Median thickness of the light sheets (one σ, along their normals) from the widths of the lines in the image.
fn line_sigma_mm(profiles: &[Profile], calibration: &Calibration) -> f64 {
    let points: Vec<&ProfilePoint> = profiles.iter().flat_map(|profile| &profile.points).collect();
    let step = points.len().div_ceil(THICKNESS_SAMPLES).max(1);
    let mut sigmas_mm: Vec<f64> = points
        .iter()
        .step_by(step)
        .filter_map(|point| {
            let pixel = Vector2::new(point.seen.u_px, point.seen.v_px);
            let hit = calibration.triangulate(point.order, &pixel, None)?;
            let along_ray_mm =
                hit.noise_sigma_mm(&point.seen.normal, f64::from(point.seen.width_px) / FWHM_PER_SIGMA);
            Some(along_ray_mm * hit.hit.normal.dot(&hit.ray).abs() / hit.ray.norm())
        })
        .collect();
    sigmas_mm.sort_by(f64::total_cmp);
    sigmas_mm.get(sigmas_mm.len() / 2).copied().unwrap_or(0.0)
}
