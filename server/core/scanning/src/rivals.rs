//! Labels held against their rivals: on a part one wrap high a line lies where its neighbour lay on the ground
//! (`docs/maths/labelling.md`, "Rivals").

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

    /// The points of a frame's profile, ascending, whose label nobody has seen a second time while another order would
    /// put them on a known surface; and what of their lines cannot be told from them.
    pub fn doubtful_points(&self, profile: &Profile, frame: usize) -> Vec<u32> {
        let doubts = self.spread(&profile.points, &self.doubts(&profile.points, frame));
        let mut doubtful = Vec::new();
        let mut first = 0;
        for run in profile.points.chunk_by(neighbours) {
            let doubts = &doubts[first..first + run.len()];
            let n_doubtful = doubts.iter().filter(|doubt| **doubt).count();
            let whole_run = n_doubtful as f64 > RUN_DENIED_SHARE * run.len() as f64;
            let places = (first as u32..).zip(doubts).filter(|(_, doubt)| whole_run || **doubt);
            doubtful.extend(places.map(|(place, _)| place));
            first += run.len();
        }
        doubtful
    }

    /// Per point: whether its label is in doubt; every few columns one point answers for its neighbours.
    fn doubts(&self, points: &[ProfilePoint], frame: usize) -> Vec<bool> {
        let mut doubts = Vec::with_capacity(points.len());
        let mut last: Option<(i8, i64, bool)> = None;
        for point in points {
            let slot = (self.along(point) as i64).div_euclid(COMPARE_STRIDE_PX as i64);
            let doubt = match last {
                Some((order, at, doubt)) if (order, at) == (point.order, slot) => doubt,
                _ => self.is_doubtful(point, frame),
            };
            last = Some((point.order, slot, doubt));
            doubts.push(doubt);
        }
        doubts
    }

    fn is_doubtful(&self, point: &ProfilePoint, frame: usize) -> bool {
        if self.surfaces.is_seen_again(point, frame) {
            return false;
        }
        let triangulator = self.profiles.triangulator();
        let orders = triangulator.calibration().orders.iter().enumerate();
        orders.filter(|(_, order)| **order != point.order).any(|(order_idx, &order)| {
            let hit = triangulator.hit(order_idx, point.seen.u_px, point.seen.v_px);
            let rival = ProfilePoint {
                order,
                hit_in_camera: hit.in_camera,
                noise_sigma_mm: hit.noise_sigma_mm(&point.seen.normal, point.seen.sigma_px),
                ..*point
            };
            self.profiles.depth_range_mm.contains(hit.in_camera.xyz.z)
                && self.surfaces.is_seen_again(&rival, frame)
        })
    }

    /// A doubt reaches as far along its line as the extraction smooths.
    fn spread(&self, points: &[ProfilePoint], doubts: &[bool]) -> Vec<bool> {
        let mut spread = doubts.to_vec();
        for (idx, point) in points.iter().enumerate().filter(|(idx, _)| doubts[*idx]) {
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

/// Whether two points follow one another on one line.
pub fn neighbours(a: &ProfilePoint, b: &ProfilePoint) -> bool {
    let apart_px = (a.seen.u_px - b.seen.u_px).abs().max((a.seen.v_px - b.seen.v_px).abs());
    a.order == b.order && apart_px <= KINK_STEP_PX
}
