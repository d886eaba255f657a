//! Labelling and checking of a scan: its report, and its points frame by frame.

use std::collections::BTreeMap;

use nalgebra::{Vector2, Vector3};
use optics::stage::{FrameUncertainty, StageUncertainty};
use optics::{Calibration, Motion, Stage, StageAxis};
use statistics::median;
use vision::LineDirection;

use crate::checks::compare::{ClosurePairs, Sums, Surfaces, order_pairs};
use crate::checks::decision::{Decision, PointFilter};
use crate::checks::widths;
use crate::error::ScanError;
use crate::input::frames::{in_order, lines_of};
use crate::input::stage_positions::StagePositions;
use crate::label::Labels;
use crate::params::{FWHM_PER_SIGMA, MIN_THICKNESS_COSINE, THICKNESS_QUANTILE, THICKNESS_SAMPLES};
use crate::points::cloud::CloudPoint;
use crate::points::dropped::{DropReason, Dropped};
use crate::points::envelope::depth_envelope;
use crate::points::profile::{Profile, ProfilePoint};
use crate::points::profiles::Profiles;
use crate::points::sigma_table::SigmaTable;
use crate::report::ScanReport;

/// The evaluation of a scan; its points are computed on demand.
pub struct Evaluation<'a> {
    /// The report.
    pub report: ScanReport,
    /// Comments for the header of the cloud; the software adds its own name and version.
    pub comments: Vec<String>,
    profiles: Profiles<'a>,
    /// Per frame: which points of its profile are rejected, and which doubtful ones are reinstated.
    decisions: Vec<Decision>,
    /// Systematic σ of each order, over the pixels where it was observed.
    tables: Vec<(i8, SigmaTable)>,
    /// The uncertainty of the stage itself.
    stage_uncertainty: StageUncertainty,
}

