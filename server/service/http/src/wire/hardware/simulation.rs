//! Control of the simulated station on the wire.

use serde::{Deserialize, Serialize};
use twin::TwinFault;
use utoipa::ToSchema;

/// Scenes for the simulated stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SceneNameDto {
    /// The empty plate.
    Plate,
    /// A gauge block on the plate.
    Gauge,
    /// A sphere on the plate.
    Sphere,
    /// A freeform surface on the plate.
    Freeform,
}

/// Request to place a scene on the simulated stage.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "scene": "sphere" }))]
pub struct PlaceSceneDto {
    /// The scene.
    pub scene: SceneNameDto,
}

/// What is on the simulated stage.
#[derive(Debug, Serialize, ToSchema)]
pub struct SceneDto {
    /// `plate`, `gauge`, `sphere`, `freeform`, `part` (from an STL file) or `board` (during a calibration).
    #[schema(example = "sphere")]
    pub scene: String,
}

/// A fault of the simulated station.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "name": "lost_frames", "value": 10.0 }))]
pub struct SimulatedFaultDto {
    /// Name, such as `camera_unplugged`; the error for an unknown name lists all names.
    pub name: String,
    /// Magnitude, if the fault has one: every n-th frame, mm, a relative change or a share.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
}

/// The active faults.
#[derive(Debug, Serialize, ToSchema)]
pub struct FaultListDto {
    /// The faults.
    pub items: Vec<SimulatedFaultDto>,
}

impl From<&TwinFault> for SimulatedFaultDto {
    fn from(fault: &TwinFault) -> Self {
        Self { name: fault.name().to_owned(), value: fault.value() }
    }
}
