//! From centrelines to a measured surface: order labels, triangulation, registration, clouds, meshes, files.

mod carried;
mod cloud;
mod columns;
mod compare;
mod decision;
pub mod dropped;
pub mod envelope;
mod evaluation;
pub mod files;
mod frames;
mod label;
pub mod mesh;
mod motions;
pub mod params;
pub mod profile;
mod profiles;
mod rivals;
pub mod scan;
mod sigma_table;
mod stage_positions;
pub mod synthetic;
mod threads;

pub use cloud::{Cloud, CloudPoint};
pub use compare::{Closure, ClosureGap, OrderPair};
pub use dropped::{DropReason, Dropped};
pub use envelope::{DepthEnvelope, depth_envelope};
pub use evaluation::Evaluation;
pub use files::{CloudFormat, ContentError, FileError, MeshFormat};
pub use frames::Frames;
pub use mesh::{Mesh, MeshParams, mesh_from_cloud};
pub use profile::{Profile, ProfilePoint, label_frame};
pub use scan::{ScanError, ScanFrame, ScanParams, ScanReport, ScanResult, evaluate_scan, scan_cloud};
pub use stage_positions::StagePositions;