impl<'a> Evaluation<'a> {
    /// Rejects points that are contradicted by other orders, have a confirmed rival label, or lack support;
    /// reinstates doubtful points that are confirmed; and compiles the report.
    pub(crate) fn new(profiles: Profiles<'a>, surfaces: Option<Surfaces>) -> Result<Self, ScanError> {
        let calibration = profiles.calibration;
        let mut orders = calibration.orders.clone();
        orders.sort_unstable();
        let mut sum = ScanTotals::new(orders.len());
        let n_frames = profiles.frames.n_frames();
        let widths = surfaces.as_ref().map(|surfaces| widths::learned(&profiles, surfaces)).transpose()?;
        // Given labels have no rivals.
        let filter = surfaces.as_ref().zip(widths.as_ref()).filter(|_| !profiles.labels.are_certain);
        let filter = filter.map(|(surfaces, widths)| PointFilter::new(&profiles, surfaces, widths));
        let check = |frame| CheckedFrame::new(&profiles, frame, (surfaces.as_ref(), filter), &orders);
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
            closure: sum.closure.closure(),
            envelope: depth_envelope(calibration, profiles.depth_range_mm),
        };
        let tables = sigma_tables(calibration, &sum.bounds);
        let stage_uncertainty = calibration.stage_uncertainty();
        let mut evaluation =
            Self { report, comments: Vec::new(), profiles, decisions: sum.decisions, tables, stage_uncertainty };
        let line_sigma_mm = evaluation.line_sigma_mm(&sum.n_points)?;
        evaluation.comments = comments(calibration, sum.correlations_px, line_sigma_mm);
        evaluation.comments.extend(evaluation.stage_positions().comments());
        Ok(evaluation)
    }

    /// Passes the points of the cloud to `take`, frame by frame: ordered by frame, then order, then along the line. May
    /// be called again. All threads work on frames, a few frames at a time.
    ///
    /// # Errors
    /// An error of `take`, which ends the iteration, or [`ScanError::UnreadableFrame`].
    pub fn for_each_frame<E: From<ScanError> + Send>(
        &self,
        mut take: impl FnMut(&[CloudPoint]) -> Result<(), E>,
    ) -> Result<(), E> {
        let points = |frame| Ok(self.points_of(frame)?);
        in_order(self.profiles.frames.n_frames(), points, |points| take(&points))
    }

    /// Calls `work` with the points of each frame (camera frame, with the motion of the part and the reported stage
    /// position) and passes the results to `take`, in the order of frames.
    pub(crate) fn for_each_profile<T: Send>(
        &self,
        work: impl Fn(usize, &[ProfilePoint], &Motion, f64) -> T + Sync,
        mut take: impl FnMut(T),
    ) -> Result<(), ScanError> {
        let of_frame = |frame| -> Result<T, ScanError> {
            let points = self.kept(&*self.profiles.of(frame)?, frame);
            Ok(work(frame, &points, &self.motion(frame), self.profiles.frames.position(frame).value()))
        };
        in_order(self.profiles.frames.n_frames(), of_frame, |result| {
            take(result);
            Ok(())
        })
    }

    fn motion(&self, frame: usize) -> Motion {
        let stage: Option<&Stage> = self.profiles.calibration.stage.as_ref();
        // An evaluated scan has positions of the stage's own kind.
        stage.and_then(|stage| stage.motion(self.profiles.frames.position(frame))).unwrap_or_else(Motion::identity)
    }

    fn stage_positions(&self) -> StagePositions {
        let frames = self.profiles.frames;
        let positions = (0..frames.n_frames()).map(|frame| frames.position(frame));
        match self.profiles.calibration.stage {
            Some(stage) => StagePositions { stage, positions: positions.collect() },
            None => StagePositions::linear(StageAxis::new(Vector3::zeros()), positions.map(|at| at.value())),
        }
    }

    fn points_of(&self, frame: usize) -> Result<Vec<CloudPoint>, ScanError> {
        let position = self.profiles.frames.position(frame);
        let motion = self.motion(frame);
        let spread = self.stage_uncertainty.in_frame(position);
        let profile = self.profiles.of(frame)?;
        let points = self.kept(&profile, frame);
        Ok(points.iter().map(|point| self.cloud_point(point, frame, &motion, &spread)).collect())
    }

    /// The points of a frame that are kept.
    fn kept(&self, profile: &Profile, frame: usize) -> Vec<ProfilePoint> {
        kept(profile, &self.decisions[frame], &self.profiles.labels)
    }

    fn cloud_point(
        &self,
        point: &ProfilePoint,
        frame: usize,
        motion: &Motion,
        spread: &FrameUncertainty,
    ) -> CloudPoint {
        let calibration = self.profiles.calibration;
        let in_part = motion.part_from_camera(&point.hit_in_camera).xyz;
        let table = self.tables.iter().find(|(order, _)| *order == point.order);
        let systematic = table
            .map_or(0.0, |(_, table)| table.sigma_mm(calibration, point.centreline.u_px, point.centreline.v_px));
        CloudPoint {
            x_mm: in_part.x,
            y_mm: in_part.y,
            z_mm: in_part.z,
            order: point.order,
            frame: frame as u32,
            u_px: point.centreline.u_px as f32,
            v_px: point.centreline.v_px as f32,
            intensity: point.centreline.intensity,
            sigma_mm: point.noise_sigma_mm.hypot(systematic).hypot(spread.sigma_mm(&point.hit_in_camera)) as f32,
        }
    }

    /// Thickness of the light sheets (one σ, along their normals) from the line widths in the image. `n_points`: of each
    /// frame.
    ///
    /// A width depends on the slope of the surface as well, which is unknown here. Points where the line runs obliquely
    /// through the image, as on the top of a turntable, are left out if others remain: the slope along the line makes
    /// the line narrower there. Of the rest the upper quartile is taken: surfaces that face the projector give narrow
    /// lines and are seen more often than those that face away from it.
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
        let thicknesses = |frame: usize| -> Result<Vec<(bool, f64)>, ScanError> {
            if firsts[frame] >= n_points[frame] {
                return Ok(Vec::new());
            }
            let profile = self.profiles.of(frame)?;
            let points = self.kept(&profile, frame);
            let sampled = points.iter().skip(firsts[frame]).step_by(step);
            let thickness = |point: &ProfilePoint| {
                let direction = self.profiles.labels.direction_of(point.order);
                Some((runs_along(point, direction), thickness_mm(point, self.profiles.calibration)?))
            };
            Ok(sampled.filter_map(thickness).collect())
        };
        let (mut along_mm, mut oblique_mm) = (Vec::with_capacity(THICKNESS_SAMPLES), Vec::new());
        in_order(n_points.len(), thicknesses, |of_frame| {
            for (runs_along, sigma_mm) in of_frame {
                if runs_along { along_mm.push(sigma_mm) } else { oblique_mm.push(sigma_mm) }
            }
            Ok::<(), ScanError>(())
        })?;
        let mut sigmas_mm = if along_mm.is_empty() { oblique_mm } else { along_mm };
        sigmas_mm.sort_unstable_by(f64::total_cmp);
        let rank = (THICKNESS_QUANTILE * sigmas_mm.len() as f64) as usize;
        Ok(sigmas_mm.get(rank).copied().unwrap_or(0.0))
    }
}

/// The points of a frame that are kept, sorted by order, then along the line.
fn kept(profile: &Profile, decision: &Decision, labels: &Labels) -> Vec<ProfilePoint> {
    let mut rejected = decision.rejected.iter().copied().peekable();
    let is_kept = |(idx, _): &(u32, &ProfilePoint)| rejected.next_if_eq(idx).is_none();
    let own = (0..).zip(&profile.points).filter(is_kept).map(|(_, point)| point);
    let mut points: Vec<ProfilePoint> = own.chain(&decision.reinstated).copied().collect();
    let along = |point: &ProfilePoint| labels.along_across(point.order, &point.centreline).0;
    points.sort_by(|a, b| a.order.cmp(&b.order).then(along(a).total_cmp(&along(b))));
    points
}

