//! Geometry of the light from the laser through the grating to the part and the camera.
//!
//! Units: millimetres, pixels, radians. Pixel (0, 0) is the centre of the top-left pixel. Camera frame: x right, y
//! down, z forward. Mathematics: `server/docs/maths/`. Images, fits and files do not belong here.

pub mod calibration;
pub mod camera;
mod cubic;
pub mod frames;
pub mod grating;
mod modes;
pub mod pencil;
pub mod plane;
pub mod rotation;
pub mod stage;
pub mod surface;
pub mod triangulator;

pub use calibration::{Calibration, DepthRangeMm, TriangulatedPoint};
pub use camera::{CAMERA_PARAMETER_NAMES, CAMERA_PARAMETERS, Camera};
pub use frames::{BoardFrame, CameraFrame, PartFrame, PointMm, Rigid};
pub use grating::{GRATING_PARAMETERS, Grating, LightRay};
pub use pencil::{PENCIL_PARAMETERS, Pencil};
pub use plane::Plane;
pub use stage::{Motion, RotaryAxis, Stage, StageAxis, StageKind, StagePosition};
pub use surface::{LightModelKind, LightSurfaces, SurfaceHit};
pub use triangulator::{Hits, RayHit, Triangulator};
