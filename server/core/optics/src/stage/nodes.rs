//! Random deviations along a travel: independent at nodes, interpolated between them.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

/// Most nodes: each adds three modes per kind of deviation to every uncertainty.
pub const MAX_STAGE_NODES: usize = 8;

/// A vector at nodes that are evenly spaced along the travel.
///
/// Between two nodes it is interpolated with weights that keep its standard deviation constant; beyond the last node it is
/// constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nodes {
    pub(super) first_mm: f64,
    pub(super) last_mm: f64,
    pub(super) n_nodes: usize,
    /// Zero, except for steps of [`crate::Calibration::stepped`].
    values: [Vector3<f64>; MAX_STAGE_NODES],
}

impl Nodes {
    /// `n_nodes` nodes from `first_mm` to `last_mm`; with more than [`MAX_STAGE_NODES`] the spacing is increased. `None`
    /// unless there are at least two nodes and the travel has a length.
    pub(super) fn new(first_mm: f64, last_mm: f64, n_nodes: usize) -> Option<Self> {
        let is_sound = last_mm > first_mm && (last_mm - first_mm).is_finite() && n_nodes >= 2;
        is_sound.then(|| Self {
            first_mm,
            last_mm,
            n_nodes: n_nodes.min(MAX_STAGE_NODES),
            values: [Vector3::zeros(); MAX_STAGE_NODES],
        })
    }

    /// Position halfway between the first and the last node.
    pub(super) fn middle_mm(&self) -> f64 {
        0.5 * (self.first_mm + self.last_mm)
    }

    /// The vector at a stage position.
    pub(super) fn at(&self, position_mm: f64) -> Vector3<f64> {
        let intervals = (self.n_nodes - 1) as f64;
        let place =
            ((position_mm - self.first_mm) / (self.last_mm - self.first_mm) * intervals).clamp(0.0, intervals);
        let before = (place as usize).min(self.n_nodes - 2);
        // The squares of the two weights sum to one, so that σ between the nodes is that at the nodes.
        let (towards_next, towards_this) = (FRAC_PI_2 * (place - before as f64)).sin_cos();
        self.values[before] * towards_this + self.values[before + 1] * towards_next
    }

    /// Moved by three numbers per node.
    pub(super) fn stepped(mut self, step: &[f64]) -> Self {
        for (value, change) in self.values[..self.n_nodes].iter_mut().zip(step.chunks_exact(3)) {
            *value += Vector3::from_column_slice(change);
        }
        self
    }
}
