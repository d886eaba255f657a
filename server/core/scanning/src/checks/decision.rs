//! Final decision on the points of a frame, once all surfaces are known: rejected and reinstated points
//! (`docs/maths/labelling.md`, "Carried labels" and "Reinstated points").

use vision::Centrelines;

use crate::checks::carried::{RunPoint, carried_stretches, rejected_by_width, unsupported_stretches};
use crate::checks::columns::{FrameColumns, LineColumns};
use crate::checks::compare::Surfaces;
use crate::checks::rivals::{Confirmation, Rivals, neighbours};
use crate::checks::widths::Widths;
use crate::input::line_step::largest_step_px;
use crate::input::line_widths::{LineWidths, Width};
use crate::params::{COMPARE_STRIDE_PX, RUN_REJECTED_FRACTION, STUB_WIDTHS, WIDTH_WINDOW_WIDTHS};
use crate::points::profile::{Profile, ProfilePoint};
use crate::points::profiles::Profiles;

/// Which points of a frame are rejected, and which are reinstated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Decision {
    /// Indices in the profile of the rejected points, ascending.
    pub rejected: Vec<u32>,
    /// How many of them the surfaces of other orders contradict.
    pub n_contradicted: usize,
    /// Doubtful points that are accepted after all.
    pub reinstated: Vec<ProfilePoint>,
    /// How many of them do not belong to any piece of a line: they were cut out.
    pub n_cut_away: usize,
}

/// Columns without a point that a line may bridge.
const LINE_GAP_COLUMNS: i64 = 2 * COMPARE_STRIDE_PX as i64;

/// A point that may be kept, and whether it was observed again.
struct CheckedPoint {
    point: ProfilePoint,
    confirmation: Confirmation,
    /// Index in the profile; `None` for a doubtful point.
    profile_idx: Option<u32>,
    is_rejected: bool,
}

/// Rejects points that other surfaces contradict, and reinstates doubtful points that they confirm.
#[derive(Clone, Copy)]
pub struct PointFilter<'a> {
    profiles: &'a Profiles<'a>,
    surfaces: &'a Surfaces<'a>,
    widths: Widths<'a>,
    rivals: Rivals<'a>,
}

impl<'a> PointFilter<'a> {
    /// Checks points against the surfaces formed by the labelled points of `profiles`.
    pub fn new(profiles: &'a Profiles<'a>, surfaces: &'a Surfaces<'a>, widths: &'a LineWidths) -> Self {
        let rivals = Rivals::new(profiles, surfaces);
        Self { profiles, surfaces, widths: Widths { learned: widths, rivals }, rivals }
    }

    /// Decides which points of frame `frame` are kept. `candidates`: its doubtful points, in the order of a
    /// profile.
    pub fn decide(&self, profile: &Profile, candidates: &Profile, frame: usize, lines: &Centrelines) -> Decision {
        let contradicted = self.contradicted_points(profile, frame);
        let mut checked = self.checked(&profile.points, frame);
        let profile_columns = self.columns(&checked);
        let line_columns = self.columns_of_pieces(profile, frame, lines);
        checked.extend(self.candidates(&candidates.points, &profile_columns, &line_columns, frame));
        for &place in &contradicted {
            checked[place as usize].is_rejected = true;
        }
        let along = |checked: &CheckedPoint| self.place(&checked.point).0;
        checked.sort_by(|a, b| a.point.order.cmp(&b.point.order).then(along(a).total_cmp(&along(b))));
        self.reject_isolated_candidates(&mut checked);
        self.reject_rivals(&mut checked);
        // If no point of the frame was observed again, the absence of a repeated observation is no evidence.
        if checked.iter().any(|checked| checked.confirmation == Confirmation::Confirmed) {
            self.reject_unheld(&mut checked, &line_columns, lines.correlation_px);
        }
        let mut rejected: Vec<u32> = checked
            .iter()
            .filter(|checked| checked.is_rejected)
            .filter_map(|checked| checked.profile_idx)
            .collect();
        rejected.sort_unstable();
        let reinstated: Vec<ProfilePoint> = checked
            .iter()
            .filter(|checked| checked.profile_idx.is_none() && !checked.is_rejected)
            .map(|checked| checked.point)
            .collect();
        let is_cut_away = |point: &&ProfilePoint| {
            let (along, across) = self.place(point);
            !line_columns.contain(along, across)
        };
        Decision {
            rejected,
            n_contradicted: contradicted.len(),
            n_cut_away: reinstated.iter().filter(is_cut_away).count(),
            reinstated,
        }
    }

