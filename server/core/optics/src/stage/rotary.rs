//! A turntable: X_part = c + R(a, −θ)·(X_camera − c) (`docs/maths/turntable.md`, eq. 1).

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Rotation3, Unit, Vector3};

use crate::frames::{CameraFrame, PartFrame, PointMm};
use crate::rotation::completing_frame;
use crate::stage::{Motion, NodeMode};

/// Number of nodes, evenly spaced around the circle, at which a table's angular deviations are independent: deviations
/// with more than eight periods per revolution are not modelled.
pub const ANGLE_NODES: usize = 8;

/// The rotation axis of a turntable, camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotaryAxis {
    /// A point of the axis, mm; its covariance is smallest near the boards from which it was determined.
    pub point_mm: Vector3<f64>,
    /// Unit vector along the axis: increasing angles rotate the part about it by the right-hand rule.
    pub direction: Vector3<f64>,
    /// Error of the stated angle. `None`: unknown, which is not zero.
    pub angle_error: Option<AngleError>,
}

/// Statistical model of δ(θ), the error of the table's angle: actual minus stated.
///
/// At [`ANGLE_NODES`] nodes around the circle the deviations are independent, with the same σ; between two nodes they
/// are interpolated with weights that keep σ constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleError {
    sigma_rad: f64,
    /// δ at the nodes: zero, except for steps of [`crate::Calibration::stepped`].
    deviations_rad: [f64; ANGLE_NODES],
}

impl RotaryAxis {
    /// An axis through `point_mm` along `direction`, with unknown angle error.
    pub fn new(point_mm: Vector3<f64>, direction: Vector3<f64>) -> Self {
        Self { point_mm, direction: direction.normalize(), angle_error: None }
    }

    /// The motion of the part at `angle_rad`.
    pub fn motion(&self, angle_rad: f64) -> Motion {
        let turned_rad = angle_rad + self.angle_error.map_or(0.0, |error| error.deviation_rad(angle_rad));
        let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(self.direction), turned_rad);
        Motion::rotation_about(turn, &self.point_mm)
    }

    /// A point in the camera frame at `angle_rad`, in the part frame.
    pub fn part_from_camera(&self, hit_in_camera: &PointMm<CameraFrame>, angle_rad: f64) -> PointMm<PartFrame> {
        self.motion(angle_rad).part_from_camera(hit_in_camera)
    }

    /// Distance of a point from the axis, mm.
    pub fn radius_mm(&self, at_mm: &Vector3<f64>) -> f64 {
        (at_mm - self.point_mm).cross(&self.direction).norm()
    }

    /// The same axis, with its point nearest to `at_mm` as reference point.
    pub fn with_point_near(&self, at_mm: &Vector3<f64>) -> Self {
        let along_mm = self.direction.dot(&(at_mm - self.point_mm));
        Self { point_mm: self.point_mm + self.direction * along_mm, ..*self }
    }

    /// Moved by a step of four numbers: the direction tilts by the first two (rad) towards, and the point shifts by the
    /// others (mm) along, the two vectors of [`completing_frame`]; then the deviations at the nodes.
    pub(crate) fn stepped(&self, step: &[f64], deviation_step: &[f64]) -> Self {
        let angle_error = self.angle_error.map(|error| error.stepped(deviation_step));
        Self { angle_error, ..self.moved(&std::array::from_fn(|i| step[i])) }
    }

    /// Independent one-σ steps of the angle at the nodes.
    pub(crate) fn node_modes(&self) -> Vec<NodeMode> {
        let mode = |error: AngleError, node: usize| {
            let mut at_nodes = vec![0.0; ANGLE_NODES];
            at_nodes[node] = error.sigma_rad;
            NodeMode { of_parameters: Vec::new(), at_nodes }
        };
        let of = |error: AngleError| (0..ANGLE_NODES).map(move |node| mode(error, node));
        self.angle_error.into_iter().flat_map(of).collect()
    }

    /// Moved by a step of its four parameters: two tilts, rad, and two shifts, mm.
    pub fn moved(&self, step: &[f64; 4]) -> Self {
        let (first, second) = completing_frame(&self.direction);
        Self {
            point_mm: self.point_mm + first * step[2] + second * step[3],
            direction: (self.direction + first * step[0] + second * step[1]).normalize(),
            angle_error: self.angle_error,
        }
    }
}

impl AngleError {
    /// Deviations of `sigma_rad` at the nodes; `None` unless that is positive and finite.
    pub fn new(sigma_rad: f64) -> Option<Self> {
        (sigma_rad > 0.0 && sigma_rad.is_finite())
            .then_some(Self { sigma_rad, deviations_rad: [0.0; ANGLE_NODES] })
    }

    /// One standard deviation of any angle.
    pub fn sigma_rad(&self) -> f64 {
        self.sigma_rad
    }

    /// δ at an angle.
    pub fn deviation_rad(&self, angle_rad: f64) -> f64 {
        let place = angle_rad.rem_euclid(TAU) / TAU * ANGLE_NODES as f64;
        let before = (place as usize).min(ANGLE_NODES - 1);
        // The squares of the two weights sum to one, so that σ between the nodes is that at the nodes.
        let (towards_next, towards_this) = (FRAC_PI_2 * (place - before as f64)).sin_cos();
        let [this, next] = [before, (before + 1) % ANGLE_NODES].map(|node| self.deviations_rad[node]);
        this * towards_this + next * towards_next
    }

    fn stepped(mut self, step: &[f64]) -> Self {
        for (deviation, change) in self.deviations_rad.iter_mut().zip(step) {
            *deviation += change;
        }
        self
    }
}
