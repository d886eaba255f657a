//! A scan labelled and checked: its report, and its points frame by frame.

use std::collections::BTreeMap;

use nalgebra::{Vector2, Vector3};
use optics::{Calibration, StageAxis};

use crate::cloud::CloudPoint;
use crate::compare::{Sums, Surfaces, order_pairs};
use crate::dropped::{DropReason, Dropped};
use crate::envelope::depth_envelope;
use crate::frames::{in_order, lines_of};
use crate::params::{FWHM_PER_SIGMA, RUN_DENIED_SHARE, THICKNESS_SAMPLES};
use crate::profile::{Profile, ProfilePoint};
use crate::profiles::Profiles;
use crate::rivals::{Rivals, neighbours};
use crate::scan::{ScanError, ScanReport};
use crate::sigma_table::SigmaTable;
use crate::stage_positions::StagePositions;

/// What a scan came to; its points are computed when they are asked for.
pub struct Evaluation<'a> {
    /// What was done.
    pub report: ScanReport,
    /// What the cloud must say about itself; the software adds its own name and version.
    pub comments: Vec<String>,
    profiles: Profiles<'a>,
    /// Per frame: the places in its profile of the points that are left out again, ascending.
    denied: Vec<Vec<u32>>,
    /// Systematic σ of each order, over the pixels where it was seen.
    tables: Vec<(i8, SigmaTable)>,
}

impl<'a> Evaluation<'a> {
    /// Drops what the surfaces of other orders deny and what rivals challenge, and draws up the report.
    pub(crate) fn new(profiles: Profiles<'a>, surfaces: Option<Surfaces>) -> Result<Self, ScanError> {
        let calibration = profiles.calibration;
        let mut orders = calibration.orders.clone();
        orders.sort_unstable();
        let mut sum = Checks::new(orders.len());
        let n_frames = profiles.frames.n_frames();
        let rivals = surfaces.as_ref().map(|surfaces| Rivals::new(&profiles, surfaces));
        let check = |frame| Checked::new(&profiles, frame, (surfaces.as_ref(), rivals), &orders);
        in_order(n_frames, check, |checked| {
            sum.add(checked);
            Ok(())
        })?;
        let report = ScanReport {
            n_points: sum.n_points.iter().sum(),
            n_segments: sum.n_segments,
            dropped: sum.dropped,
            labels: sum.labels,
            self_consistency: order_pairs(&sum.totals, &orders),
            envelope: depth_envelope(calibration, profiles.depth_range_mm),
        };
        let tables = sigma_tables(calibration, &sum.bounds);
        let mut made = Self { report, comments: Vec::new(), profiles, denied: sum.denied, tables };
        let line_sigma_mm = made.line_sigma_mm(&sum.n_points)?;
        made.comments = comments(calibration, sum.correlations_px, line_sigma_mm);
        made.comments.extend(made.stage_positions().comments());
        Ok(made)
    }

    /// Hands out the points of the cloud, frame by frame: ordered by frame, then order, then along the line. May be asked
    /// for again. Frames are worked on by all threads, and only a few of them at a time.
    ///
    /// # Errors
    /// What `take` answers, which ends it, or [`ScanError::UnreadableFrame`].
    pub fn for_each_frame<E: From<ScanError> + Send>(
        &self,
        mut take: impl FnMut(&[CloudPoint]) -> Result<(), E>,
    ) -> Result<(), E> {
        let points = |frame| Ok(self.points_of(frame)?);
        in_order(self.profiles.frames.n_frames(), points, |points| take(&points))
    }

    fn stage_positions(&self) -> StagePositions {
        let frames = self.profiles.frames;
        let at_rest = StageAxis::new(Vector3::zeros());
        StagePositions {
            axis: self.profiles.calibration.stage.unwrap_or(at_rest),
            positions_mm: (0..frames.n_frames()).map(|frame| frames.position_mm(frame)).collect(),
        }
    }

    fn points_of(&self, frame: usize) -> Result<Vec<CloudPoint>, ScanError> {
        let position_mm = self.profiles.frames.position_mm(frame);
        let profile = self.profiles.of(frame)?;
        Ok(self.kept(&profile, frame).map(|point| self.cloud_point(point, frame, position_mm)).collect())
    }