/// Whether the line runs along its direction in the image at a point.
fn runs_along(point: &ProfilePoint, direction: LineDirection) -> bool {
    point.centreline.normal_across(direction).abs() >= MIN_THICKNESS_COSINE
}

/// Thickness of the light sheet at a point, one σ along its normal, where the surface is perpendicular to the view.
fn thickness_mm(point: &ProfilePoint, calibration: &Calibration) -> Option<f64> {
    let pixel = Vector2::new(point.centreline.u_px, point.centreline.v_px);
    let hit = calibration.triangulate(point.order, &pixel, None)?;
    let along_ray_mm =
        hit.noise_sigma_mm(&point.centreline.normal, f64::from(point.centreline.width_px) / FWHM_PER_SIGMA);
    Some(along_ray_mm * hit.hit.normal.dot(&hit.ray).abs() / hit.ray.norm())
}

fn comments(calibration: &Calibration, mut correlations_px: Vec<f64>, line_sigma_mm: f64) -> Vec<String> {
    let correlation_px = median(&mut correlations_px).unwrap_or_default();
    vec![
        format!("calibration {}", calibration.id),
        "units mm".into(),
        "frame part".into(),
        format!("noise_correlation_px {correlation_px}"),
        format!("line_sigma_mm {line_sigma_mm:.4}"),
    ]
}

/// The pixels (u, v) of an order's points: lowest, highest.
type Bounds = [[f64; 2]; 2];

/// One table per order, over the pixels where it was observed.
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
struct CheckedFrame {
    decision: Decision,
    n_points: usize,
    n_segments: usize,
    correlation_px: f64,
    dropped: Dropped,
    labels: Vec<Option<i8>>,
    bounds: BTreeMap<i8, Bounds>,
    totals: Vec<Sums>,
    closure: ClosurePairs,
}

impl CheckedFrame {
    fn new(
        profiles: &Profiles,
        frame: usize,
        (surfaces, filter): (Option<&Surfaces>, Option<PointFilter>),
        orders: &[i8],
    ) -> Result<Self, ScanError> {
        let lines = lines_of(profiles.frames, frame)?;
        let (n_segments, correlation_px) = (lines.segments.len(), lines.correlation_px);
        let profile = profiles.of(frame)?;
        let decision = match filter {
            Some(filter) => filter.decide(&profile, &profiles.candidates_of(frame, &lines), frame, &lines),
            None => Decision::default(),
        };
        drop(lines);
        let points = kept(&profile, &decision, &profiles.labels);
        let mut dropped = profile.dropped;
        dropped.add_points(DropReason::Contradicted, decision.n_contradicted);
        dropped.add_points(DropReason::Doubtful, decision.rejected.len() - decision.n_contradicted);
        dropped.subtract_points(DropReason::TooShort, decision.n_cut_away);
        dropped.subtract_points(DropReason::Doubtful, decision.reinstated.len() - decision.n_cut_away);
        let mut bounds = BTreeMap::new();
        for point in &points {
            let at = [point.centreline.u_px, point.centreline.v_px];
            bounds.insert(point.order, widened(bounds.get(&point.order).copied(), at, at));
        }
        let totals = surfaces.map_or_else(Vec::new, |surfaces| surfaces.differences_of(&points, frame, orders));
        let closure = surfaces.map_or_else(ClosurePairs::default, |surfaces| surfaces.closure_of(&points, frame));
        Ok(Self {
            decision,
            n_points: points.len(),
            n_segments,
            correlation_px,
            dropped,
            labels: profile.labels.clone(),
            bounds,
            totals,
            closure,
        })
    }
}

/// All frames after the check.
struct ScanTotals {
    decisions: Vec<Decision>,
    n_points: Vec<usize>,
    n_segments: usize,
    correlations_px: Vec<f64>,
    dropped: Dropped,
    labels: Vec<Vec<Option<i8>>>,
    bounds: BTreeMap<i8, Bounds>,
    totals: Vec<Sums>,
    closure: ClosurePairs,
}

impl ScanTotals {
    fn new(n_orders: usize) -> Self {
        Self {
            decisions: Vec::new(),
            n_points: Vec::new(),
            n_segments: 0,
            correlations_px: Vec::new(),
            dropped: Dropped::default(),
            labels: Vec::new(),
            bounds: BTreeMap::new(),
            totals: vec![Sums::default(); n_orders * n_orders],
            closure: ClosurePairs::default(),
        }
    }

    fn add(&mut self, frame: CheckedFrame) {
        self.decisions.push(frame.decision);
        self.n_points.push(frame.n_points);
        self.n_segments += frame.n_segments;
        self.correlations_px.push(frame.correlation_px);
        self.dropped.add(&frame.dropped);
        self.labels.push(frame.labels);
        for (order, [low, high]) in frame.bounds {
            self.bounds.insert(order, widened(self.bounds.get(&order).copied(), low, high));
        }
        self.closure.append(frame.closure);
        self.totals.iter_mut().zip(&frame.totals).for_each(|(total, sums)| total.add_all(sums));
    }
}
