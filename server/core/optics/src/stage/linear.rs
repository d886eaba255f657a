//! A linear stage: X_part = X_camera − s·t − w(s), turned back by θ(s) (`docs/maths/calibration.md`, eq. 8–11, 15, 16).

use nalgebra::{Rotation3, Vector3};

use crate::frames::{CameraFrame, PartFrame, PointMm};
use crate::stage::nodes::Nodes;
use crate::stage::{Motion, NodeMode};

/// The stage's travel in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageAxis {
    /// t: motion of the part in the camera frame per millimetre of nominal travel (mm/mm); its length differs from 1 by
    /// the stage's scale error.
    pub direction: Vector3<f64>,
    /// Straightness of the travel. `None`: unknown, which is not zero; an uncertainty along the travel is then
    /// incomplete.
    pub straightness: Option<Straightness>,
    /// Pitch, yaw and roll of the travel. `None`: unknown, as for straightness.
    pub tilt: Option<Tilt>,
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
    nodes: Nodes,
}

/// Statistical model of θ(s), the rotation of the carriage at position s (pitch, yaw and roll), camera frame: at every node
/// of the travel it is an independent sum of three rotation vectors, interpolated as [`Straightness`] is.
///
/// A place at r from the centre of the board that determined the straightness deviates by w(s) + θ(s) × r: the Abbe error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tilt {
    sigmas_rad: [Vector3<f64>; 3],
    centre_mm: Vector3<f64>,
    nodes: Nodes,
}

impl StageAxis {
    /// An axis whose straightness and tilt are unknown.
    pub fn new(direction: Vector3<f64>) -> Self {
        Self { direction, straightness: None, tilt: None }
    }

    /// A point in the camera frame at stage position `position_mm`, in the part frame.
    pub fn part_from_camera(&self, hit_in_camera: &PointMm<CameraFrame>, position_mm: f64) -> PointMm<PartFrame> {
        self.motion(position_mm).part_from_camera(hit_in_camera)
    }

    /// The motion of the part at `position_mm`.
    pub fn motion(&self, position_mm: f64) -> Motion {
        let middle_mm = self.nodes_middle_mm();
        self.motion_from_middle(position_mm - middle_mm).after(&(self.direction * middle_mm))
    }

    /// The motion of the part over `travel_mm` from the middle of the nodes of straightness and tilt.
    pub fn motion_from_middle(&self, travel_mm: f64) -> Motion {
        let position_mm = self.nodes_middle_mm() + travel_mm;
        let deviation = self.straightness.map_or(Vector3::zeros(), |known| known.deviation_mm(position_mm));
        let shift = self.direction * travel_mm + deviation;
        match self.tilt.map(|tilt| (tilt.rotation(position_mm), tilt.centre_mm)) {
            None => Motion::translation(shift),
            Some((turn, _)) if turn == Vector3::zeros() => Motion::translation(shift),
            Some((turn, centre)) => Motion::rotation_about(Rotation3::new(turn), &centre).then_by(&shift),
        }
    }

    /// Middle of the nodes; 0 without.
    fn nodes_middle_mm(&self) -> f64 {
        let nodes = self.straightness.map(|known| known.nodes).or(self.tilt.map(|known| known.nodes));
        nodes.map_or(0.0, |nodes| nodes.middle_mm())
    }

    /// Independent one-σ steps of the deviations and the rotations at the nodes. A deviation also rotates the line through
    /// all nodes, which its step subtracts.
    pub(crate) fn node_modes(&self) -> Vec<NodeMode> {
        let n_deviations = 3 * self.straightness.map_or(0, |known| known.n_nodes());
        let n_rotations = 3 * self.tilt.map_or(0, |known| known.n_nodes());
        let at = |idx: usize, value: &Vector3<f64>| {
            let mut at_nodes = vec![0.0; n_deviations + n_rotations];
            at_nodes[idx..idx + 3].copy_from_slice(value.as_slice());
            at_nodes
        };
        let mut modes = Vec::new();
        for (straightness, idx) in
            self.straightness.iter().flat_map(|known| (0..n_deviations).map(move |idx| (known, idx)))
        {
            let (node, axis) = (idx / 3, idx % 3);
            let deviation = Vector3::ith(axis, straightness.sigma_mm);
            let of_parameters = (-straightness.slope_weight(node) * deviation).as_slice().to_vec();
            modes.push(NodeMode { of_parameters, at_nodes: at(3 * node, &deviation) });
        }
        for (tilt, node) in self.tilt.iter().flat_map(|known| (0..known.n_nodes()).map(move |node| (known, node)))
        {
            for rotation in tilt.sigmas_rad.iter().filter(|rotation| **rotation != Vector3::zeros()) {
                let at_nodes = at(n_deviations + 3 * node, rotation);
                modes.push(NodeMode { of_parameters: Vec::new(), at_nodes });
            }
        }
        modes
    }

