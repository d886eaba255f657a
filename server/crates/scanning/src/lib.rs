//! From centrelines to a measured surface: order labels, triangulation, registration, clouds, meshes, files.

pub mod cloud;

pub use cloud::{Cloud, CloudPoint};
