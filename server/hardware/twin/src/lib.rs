//! The physically simulated station: camera, laser, grating, stage and parts, rendered to images with known truth.
//!
//! Everything follows from a [`StationModel`], which a seed and a [`StationShape`] determine. The same model gives
//! the same bytes on any machine and with any number of threads.
//! What the images show and leave out: `server/docs/maths/twin.md`.

pub mod capture_folder;
pub mod live;
pub mod params;
pub mod poses;
pub mod renderer;
pub mod scene;
pub mod shape;
pub mod station;
pub mod truth;

mod ball_block;
mod band;
mod block;
mod board;
mod board_image;
mod cover;
mod exposure;
mod fan;
mod freeform;
mod freeform_block;
mod laser_image;
mod lit_pixels;
mod mark;
mod mesh;
mod mesh_corners;
mod mesh_light;
mod mesh_view;
mod psf;
mod random;
mod seen;
mod sensor;
mod sheet_map;
mod speckle;
mod stl;
mod trace;
mod ways;

pub use board::Board;
pub use capture_folder::{CaptureRequest, Progress, ScanRequest, TwinCaptureError, capture_folder};
pub use exposure::{Darkroom, Exposure};
pub use freeform::Freeform;
pub use live::{Timing, TwinCamera, TwinControl, TwinFault, TwinLaser, TwinOptions, TwinStage, TwinStation};
pub use mesh::{Mesh, Solid, SolidError};
pub use renderer::Renderer;
pub use scene::{Gauge, Plate, Scene, SceneHit, SceneKind, Sphere};
pub use shape::StationShape;
pub use station::{StationError, StationModel};
pub use stl::{STL_MAX_TRIANGLES, StlError, read_stl};
pub use truth::TruthPoint;
