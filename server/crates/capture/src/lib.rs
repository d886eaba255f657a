//! The capture folder `sheaf-capture/1`: what a camera and a stage delivered, as files.
//!
//! Reading validates everything the manifest says and names the entry that is wrong; writing is the twin's and
//! the recorder's side of the same format.

pub mod image_file;
pub mod manifest;

pub use image_file::{ImageFileError, read_grey_image, write_png};
pub use manifest::{
    BoardTarget, CameraFormat, Capture, CaptureError, Frame, Manifest, Pose, Projector, Scan, StageView,
};