    /// The points that the surfaces of other orders contradict; the whole run if most of it is contradicted.
    fn contradicted_points(&self, profile: &Profile, frame: usize) -> Vec<u32> {
        let mut contradicted_points = Vec::new();
        let mut first = 0;
        for run in profile.points.chunk_by(|a, b| self.follow(a, b)) {
            let contradicted: Vec<bool> = run.iter().map(|point| self.surfaces.contradict(point, frame)).collect();
            let n_contradicted = contradicted.iter().filter(|contradicted| **contradicted).count();
            let whole_run = n_contradicted as f64 > RUN_REJECTED_FRACTION * run.len() as f64;
            let places = (first..).zip(contradicted).filter(|(_, contradicted)| whole_run || *contradicted);
            contradicted_points.extend(places.map(|(place, _)| place));
            first += run.len() as u32;
        }
        contradicted_points
    }

    fn checked(&self, points: &[ProfilePoint], frame: usize) -> Vec<CheckedPoint> {
        let confirmations = self.rivals.confirmations(points, frame);
        let checked = |((idx, point), confirmation): ((u32, &ProfilePoint), Confirmation)| CheckedPoint {
            point: *point,
            confirmation,
            profile_idx: Some(idx),
            is_rejected: false,
        };
        (0..).zip(points).zip(confirmations).map(checked).collect()
    }

    /// The candidates whose label is confirmed by other orders without a rival, or whose column admits only their label.
    /// A point that was cut out may belong to the line beyond the cut, and needs its column. `profile_columns`: the
    /// columns of the frame's profile.
    fn candidates(
        &self,
        points: &[ProfilePoint],
        profile_columns: &FrameColumns,
        line_columns: &LineColumns,
        frame: usize,
    ) -> Vec<CheckedPoint> {
        let mut candidates = self.checked(points, frame);
        let mut held_by_width = self.held_by_width(points, profile_columns, line_columns);
        candidates.retain(|CheckedPoint { point, confirmation, .. }| {
            let (along, across) = self.place(point);
            let by_width = held_by_width.next() == Some(true);
            let is_held =
                by_width || *confirmation == Confirmation::Confirmed && line_columns.contain(along, across);
            let fits = match confirmation {
                Confirmation::Confirmed | Confirmation::Unconfirmed if is_held => {
                    profile_columns.admit(along, across, point.order)
                        && !self.rivals.is_rival_confirmed(point, frame)
                }
                Confirmation::Confirmed | Confirmation::Unconfirmed => {
                    profile_columns.admit_only(along, across, point.order)
                }
                Confirmation::RivalConfirmed => false,
            };
            fits && !self.surfaces.contradict(point, frame)
        });
        candidates.iter_mut().for_each(|candidate| candidate.profile_idx = None);
        candidates
    }

    /// Per candidate: whether the line width supports its label and that of its surroundings within the smoothing
    /// length.
    fn held_by_width(
        &self,
        points: &[ProfilePoint],
        profile_columns: &FrameColumns,
        line_columns: &LineColumns,
    ) -> impl Iterator<Item = bool> {
        let widths = points.chunk_by(|a, b| self.follow(a, b)).flat_map(|run| self.widths.of_run(run, |_| false));
        let fits: Vec<bool> = widths.map(|width| width == Width::Own).collect();
        let fitting = points.iter().zip(&fits).filter(|(_, fits)| **fits).map(|(point, _)| {
            let (along, across) = self.place(point);
            ((along, across, point.order), false)
        });
        let fitting = FrameColumns::new(fitting, &self.profiles.triangulator().calibration().orders);
        let holds = move |point: &ProfilePoint| {
            let start = self.place(point);
            let step_px = self.step_px(point);
            let reach_px = WIDTH_WINDOW_WIDTHS * f64::from(point.centreline.width_px);
            let is_held = |(along, across)| {
                fitting.contain(along, across, point.order) || profile_columns.contain(along, across, point.order)
            };
            [-1, 1].into_iter().all(|direction| {
                let next = |at: &(f64, f64)| line_columns.next(*at, direction * LINE_GAP_COLUMNS, step_px);
                let line = std::iter::successors(Some(start), next);
                line.take_while(|(along, _)| (along - start.0).abs() <= reach_px).all(is_held)
            })
        };
        let is_held = move |(point, fits): (&ProfilePoint, bool)| {
            let (along, across) = self.place(point);
            fits && line_columns.contain(along, across) && holds(point)
        };
        points.iter().zip(fits).map(is_held)
    }

    /// Rejects points for which a rival label is confirmed, and the part of their run that cannot be separated
    /// from them.
    fn reject_rivals(&self, checked: &mut [CheckedPoint]) {
        let (points, confirmations): (Vec<ProfilePoint>, Vec<Confirmation>) =
            checked.iter().map(|checked| (checked.point, checked.confirmation)).unzip();
        let has_rival = self.rivals.doubtful(&points, &confirmations);
        let mut first = 0;
        for run in checked.chunk_by_mut(|a, b| self.follow(&a.point, &b.point)) {
            let has_rival = &has_rival[first..first + run.len()];
            let n_rivals = has_rival.iter().filter(|has_rival| **has_rival).count();
            let whole_run = n_rivals as f64 > RUN_REJECTED_FRACTION * run.len() as f64;
            run.iter_mut()
                .zip(has_rival)
                .for_each(|(checked, has_rival)| checked.is_rejected |= whole_run || *has_rival);
            first += run.len();
        }
    }

