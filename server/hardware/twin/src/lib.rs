//! The physically simulated station: camera, laser, grating, stage and parts, rendered to images with known ground
//! truth.
//!
//! Everything derives from a [`StationModel`], which is determined by a seed and a [`StationShape`]. The same model
//! gives the same bytes on any machine and with any number of threads. What the images include and omit:
//! `server/docs/maths/twin.md`. Finding lines, calibrating and measuring do not belong here.

mod arithmetic;
mod model;
mod part;
mod render;
pub use model::{shape, station};
pub use part::{poses, scene};
pub use render::renderer;
pub mod capture_folder;
mod driver;
pub mod live;
pub mod params;
pub mod truth;

pub use capture_folder::{CaptureRequest, Progress, ScanRequest, TwinCaptureError, capture_folder};
pub use driver::{TwinDriver, TwinSettings};
pub use live::{
    FaultNameError, Timing, TwinCamera, TwinControl, TwinFault, TwinLaser, TwinOptions, TwinStage, TwinStation,
};
pub use model::shape::{ProjectorShape, StationShape};
pub use model::station::{StationError, StationModel};
pub use part::board::Board;
pub use part::freeform::Freeform;
pub use part::mesh::{Mesh, Solid, SolidError};
pub use part::print::{Markers, Print};
pub use part::scene::{Gauge, Plate, Scene, SceneHit, SceneKind, Sphere};
pub use part::stl::{PartFileError, STL_MAX_TRIANGLES, read_stl};
pub use render::exposure::{Exposure, ExposureBuffers};
pub use render::renderer::Renderer;
pub use truth::TruthPoint;
