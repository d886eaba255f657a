//! From centrelines to a measured surface: order labels, triangulation, registration, clouds, meshes, files.

pub mod cloud;
pub mod files;
pub mod mesh;

pub use cloud::{Cloud, CloudPoint};
pub use files::{CloudFormat, ContentError, FileError, MeshFormat};
pub use mesh::{Mesh, MeshParams, mesh_from_cloud};