    /// Rejects points whose label is supported neither by a repeated observation nor by the ranks nor by their
    /// line.
    fn reject_unheld(&self, checked: &mut [CheckedPoint], line_columns: &LineColumns, correlation_px: f64) {
        let columns = self.columns(checked);
        for run in checked.chunk_by_mut(|a, b| self.follow(&a.point, &b.point)) {
            let of_run: Vec<ProfilePoint> = run.iter().map(|checked| checked.point).collect();
            let widths = self.widths.of_run(&of_run, |idx| run[idx].confirmation == Confirmation::Confirmed);
            let point = |(checked, width)| self.run_point(checked, width, &columns, correlation_px);
            let points: Vec<RunPoint> = run.iter().zip(widths).map(point).collect();
            for idx in rejected_by_width(&points).into_iter().flatten() {
                run[idx].is_rejected = true;
            }
            for idx in carried_stretches(&points).into_iter().flatten() {
                run[idx].is_rejected |= !points[idx].is_held();
            }
            let rejected: Vec<bool> = run.iter().map(|checked| checked.is_rejected).collect();
            let cut = [(&run[0], -1), (&run[run.len() - 1], 1)]
                .map(|(end, direction)| self.is_cut(end, direction, &columns, line_columns));
            for idx in unsupported_stretches(&points, &rejected, cut).into_iter().flatten() {
                run[idx].is_rejected = true;
            }
        }
    }

    /// Whether a run's line continues beyond its end with another label or none. `direction`: along the line, ±1.
    fn is_cut(
        &self,
        end: &CheckedPoint,
        direction: i64,
        columns: &FrameColumns,
        line_columns: &LineColumns,
    ) -> bool {
        let next =
            line_columns.next(self.place(&end.point), direction * LINE_GAP_COLUMNS, self.step_px(&end.point));
        next.is_some_and(|(along, across)| !columns.contain(along, across, end.point.order))
    }

    fn run_point(
        &self,
        checked: &CheckedPoint,
        width: Width,
        columns: &FrameColumns,
        correlation_px: f64,
    ) -> RunPoint {
        let (along_px, across_px) = self.place(&checked.point);
        let centreline = &checked.point.centreline;
        RunPoint {
            along_px,
            across_px,
            noise_px: centreline.sigma_px * correlation_px.max(1.0).sqrt(),
            width_px: f64::from(centreline.width_px),
            is_confirmed: checked.confirmation == Confirmation::Confirmed,
            is_open: columns.admit_another(along_px, across_px),
            width,
        }
    }

    fn columns(&self, checked: &[CheckedPoint]) -> FrameColumns {
        let points = checked.iter().map(|CheckedPoint { point, confirmation, .. }| {
            let (along, across) = self.place(point);
            ((along, across, point.order), *confirmation == Confirmation::Confirmed)
        });
        FrameColumns::new(points, &self.profiles.triangulator().calibration().orders)
    }

    /// Positions of a frame's lines, labelled or not; a labelled line may extend beyond the depth range of points.
    fn columns_of_pieces(&self, profile: &Profile, frame: usize, lines: &Centrelines) -> LineColumns {
        let labels = &self.profiles.labels;
        let uncertain_pieces = labels.uncertain_pieces(frame).flat_map(|piece| piece.points(lines));
        let points = profile.points.iter().map(|point| &point.centreline).chain(uncertain_pieces);
        LineColumns::new(points.map(|point| point.along_across(lines.direction)))
    }

    fn follow(&self, a: &ProfilePoint, b: &ProfilePoint) -> bool {
        neighbours(a, b, &self.profiles.labels)
    }

    fn step_px(&self, point: &ProfilePoint) -> f64 {
        let labels = &self.profiles.labels;
        largest_step_px(&point.centreline, labels.line_width_px, labels.direction_of(point.order))
    }

    fn place(&self, point: &ProfilePoint) -> (f64, f64) {
        self.profiles.labels.along_across(point.order, &point.centreline)
    }

    /// Rejects candidates that are not connected to a point of the profile, unless other orders confirm them and
    /// their run is long: a chance row of speckles can also lie where the column admits only one order.
    fn reject_isolated_candidates(&self, checked: &mut [CheckedPoint]) {
        for run in checked.chunk_by_mut(|a, b| self.follow(&a.point, &b.point)) {
            if run.iter().all(|checked| checked.profile_idx.is_none()) {
                let is_short = (run.len() as f64) < STUB_WIDTHS * self.profiles.labels.line_width_px;
                run.iter_mut().for_each(|checked| {
                    checked.is_rejected |= is_short || checked.confirmation != Confirmation::Confirmed
                });
            }
        }
    }
}
