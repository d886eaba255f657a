//! Bodies of the events of the station: control, live view, devices, simulated faults.

use devices::StageKind;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::initiator::Initiator;
use crate::camera::memory::StoredCameraSettings;

/// A takeover of control.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ControlTakenOver {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Previous holder.
    pub from: String,
    /// New holder.
    pub to: String,
}

/// The live view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LiveView {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Fraction of full laser power, 0 to 1.
    pub laser_power: f64,
}

/// A manual motion of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageMotion {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Target position of a linear stage, if the motion has one.
    pub target_mm: Option<f64>,
    /// Target angle of a rotary stage, if the motion has one.
    pub target_deg: Option<f64>,
    /// Speed of a linear stage.
    pub speed_mm_s: Option<f64>,
    /// Speed of a rotary stage.
    pub speed_deg_s: Option<f64>,
}

/// A value in the unit of the stage as two fields: millimetres of a linear stage, degrees of a rotary one.
pub fn by_kind<T>(kind: StageKind, value: Option<T>) -> (Option<T>, Option<T>) {
    match kind {
        StageKind::Linear => (value, None),
        StageKind::Rotary => (None, value),
    }
}

/// A manual change of the laser power.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LaserSwitched {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Fraction of full power, 0 to 1.
    pub power: f64,
}

/// The camera settings after a change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraConfigured {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// The accepted settings.
    pub settings: StoredCameraSettings,
}

/// A dark frame of the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraDarkFrameTaken {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Hot pixels.
    pub n_hot_pixels: usize,
}

/// Camera features set by name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CameraFeaturesSet {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// The features, in the order of the request.
    pub features: Vec<FeatureSet>,
}

/// A feature as read back from the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureSet {
    /// Its name.
    pub name: String,
    /// Value as text; absent for commands and unreadable features.
    pub value: Option<String>,
}

/// A fault of the simulated station.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SimulatedFault {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Magnitude, if the fault has one.
    pub value: Option<f64>,
}
