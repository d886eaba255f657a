//! Labels held against their rivals: on a part one wrap high a line lies where its neighbour lay on the ground
//! (`docs/maths/labelling.md`, "Rivals").

use std::ops::Range;

use crate::carried::{RunPoint, carried_stretches};
use crate::columns::FrameColumns;
use crate::compare::Surfaces;
use crate::label::along_across;
use crate::params::{COMPARE_STRIDE_PX, END_WIDTHS, KINK_STEP_PX, RUN_DENIED_SHARE};
use crate::profile::{Profile, ProfilePoint};
use crate::profiles::Profiles;

/// What else the points of a scan could be.
#[derive(Clone, Copy)]
pub struct Rivals<'a> {
    profiles: &'a Profiles<'a>,
    surfaces: &'a Surfaces<'a>,
}

impl<'a> Rivals<'a> {
    /// Asks the surfaces that the labelled points of `profiles` make.
    pub fn new(profiles: &'a Profiles<'a>, surfaces: &'a Surfaces<'a>) -> Self {
        Self { profiles, surfaces }
    }

    /// The points of a frame's profile, ascending, whose label nobody has seen a second time and that could have another:
    /// one that would put them on a known surface, or one that the ranks leave open beyond a step.
    /// With them goes what of their lines cannot be told from them. `correlation_px`: of the frame's
    /// centrelines.
    pub fn doubtful_points(&self, profile: &Profile, frame: usize, correlation_px: f64) -> Vec<u32> {
        let orders = &self.profiles.triangulator().calibration().orders;
        let places = profile.points.iter().map(|point| {
            let (along, across) = along_across(&point.seen, self.profiles.labels.direction);
            (along, across, point.order)
        });
        let columns = FrameColumns::new(places, orders);
        let looks = self.looks(&profile.points, frame);
        let doubts = self.spread(&profile.points, &looks);
        // Where nobody can look twice a missing second look says nothing.
        let can_be_seen_again = looks.contains(&Look::Seen);
        let mut doubtful = Vec::new();
        let mut first = 0;
        for run in profile.points.chunk_by(neighbours) {
            let places = first..first + run.len();
            let doubts = &doubts[places.clone()];
            let carried = match can_be_seen_again {
                true => self.carried(run, &looks[places], &columns, correlation_px),
                false => Vec::new(),
            };
            let n_doubtful = doubts.iter().filter(|doubt| **doubt).count();
            let whole_run = n_doubtful as f64 > RUN_DENIED_SHARE * run.len() as f64;
            let is_out = |idx: &usize| whole_run || doubts[*idx] || carried.iter().any(|part| part.contains(idx));
            doubtful.extend((0..run.len()).filter(is_out).map(|idx| (first + idx) as u32));
            first += run.len();
        }
        doubtful
    }

    /// The stretches of a run whose label its line only carries on.
    fn carried(
        &self,
        run: &[ProfilePoint],
        looks: &[Look],
        columns: &FrameColumns,
        correlation_px: f64,
    ) -> Vec<Range<usize>> {
        let point = |(point, look): (&ProfilePoint, &Look)| {
            let (along_px, across_px) = along_across(&point.seen, self.profiles.labels.direction);
            RunPoint {
                along_px,
                across_px,
                noise_px: point.seen.sigma_px * correlation_px.max(1.0).sqrt(),
                width_px: f64::from(point.seen.width_px),
                is_seen: *look == Look::Seen,
                is_open: columns.leave_open(along_px, across_px),
            }
        };
        let points: Vec<RunPoint> = run.iter().zip(looks).map(point).collect();
        carried_stretches(&points)
    }

    /// What other orders have seen of every point; every few columns one point answers for its neighbours.
    fn looks(&self, points: &[ProfilePoint], frame: usize) -> Vec<Look> {
        let mut looks = Vec::with_capacity(points.len());
        let mut last: Option<(i8, i64, Look)> = None;
        for point in points {
            let slot = (self.along(point) as i64).div_euclid(COMPARE_STRIDE_PX as i64);
            let look = match last {
                Some((order, at, look)) if (order, at) == (point.order, slot) => look,
                _ => self.look(point, frame),
            };
            last = Some((point.order, slot, look));
            looks.push(look);
        }
        looks
    }

    fn look(&self, point: &ProfilePoint, frame: usize) -> Look {
        if self.surfaces.is_seen_again(point, frame) {
            return Look::Seen;
        }
        let triangulator = self.profiles.triangulator();
        let orders = triangulator.calibration().orders.iter().enumerate();
        let has_rival = orders.filter(|(_, order)| **order != point.order).any(|(order_idx, &order)| {
            let hit = triangulator.hit(order_idx, point.seen.u_px, point.seen.v_px);
            let rival = ProfilePoint {
                order,
                hit_in_camera: hit.in_camera,
                noise_sigma_mm: hit.noise_sigma_mm(&point.seen.normal, point.seen.sigma_px),
                ..*point
            };
            self.profiles.depth_range_mm.contains(hit.in_camera.xyz.z)
                && self.surfaces.is_seen_again(&rival, frame)
        });
        if has_rival { Look::RivalSeen } else { Look::Nobody }
    }

    /// A doubt reaches as far along its line as the extraction smooths.
    fn spread(&self, points: &[ProfilePoint], looks: &[Look]) -> Vec<bool> {
        let is_doubtful = |look: &Look| *look == Look::RivalSeen;
        let mut spread: Vec<bool> = looks.iter().map(is_doubtful).collect();
        for (idx, point) in points.iter().enumerate().filter(|(idx, _)| is_doubtful(&looks[*idx])) {
            let reach_px = END_WIDTHS * f64::from(point.seen.width_px);
            let is_near = |other: &ProfilePoint| {
                other.order == point.order && (self.along(other) - self.along(point)).abs() <= reach_px
            };
            let before = points[..idx].iter().rev().take_while(|other| is_near(other)).count();
            let after = points[idx..].iter().take_while(|other| is_near(other)).count();
            spread[idx - before..idx + after].fill(true);
        }
        spread
    }

    fn along(&self, point: &ProfilePoint) -> f64 {
        along_across(&point.seen, self.profiles.labels.direction).0.round()
    }
}

/// What other orders, in other frames, have seen of the surface a label puts a point on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// That surface.
    Seen,
    /// The one another label would put it on.
    RivalSeen,
    /// Neither.
    Nobody,
}

/// Whether two points follow one another on one line.
pub fn neighbours(a: &ProfilePoint, b: &ProfilePoint) -> bool {
    let apart_px = (a.seen.u_px - b.seen.u_px).abs().max((a.seen.v_px - b.seen.v_px).abs());
    a.order == b.order && apart_px <= KINK_STEP_PX
}
