//! From centrelines to a measured surface: order labels, triangulation, registration, clouds, meshes, files.
//!
//! Also what a scan reveals about its station: contradictions between orders, lost steps, drift. Finding lines in images,
//! calibration and fits to parts do not belong here.

mod axis;
mod checks;
mod error;
mod evaluation;
pub mod files;
mod input;
mod label;
pub mod mesh;
pub mod params;
mod points;
mod report;
pub mod scan;
mod threads;
mod watches;

pub use input::synthetic;
pub use points::{dropped, envelope, profile};

pub use axis::{PartAxis, PartAxisError, axis_from_part};
pub use checks::compare::{Closure, ClosureGap, OrderPair};
pub use error::{ContentError, ScanError};
pub use evaluation::Evaluation;
pub use files::{CloudFormat, FileError, MeshFormat};
pub use input::exposures::{ExposureLines, FusionCounts, fuse_exposures};
pub use input::frames::{Frames, ScanFrame};
pub use input::stage_positions::StagePositions;
pub use mesh::{Mesh, MeshParams, mesh_from_cloud};
pub use points::cloud::{Cloud, CloudPoint};
pub use points::dropped::{DropReason, Dropped};
pub use points::envelope::{DepthEnvelope, depth_envelope};
pub use points::profile::{Profile, ProfilePoint, label_frame};
pub use report::ScanReport;
pub use scan::{ScanParams, ScanResult, evaluate_scan, scan_cloud};
pub use watches::{
    Drift, Estimate, FrameReducer, FrameSamples, LostSteps, LostStepsWatch, OrderPowers, PowerReference, Watch,
    WatchReason, WatchReport, WatchState, WatchVerdict, verdicts, watch_scan, with_wavelength_changed,
};
