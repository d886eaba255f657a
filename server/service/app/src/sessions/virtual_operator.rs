//! The virtual operator of a simulated station: holds the board where a person would.

use std::sync::Arc;

use capture::Target;
use optics::StagePosition;
use twin::{CaptureRequest, Scene, TwinControl};

/// Board poses that the virtual operator takes unless asked for another number.
pub const N_POSES: usize = 12;

/// Hands that put back what lay on the stage when they are done.
pub struct VirtualOperator {
    hands: TwinControl,
    target: Target,
    found: Arc<Scene>,
}

impl VirtualOperator {
    /// Has the station's board, and remembers what lies on the stage.
    pub fn new(hands: TwinControl, target: Target) -> Self {
        let found = hands.scene();
        Self { hands, target, found }
    }

    /// Stage positions at which the board is to be seen.
    pub fn stage_positions(&self) -> Vec<StagePosition> {
        let model = self.hands.model();
        let positions = CaptureRequest::standard(&model).stage_positions;
        positions.into_iter().map(|position| model.stage.kind().position(position)).collect()
    }

    /// The stage at its zero.
    pub fn zero(&self) -> StagePosition {
        self.hands.model().stage.kind().position(0.0)
    }

    /// Holds the board in the pose `pose_idx` of `n_poses`; the stage is at 0.
    pub fn hold_board(&self, pose_idx: usize, n_poses: usize) {
        let n_poses = n_poses.max(pose_idx + 1);
        let mut poses = twin::poses::target_poses(&self.hands.model(), &self.target, n_poses);
        self.hands.place(Scene::Board(poses.swap_remove(pose_idx)));
    }

    /// Lays the board on the stage, so that it is seen wholly at all of `positions`.
    pub fn lay_board(&self, positions: &[StagePosition]) {
        let positions: Vec<f64> = positions.iter().map(|position| position.value()).collect();
        self.hands.place(Scene::Board(twin::poses::stage_target(&self.hands.model(), &self.target, &positions)));
    }
}

impl Drop for VirtualOperator {
    fn drop(&mut self) {
        self.hands.place((*self.found).clone());
    }
}
