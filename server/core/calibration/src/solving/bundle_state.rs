//! All estimated quantities of a calibration, as one value.

use nalgebra::Vector3;
use optics::{BoardFrame, CAMERA_PARAMETERS, Camera, CameraFrame, LightSurfaces, Rigid};

use crate::solving::observation::CornerView;

/// Board pose: transforms board points to the camera frame.
pub type BoardPose = Rigid<CameraFrame, BoardFrame>;

/// All estimated quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct BundleState {
    /// Intrinsics and distortion.
    pub camera: Camera,
    /// Light sheets; `None` while only the camera is fitted.
    pub light: Option<LightSurfaces>,
    /// Stage travel per mm; `None` while stage views are free poses.
    pub stage: Option<Vector3<f64>>,
    /// One pose per block.
    pub poses: Vec<BoardPose>,
}

impl BundleState {
    /// Number of light parameters.
    pub fn light_parameters(&self) -> usize {
        self.light.as_ref().map_or(0, LightSurfaces::parameters)
    }

    /// Number of global parameters: camera, light, stage.
    pub fn globals(&self) -> usize {
        CAMERA_PARAMETERS + self.light_parameters() + if self.stage.is_some() { 3 } else { 0 }
    }

    /// The pose of a view: its block's, moved by the stage.
    pub fn pose_of(&self, view: &CornerView) -> BoardPose {
        let pose = self.poses[view.block];
        let travel = self.stage.map_or(Vector3::zeros(), |stage| stage * view.travel_mm);
        Rigid::new(pose.rotation, pose.translation_mm + travel)
    }
}
