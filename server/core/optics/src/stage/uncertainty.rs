//! Uncertainty of a point's position due to the covariance of a turntable's axis and to its angle error
//! (`docs/maths/turntable.md`, eq. 9).

use nalgebra::{DMatrix, Vector3};

use crate::frames::{CameraFrame, PointMm};
use crate::modes::independent_steps;
use crate::stage::{Motion, RotaryAxis, Stage, StagePosition};

/// The stage at one-σ steps of its uncertainties; empty for a linear stage, whose direction shifts all points of a
/// frame equally, and whose straightness and tilt are propagated by the modes of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct StageUncertainty {
    axis: Option<RotaryAxis>,
    stepped: Vec<RotaryAxis>,
    /// One σ of the angle.
    angle_sigma_rad: f64,
}

/// The uncertainties in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameUncertainty {
    motion: Motion,
    stepped: Vec<Motion>,
}

impl StageUncertainty {
    /// `covariance`: of the stage's own parameters.
    pub(crate) fn new(stage: Option<&Stage>, covariance: &DMatrix<f64>) -> Self {
        let Some(Stage::Rotary(axis)) = stage else {
            return Self { axis: None, stepped: Vec::new(), angle_sigma_rad: 0.0 };
        };
        let modes = independent_steps(covariance);
        Self {
            axis: Some(*axis),
            stepped: modes.iter().map(|mode| axis.stepped(mode, &[])).collect(),
            angle_sigma_rad: axis.angle_error.map_or(0.0, |error| error.sigma_rad()),
        }
    }

    /// The uncertainties in a frame; empty for a linear stage.
    pub fn in_frame(&self, position: StagePosition) -> FrameUncertainty {
        let (Some(axis), StagePosition::RotaryDeg(angle_deg)) = (self.axis, position) else {
            return FrameUncertainty { motion: Motion::identity(), stepped: Vec::new() };
        };
        let angle_rad = angle_deg.to_radians();
        let mut stepped: Vec<Motion> = self.stepped.iter().map(|axis| axis.motion(angle_rad)).collect();
        stepped.push(axis.motion(angle_rad + self.angle_sigma_rad));
        FrameUncertainty { motion: axis.motion(angle_rad), stepped }
    }
}

impl FrameUncertainty {
    /// Standard deviation of a point's position in the part frame, along its camera ray, mm.
    pub fn sigma_mm(&self, hit_in_camera: &PointMm<CameraFrame>) -> f64 {
        if self.stepped.is_empty() {
            return 0.0;
        }
        let ray: Vector3<f64> = self.motion.part_direction(&hit_in_camera.xyz.normalize());
        let here = self.motion.part_from_camera(hit_in_camera).xyz;
        let along = |motion: &Motion| ray.dot(&(motion.part_from_camera(hit_in_camera).xyz - here));
        self.stepped.iter().map(|motion| along(motion).powi(2)).sum::<f64>().sqrt()
    }
}
