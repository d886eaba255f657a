//! The capture folder `sheaf-capture/1`: the output of a camera and a stage, as files.
//!
//! Reading validates the whole manifest and names the entry that is wrong; the twin and the recorder write the same
//! format. What the images show, and recordings, do not belong here.

pub mod channel;
pub mod error;
pub mod folder;
pub mod image_file;
pub mod manifest;
pub mod params;
pub mod projector;
pub mod stage;
pub mod target;

mod checks;
mod contained_path;
mod json_text;
mod known_keys;
mod target_check;

pub use channel::{ChannelBasis, ChannelChoice, LaserChannel};
pub use error::CaptureError;
pub use folder::{Capture, LaserImage, NamedFile, lossy_warning, write_manifest};
pub use image_file::{
    ImageFileError, ImageHeader, Photograph, read_grey_image, read_photograph, sha256_of, white_level_of,
    write_png,
};
pub use manifest::{CameraFormat, Frame, Manifest, Pose, Scan, StageView};
pub use projector::{CrossProjector, GratingProjector, PlanesProjector, Projector, ProjectorError};
pub use stage::{NominalPosition, StageDescription, StageKind};
pub use target::{CharucoTarget, ChessboardTarget, CirclesTarget, SquareMm, Target};
pub use target_check::TargetError;