    /// Moved by a step of the direction, then of the deviations and the rotations at the nodes.
    pub(crate) fn stepped(&self, step: &[f64], node_step: &[f64]) -> Self {
        let n_deviations = 3 * self.straightness.map_or(0, |known| known.n_nodes()).min(node_step.len() / 3);
        let (deviation_step, rotation_step) = node_step.split_at(n_deviations);
        Self {
            direction: self.direction + Vector3::from_column_slice(step),
            straightness: self.straightness.map(|known| known.stepped(deviation_step)),
            tilt: self.tilt.map(|known| known.stepped(rotation_step)),
        }
    }
}

impl Straightness {
    /// Deviations of `sigma_mm` per axis at `n_nodes` nodes from `first_mm` to `last_mm`; with more than
    /// [`MAX_STAGE_NODES`](crate::stage::MAX_STAGE_NODES) the spacing is increased. `None` unless σ is positive, there are
    /// at least two nodes and the travel has a length.
    pub fn new(sigma_mm: f64, first_mm: f64, last_mm: f64, n_nodes: usize) -> Option<Self> {
        let nodes = Nodes::new(first_mm, last_mm, n_nodes)?;
        (sigma_mm > 0.0 && sigma_mm.is_finite()).then_some(Self { sigma_mm, nodes })
    }

    /// One standard deviation along every axis.
    pub fn sigma_mm(&self) -> f64 {
        self.sigma_mm
    }

    /// Positions of the first and the last node.
    pub fn ends_mm(&self) -> (f64, f64) {
        (self.nodes.first_mm, self.nodes.last_mm)
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.nodes.n_nodes
    }

    /// Variance per axis, mm² per mm², of the slope of a straight line through the deviations: the uncertainty of a
    /// direction fitted to as many views as there are nodes.
    pub fn slope_variance(&self) -> f64 {
        let shares = (0..self.n_nodes()).map(|node| self.slope_weight(node).powi(2));
        self.sigma_mm * self.sigma_mm * shares.sum::<f64>()
    }

    /// Weight of the deviation at a node in the slope of the line through all nodes, per mm: for n nodes d apart, (k −
    /// (n − 1)/2)·12 / (d·n(n² − 1)).
    pub(crate) fn slope_weight(&self, node: usize) -> f64 {
        let n = self.n_nodes() as f64;
        let spacing_mm = (self.nodes.last_mm - self.nodes.first_mm) / (n - 1.0);
        12.0 * (node as f64 - 0.5 * (n - 1.0)) / (spacing_mm * n * (n * n - 1.0))
    }

    /// w at a stage position.
    pub fn deviation_mm(&self, position_mm: f64) -> Vector3<f64> {
        self.nodes.at(position_mm)
    }

    fn stepped(self, step: &[f64]) -> Self {
        Self { nodes: self.nodes.stepped(step), ..self }
    }
}

impl Tilt {
    /// Rotations at `n_nodes` nodes from `first_mm` to `last_mm`, with one standard deviation of each independent part in
    /// `sigmas_rad` (rotation vectors), about `centre_mm`: the place whose deviations are the straightness, at the middle of
    /// the nodes, camera frame. `None` unless some σ is positive and all are finite, there are at least two nodes and the
    /// travel has a length.
    pub fn new(
        sigmas_rad: [Vector3<f64>; 3],
        centre_mm: Vector3<f64>,
        (first_mm, last_mm): (f64, f64),
        n_nodes: usize,
    ) -> Option<Self> {
        let nodes = Nodes::new(first_mm, last_mm, n_nodes)?;
        let largest = sigmas_rad.iter().map(Vector3::norm).fold(0.0, f64::max);
        let is_finite = sigmas_rad.iter().chain([&centre_mm]).flatten().all(|value| value.is_finite());
        (largest > 0.0 && is_finite).then_some(Self { sigmas_rad, centre_mm, nodes })
    }

    /// Three independent rotation vectors of one standard deviation.
    pub fn sigmas_rad(&self) -> &[Vector3<f64>; 3] {
        &self.sigmas_rad
    }

    /// Centre of the rotations, at the middle of the nodes, camera frame.
    pub fn centre_mm(&self) -> &Vector3<f64> {
        &self.centre_mm
    }

    /// Positions of the first and the last node.
    pub fn ends_mm(&self) -> (f64, f64) {
        (self.nodes.first_mm, self.nodes.last_mm)
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.nodes.n_nodes
    }

    /// θ at a stage position, a rotation vector in rad.
    pub fn rotation(&self, position_mm: f64) -> Vector3<f64> {
        self.nodes.at(position_mm)
    }

    fn stepped(self, step: &[f64]) -> Self {
        Self { nodes: self.nodes.stepped(step), ..self }
    }
}
