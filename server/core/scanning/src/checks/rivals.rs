//! Comparison of labels with their rivals: on a part whose height is one ambiguity interval, a line lies where its
//! neighbour would lie on the ground (`docs/maths/labelling.md`, "Rivals").

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
    /// Checks labels against the surfaces formed by the labelled points of `profiles`.
    pub fn new(profiles: &'a Profiles<'a>, surfaces: &'a Surfaces<'a>) -> Self {
        Self { profiles, surfaces }
    }

    /// Whether other orders confirm the label of every point, or a rival; the result of one point applies to its
    /// neighbours within a few columns.
    pub fn confirmations(&self, points: &[ProfilePoint], frame: usize) -> Vec<Confirmation> {
        let mut confirmations = Vec::with_capacity(points.len());
        let mut last: Option<(i8, i64, Confirmation)> = None;
        for point in points {
            let slot = (self.along(point) as i64).div_euclid(COMPARE_STRIDE_PX as i64);
            let confirmation = match last {
                Some((order, at, confirmation)) if (order, at) == (point.order, slot) => confirmation,
                _ => self.confirmation(point, frame),
            };
            last = Some((point.order, slot, confirmation));
            confirmations.push(confirmation);
        }
        confirmations
    }

    fn confirmation(&self, point: &ProfilePoint, frame: usize) -> Confirmation {
        let nearest_tolerances = self.surfaces.nearest_tolerances(point, frame);
        if nearest_tolerances <= CLOSE_TOLERANCES {
            Confirmation::Confirmed
        } else if nearest_tolerances > CONTRADICTION_TOLERANCES && self.is_rival_confirmed(point, frame) {
            Confirmation::RivalConfirmed
        } else {
            Confirmation::Unconfirmed
        }
    }

    /// The other labels that a point could have.
    pub fn labels(&self, point: &ProfilePoint) -> impl Iterator<Item = Label> {
        let triangulator = self.profiles.triangulator();
        let (u_px, v_px, own) = (point.centreline.u_px, point.centreline.v_px, point.order);
        let orders = triangulator.calibration().orders.iter().enumerate();
        orders
            .filter(move |(_, order)| **order != own)
            .map(move |(order_idx, &order)| Label {
                order,
                depth_mm: triangulator.hit(order_idx, u_px, v_px).in_camera.xyz.z,
            })
            .filter(|label| self.profiles.depth_range_mm.contains(label.depth_mm))
    }

    /// Whether another label would put the point on an observed surface.
    pub fn is_rival_confirmed(&self, point: &ProfilePoint, frame: usize) -> bool {
        let triangulator = self.profiles.triangulator();
        let orders = triangulator.calibration().orders.iter().enumerate();
        orders.filter(|(_, order)| **order != point.order).any(|(order_idx, &order)| {
            let hit = triangulator.hit(order_idx, point.centreline.u_px, point.centreline.v_px);
            let rival = ProfilePoint {
                order,
                hit_in_camera: hit.in_camera,
                noise_sigma_mm: hit.noise_sigma_mm(&point.centreline.normal, point.centreline.sigma_px),
                ..*point
            };
            self.profiles.depth_range_mm.contains(hit.in_camera.xyz.z)
                && self.surfaces.nearest_tolerances(&rival, frame) <= CONTRADICTION_TOLERANCES
        })
    }

    /// Per point: whether it is doubtful because a rival label is confirmed, within the smoothing length along its
    /// line.
    pub fn doubtful(&self, points: &[ProfilePoint], confirmations: &[Confirmation]) -> Vec<bool> {
        let is_doubtful = |confirmation: &Confirmation| *confirmation == Confirmation::RivalConfirmed;
        let mut doubtful: Vec<bool> = confirmations.iter().map(is_doubtful).collect();
        for (idx, point) in points.iter().enumerate().filter(|(idx, _)| is_doubtful(&confirmations[*idx])) {
            let reach_px = END_WIDTHS * f64::from(point.centreline.width_px);
            let is_near = |other: &ProfilePoint| {
                other.order == point.order && (self.along(other) - self.along(point)).abs() <= reach_px
            };
            let before = points[..idx].iter().rev().take_while(|other| is_near(other)).count();
            let after = points[idx..].iter().take_while(|other| is_near(other)).count();
            doubtful[idx - before..idx + after].fill(true);
        }
        doubtful
    }

    fn along(&self, point: &ProfilePoint) -> f64 {
        self.profiles.labels.along_across(point.order, &point.centreline).0.round()
    }
}

/// Which surface other orders have observed, in other frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Confirmation {
    /// The one on which the point's label puts it.
    Confirmed,
    /// The one on which another label would put it.
    RivalConfirmed,
    /// Neither.
    Unconfirmed,
}

/// Scan columns (rows) from one point of a line to the next, at most: one of them may have none.
const NEXT_COLUMNS: f64 = 2.0;

/// Whether two points follow one another on one line of `labels`.
pub fn neighbours(a: &ProfilePoint, b: &ProfilePoint, labels: &Labels) -> bool {
    let direction = labels.direction_of(a.order);
    let ((along_a, across_a), (along_b, across_b)) =
        (a.centreline.along_across(direction), b.centreline.along_across(direction));
    a.order == b.order
        && (along_a - along_b).abs().round() <= NEXT_COLUMNS
        && (across_a - across_b).abs() <= largest_step_px(&a.centreline, labels.line_width_px, direction)
}
