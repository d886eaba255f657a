//! The virtual operator of a simulated station: holds the board as a person would.

use std::sync::Arc;

use capture::Target;
use optics::StagePosition;
use twin::{CaptureRequest, Scene, TwinControl};

/// Default number of board poses.
pub const N_POSES: usize = 12;

/// The virtual operator; restores the previous scene on drop.
pub struct VirtualOperator {
    twin: TwinControl,
    target: Target,
    found: Arc<Scene>,
}

impl VirtualOperator {
    /// Takes the station's board and stores the current scene.
    pub fn new(twin: TwinControl, target: Target) -> Self {
        let found = twin.scene();
        Self { twin, target, found }
    }

    /// Stage positions for stage views.
    pub fn stage_positions(&self) -> Vec<StagePosition> {
        let model = self.twin.model();
        let positions = CaptureRequest::standard(&model).stage_positions;
        positions.into_iter().map(|position| model.stage.kind().position(position)).collect()
    }

    /// The stage at position 0.
    pub fn zero(&self) -> StagePosition {
        self.twin.model().stage.kind().position(0.0)
    }

    /// Holds the board in the pose `pose_idx` of `n_poses`; the stage is at 0.
    pub fn hold_board(&self, pose_idx: usize, n_poses: usize) {
        let n_poses = n_poses.max(pose_idx + 1);
        let mut poses = twin::poses::target_poses(&self.twin.model(), &self.target, n_poses);
        self.twin.place(Scene::Board(poses.swap_remove(pose_idx)));
    }

    /// Places the board on the stage so that it is fully visible at all `positions`.
    pub fn lay_board(&self, positions: &[StagePosition]) {
        let positions: Vec<f64> = positions.iter().map(|position| position.value()).collect();
        self.twin.place(Scene::Board(twin::poses::stage_target(&self.twin.model(), &self.target, &positions)));
    }
}

impl Drop for VirtualOperator {
    fn drop(&mut self) {
        self.twin.place((*self.found).clone());
    }
}
