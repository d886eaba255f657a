//! The hands at the simulated station, on the wire.

use serde::{Deserialize, Serialize};
use twin::TwinFault;
use utoipa::ToSchema;

/// What can be put on the simulated stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SceneNameDto {
    /// The bare plate.
    Plate,
    /// A gauge block on the plate.
    Gauge,
    /// A ball on the plate.
    Sphere,
    /// Smooth hills on the plate.
    Freeform,
}

/// What shall lie on the simulated stage.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "scene": "sphere" }))]
pub struct PlaceSceneDto {
    /// What.
    pub scene: SceneNameDto,
}

/// What lies on the simulated stage.
#[derive(Debug, Serialize, ToSchema)]
pub struct SceneDto {
    /// `plate`, `gauge`, `sphere`, `freeform`, `part` from an STL file, `board` while a calibration moves it.
    #[schema(example = "sphere")]
    pub scene: String,
}

/// A fault of the simulated station.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "name": "lost_frames", "value": 10.0 }))]
pub struct FaultSwitchDto {
    /// Its name, such as `camera_unplugged`; a wrong one is answered with all names.
    pub name: String,
    /// Its number, if it has one: every n-th frame, mm, a relative change, a share.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
}

/// The faults that are switched on.
#[derive(Debug, Serialize, ToSchema)]
pub struct FaultListDto {
    /// The faults.
    pub items: Vec<FaultSwitchDto>,
}

impl From<&TwinFault> for FaultSwitchDto {
    fn from(fault: &TwinFault) -> Self {
        Self { name: fault.name().to_owned(), value: fault.value() }
    }
}
