//! Parts on the stage, and their intersection with rays.

pub(crate) mod board;
pub(crate) mod freeform;
pub(crate) mod mesh;
pub(crate) mod mesh_corners;
pub(crate) mod pattern;
pub mod poses;
pub(crate) mod print;
pub mod scene;
pub(crate) mod stl;
