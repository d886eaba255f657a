//! Labels held against their rivals: on a part one wrap high a line lies where its neighbour lay on the ground
//! (`docs/maths/labelling.md`, "Rivals").

use crate::checks::compare::Surfaces;
use crate::input::line_step::largest_step_px;
use crate::input::line_widths::Label;
use crate::label::Labels;
use crate::params::{CLOSE_TOLERANCES, COMPARE_STRIDE_PX, CONTRADICTION_TOLERANCES, END_WIDTHS};
use crate::points::profile::ProfilePoint;
use crate::points::profiles::Profiles;

/// The other labels that the points of a scan could have.
#[derive(Clone, Copy)]
pub struct Rivals<'a> {
    profiles: &'a Profiles<'a>,
    surfaces: &'a Surfaces<'a>,
}

impl<'a> Rivals<'a> {
    /// Checks against the surfaces that the labelled points of `profiles` make.
    pub fn new(profiles: &'a Profiles<'a>, surfaces: &'a Surfaces<'a>) -> Self {
        Self { profiles, surfaces }
    }

    /// What other orders have seen of every point; every few columns one point answers for its neighbours.
    pub fn looks(&self, points: &[ProfilePoint], frame: usize) -> Vec<Look> {
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
        let is_seen = |tolerances| self.surfaces.is_seen_again(point, frame, tolerances);
        if is_seen(CLOSE_TOLERANCES) {
            Look::Seen
        } else if !is_seen(CONTRADICTION_TOLERANCES) && self.have_seen(point, frame) {
            Look::RivalSeen
        } else {
            Look::Nobody
        }
    }

    /// The other labels that a point could have.
    pub fn labels(&self, point: &ProfilePoint) -> impl Iterator<Item = Label> {
        let triangulator = self.profiles.triangulator();
        let (u_px, v_px, own) = (point.seen.u_px, point.seen.v_px, point.order);
        let orders = triangulator.calibration().orders.iter().enumerate();
        orders
            .filter(move |(_, order)| **order != own)
            .map(move |(order_idx, &order)| Label {
                order,
                depth_mm: triangulator.hit(order_idx, u_px, v_px).in_camera.xyz.z,
            })
            .filter(|label| self.profiles.depth_range_mm.contains(label.depth_mm))
    }

    /// Whether another label would put the point on a surface that was seen.
    pub fn have_seen(&self, point: &ProfilePoint, frame: usize) -> bool {
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
                && self.surfaces.is_seen_again(&rival, frame, CONTRADICTION_TOLERANCES)
        })
    }

    /// Per point: whether it is in doubt since another label was seen again; that reaches as far along its line as the
    /// extraction smooths.
    pub fn spread(&self, points: &[ProfilePoint], looks: &[Look]) -> Vec<bool> {
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
        self.profiles.labels.along_across(point.order, &point.seen).0.round()
    }
}

/// What other orders, in other frames, have seen of the surface a label puts a point on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// That surface.
    Seen,
    /// The one another label would put it on.
    RivalSeen,
    /// Neither.
    Nobody,
}

/// Scan columns (rows) from one point of a line to the next, at most: one of them may have none.
const NEXT_COLUMNS: f64 = 2.0;

/// Whether two points follow one another on one line of `labels`.
pub fn neighbours(a: &ProfilePoint, b: &ProfilePoint, labels: &Labels) -> bool {
    let direction = labels.direction_of(a.order);
    let ((along_a, across_a), (along_b, across_b)) =
        (a.seen.along_across(direction), b.seen.along_across(direction));
    a.order == b.order
        && (along_a - along_b).abs().round() <= NEXT_COLUMNS
        && (across_a - across_b).abs() <= largest_step_px(&a.seen, labels.line_width_px, direction)
}
