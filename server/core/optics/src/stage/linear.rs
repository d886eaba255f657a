//! A linear stage: X_part = X_camera − s·t − w(s).

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use crate::frames::{CameraFrame, PartFrame, PointMm};
use crate::stage::Motion;

/// Most nodes of a [`Straightness`]: each adds three modes to every uncertainty.
pub const MAX_STRAIGHTNESS_NODES: usize = 8;

/// The stage's travel in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageAxis {
    /// t: motion of the part in the camera frame per millimetre of nominal travel (mm/mm); its length differs from 1 by
    /// the stage's scale error.
    pub direction: Vector3<f64>,
    /// Straightness of the travel. `None`: unknown, which is not zero; an uncertainty along the travel is then
    /// incomplete.
    pub straightness: Option<Straightness>,
}

/// Statistical model of w(s), the deviation from straight and uniform travel at position s, camera frame, mm.
///
/// At nodes, evenly spaced along the travel, the deviations are independent, with the same σ along all three axes;
/// between two nodes they are interpolated with weights that keep σ constant; beyond the last node they are constant.
/// The standard deviation between positions a distance L apart is therefore σ·√(2(1 − ρ(L))) along every axis, with ρ
/// falling from 1 to 0 over one to two node spacings. Deviations with a shorter period than the spacing are not
/// modelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Straightness {
    sigma_mm: f64,
    first_mm: f64,
    last_mm: f64,
    n_nodes: usize,
    /// w at the nodes: zero, except for steps of [`crate::Calibration::stepped`].
    deviations_mm: [Vector3<f64>; MAX_STRAIGHTNESS_NODES],
}

impl StageAxis {
    /// An axis whose straightness is unknown.
    pub fn new(direction: Vector3<f64>) -> Self {
        Self { direction, straightness: None }
    }

    /// A point in the camera frame at stage position `position_mm`, in the part frame.
    pub fn part_from_camera(&self, hit_in_camera: &PointMm<CameraFrame>, position_mm: f64) -> PointMm<PartFrame> {
        self.motion(position_mm).part_from_camera(hit_in_camera)
    }

    /// The motion of the part at `position_mm`.
    pub fn motion(&self, position_mm: f64) -> Motion {
        Motion::translation(self.direction * position_mm + self.deviation_mm(position_mm))
    }

    /// Moved by a step of the direction and of the deviations at the nodes.
    pub(crate) fn stepped(&self, step: &[f64], deviation_step: &[f64]) -> Self {
        let straightness = self.straightness.map(|straightness| straightness.stepped(deviation_step));
        Self { direction: self.direction + Vector3::from_column_slice(step), straightness }
    }

    /// Deviation from straight travel at a stage position: zero, except for steps of [`crate::Calibration::stepped`].
    pub fn deviation_mm(&self, position_mm: f64) -> Vector3<f64> {
        self.straightness.map_or(Vector3::zeros(), |straightness| straightness.deviation_mm(position_mm))
    }
}

impl Straightness {
    /// Deviations of `sigma_mm` per axis at `n_nodes` nodes from `first_mm` to `last_mm`; with more than
    /// [`MAX_STRAIGHTNESS_NODES`] the spacing is increased. `None` unless σ is positive, there are at least two nodes
    /// and the travel has a length.
    pub fn new(sigma_mm: f64, first_mm: f64, last_mm: f64, n_nodes: usize) -> Option<Self> {
        let is_sound = sigma_mm > 0.0 && sigma_mm.is_finite() && last_mm > first_mm && n_nodes >= 2;
        (is_sound && (last_mm - first_mm).is_finite()).then(|| Self {
            sigma_mm,
            first_mm,
            last_mm,
            n_nodes: n_nodes.min(MAX_STRAIGHTNESS_NODES),
            deviations_mm: [Vector3::zeros(); MAX_STRAIGHTNESS_NODES],
        })
    }

    /// One standard deviation along every axis.
    pub fn sigma_mm(&self) -> f64 {
        self.sigma_mm
    }

    /// Positions of the first and the last node.
    pub fn ends_mm(&self) -> (f64, f64) {
        (self.first_mm, self.last_mm)
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.n_nodes
    }

    /// Variance per axis, mm² per mm², of the slope of a straight line through the deviations: the uncertainty of a
    /// direction fitted to as many views as there are nodes.
    pub fn slope_variance(&self) -> f64 {
        let shares = (0..self.n_nodes).map(|node| self.slope_weight(node).powi(2));
        self.sigma_mm * self.sigma_mm * shares.sum::<f64>()
    }

    /// Weight of the deviation at a node in the slope of the line through all nodes, per mm: for n nodes d apart, (k −
    /// (n − 1)/2)·12 / (d·n(n² − 1)).
    pub(crate) fn slope_weight(&self, node: usize) -> f64 {
        let n = self.n_nodes as f64;
        let spacing_mm = (self.last_mm - self.first_mm) / (n - 1.0);
        12.0 * (node as f64 - 0.5 * (n - 1.0)) / (spacing_mm * n * (n * n - 1.0))
    }

    /// w at a stage position.
    pub fn deviation_mm(&self, position_mm: f64) -> Vector3<f64> {
        let intervals = (self.n_nodes - 1) as f64;
        let place =
            ((position_mm - self.first_mm) / (self.last_mm - self.first_mm) * intervals).clamp(0.0, intervals);
        let before = (place as usize).min(self.n_nodes - 2);
        // The squares of the two weights sum to one, so that σ between the nodes is that at the nodes.
        let (towards_next, towards_this) = (FRAC_PI_2 * (place - before as f64)).sin_cos();
        self.deviations_mm[before] * towards_this + self.deviations_mm[before + 1] * towards_next
    }

    /// Moved by a step of three numbers per node.
    pub(crate) fn stepped(mut self, step: &[f64]) -> Self {
        for (deviation, change) in self.deviations_mm[..self.n_nodes].iter_mut().zip(step.chunks_exact(3)) {
            *deviation += Vector3::from_column_slice(change);
        }
        self
    }
}