    /// The points of a profile that were not denied.
    fn kept<'p>(&'p self, profile: &'p Profile, frame: usize) -> impl Iterator<Item = &'p ProfilePoint> {
        let mut denied = self.denied[frame].iter().copied().peekable();
        let kept = move |(idx, _): &(u32, &ProfilePoint)| denied.next_if_eq(idx).is_none();
        (0..).zip(&profile.points).filter(kept).map(|(_, point)| point)
    }

    fn cloud_point(&self, point: &ProfilePoint, frame: usize, position_mm: f64) -> CloudPoint {
        let calibration = self.profiles.calibration;
        let in_part = match calibration.stage {
            Some(stage) => stage.part_from_camera(&point.hit_in_camera, position_mm).xyz,
            None => point.hit_in_camera.xyz,
        };
        let table = self.tables.iter().find(|(order, _)| *order == point.order);
        let systematic =
            table.map_or(0.0, |(_, table)| table.sigma_mm(calibration, point.seen.u_px, point.seen.v_px));
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
    }

    /// Median thickness of the light sheets (one σ, along their normals) from the widths of the lines in the image.
    /// `n_points`: of each frame.
    fn line_sigma_mm(&self, n_points: &[usize]) -> Result<f64, ScanError> {
        let step = self.report.n_points.div_ceil(THICKNESS_SAMPLES).max(1);
        let firsts: Vec<usize> = n_points
            .iter()
            .scan(0, |n_before: &mut usize, n| {
                // Points up to the next multiple of the step.
                let skipped = n_before.next_multiple_of(step) - *n_before;
                *n_before += n;
                Some(skipped)
            })
            .collect();
        let thicknesses = |frame: usize| -> Result<Vec<f64>, ScanError> {
            if firsts[frame] >= n_points[frame] {
                return Ok(Vec::new());
            }
            let profile = self.profiles.of(frame)?;
            let sampled = self.kept(&profile, frame).skip(firsts[frame]).step_by(step);
            Ok(sampled.filter_map(|point| thickness_mm(point, self.profiles.calibration)).collect())
        };
        let mut sigmas_mm: Vec<f64> = Vec::with_capacity(THICKNESS_SAMPLES);
        in_order(n_points.len(), thicknesses, |of_frame| {
            sigmas_mm.extend(of_frame);
            Ok::<(), ScanError>(())
        })?;
        sigmas_mm.sort_by(f64::total_cmp);
        Ok(sigmas_mm.get(sigmas_mm.len() / 2).copied().unwrap_or(0.0))
    }
}

/// Thickness of the light sheet at a point, one σ along its normal.
fn thickness_mm(point: &ProfilePoint, calibration: &Calibration) -> Option<f64> {
    let pixel = Vector2::new(point.seen.u_px, point.seen.v_px);
    let hit = calibration.triangulate(point.order, &pixel, None)?;
    let along_ray_mm = hit.noise_sigma_mm(&point.seen.normal, f64::from(point.seen.width_px) / FWHM_PER_SIGMA);
    Some(along_ray_mm * hit.hit.normal.dot(&hit.ray).abs() / hit.ray.norm())
}

fn comments(calibration: &Calibration, mut correlations_px: Vec<f64>, line_sigma_mm: f64) -> Vec<String> {
    correlations_px.sort_by(f64::total_cmp);
    vec![
        format!("calibration {}", calibration.id),
        "units mm".into(),
        "frame part".into(),
        format!("noise_correlation_px {}", correlations_px[correlations_px.len() / 2]),
        format!("line_sigma_mm {line_sigma_mm:.4}"),
    ]
}

/// The pixels (u, v) of an order's points: lowest, highest.
type Bounds = [[f64; 2]; 2];

/// One table per order, over the pixels where it was seen.
fn sigma_tables(calibration: &Calibration, bounds: &BTreeMap<i8, Bounds>) -> Vec<(i8, SigmaTable)> {
    let table = |&order: &i8| {
        let [low, high] = *bounds.get(&order)?;
        Some((order, SigmaTable::new(calibration, order, low, high)))
    };
    calibration.orders.iter().filter_map(table).collect()
}

fn widened(bounds: Option<Bounds>, low: [f64; 2], high: [f64; 2]) -> Bounds {
    let [old_low, old_high] = bounds.unwrap_or([low, high]);
    [[0, 1].map(|axis| old_low[axis].min(low[axis])), [0, 1].map(|axis| old_high[axis].max(high[axis]))]
}

/// A frame after the check.
struct Checked {
    denied: Vec<u32>,
    n_points: usize,
    n_segments: usize,
    correlation_px: f64,
    dropped: Dropped,
    labels: Vec<Option<i8>>,
    bounds: BTreeMap<i8, Bounds>,
    totals: Vec<Sums>,
}

impl Checked {
    fn new(
        profiles: &Profiles,
        frame: usize,
        (surfaces, rivals): (Option<&Surfaces>, Option<Rivals>),
        orders: &[i8],
    ) -> Result<Self, ScanError> {
        let lines = lines_of(profiles.frames, frame)?;
        let (n_segments, correlation_px) = (lines.segments.len(), lines.correlation_px);
        drop(lines);
        let profile = profiles.of(frame)?;
        let mut denied = surfaces.map_or_else(Vec::new, |surfaces| denied_points(&profile, surfaces, frame));
        let n_denied = denied.len();
        if let Some(rivals) = rivals {
            denied.extend(rivals.doubtful_points(&profile, frame, correlation_px));
            denied.sort_unstable();
            denied.dedup();
        }
        let mut gone = denied.iter().copied().peekable();
        let points: Vec<ProfilePoint> = (0..)
            .zip(&profile.points)
            .filter(|(idx, _)| gone.next_if_eq(idx).is_none())
            .map(|(_, point)| *point)
            .collect();
        let mut dropped = profile.dropped;
        dropped.add_points(DropReason::Contradicted, n_denied);
        dropped.add_points(DropReason::Doubtful, denied.len() - n_denied);
        let mut bounds = BTreeMap::new();
        for point in &points {
            let at = [point.seen.u_px, point.seen.v_px];
            bounds.insert(point.order, widened(bounds.get(&point.order).copied(), at, at));
        }
        let totals = surfaces.map_or_else(Vec::new, |surfaces| surfaces.differences_of(&points, frame, orders));
        Ok(Self {
            denied,
            n_points: points.len(),
            n_segments,
            correlation_px,
            dropped,
            labels: profile.labels.clone(),
            bounds,
            totals,
        })
    }
}

/// The points that the surfaces of other orders deny, and what little is left of a run of denied ones.
fn denied_points(profile: &Profile, surfaces: &Surfaces, frame: usize) -> Vec<u32> {
    let mut denied_points = Vec::new();
    let mut first = 0;
    for run in profile.points.chunk_by(neighbours) {
        let denied: Vec<bool> = run.iter().map(|point| surfaces.contradict(point, frame)).collect();
        let n_denied = denied.iter().filter(|denied| **denied).count();
        let whole_run = n_denied as f64 > RUN_DENIED_SHARE * run.len() as f64;
        let places = (first..).zip(denied).filter(|(_, denied)| whole_run || *denied);
        denied_points.extend(places.map(|(place, _)| place));
        first += run.len() as u32;
    }
    denied_points
}

/// All frames after the check.
struct Checks {
    denied: Vec<Vec<u32>>,
    n_points: Vec<usize>,
    n_segments: usize,
    correlations_px: Vec<f64>,
    dropped: Dropped,
    labels: Vec<Vec<Option<i8>>>,
    bounds: BTreeMap<i8, Bounds>,
    totals: Vec<Sums>,
}

impl Checks {
    fn new(n_orders: usize) -> Self {
        Self {
            denied: Vec::new(),
            n_points: Vec::new(),
            n_segments: 0,
            correlations_px: Vec::new(),
            dropped: Dropped::default(),
            labels: Vec::new(),
            bounds: BTreeMap::new(),
            totals: vec![Sums::default(); n_orders * n_orders],
        }
    }

    fn add(&mut self, frame: Checked) {
        self.denied.push(frame.denied);
        self.n_points.push(frame.n_points);
        self.n_segments += frame.n_segments;
        self.correlations_px.push(frame.correlation_px);
        self.dropped.add(&frame.dropped);
        self.labels.push(frame.labels);
        for (order, [low, high]) in frame.bounds {
            self.bounds.insert(order, widened(self.bounds.get(&order).copied(), low, high));
        }
        self.totals.iter_mut().zip(&frame.totals).for_each(|(total, sums)| total.add_all(sums));
    }
}

#[cfg(test)]
mod tests;
