//! From images to results, for the command line and the service: the same input gives the same bytes.
//!
//! The procedures that open captures, read their images, calibrate and scan, and their common failure type with
//! cause and remedy. Progress is reported through [`Reporter`]. HTTP, terminals, exit codes and jobs do not belong
//! here.

mod calibrate;
mod document_file;
mod failure;
mod images;
mod part_axis;
mod progress;
mod provenance;
mod refusal;
mod scan;

pub use calibrate::{Calibrated, calibrate_features, open_capture, read_features};
pub use document_file::read_document;
pub use failure::{Failure, FailureKind};
pub use images::background::Background;
pub use images::board::{board_geometry, board_remedy, find_board};
pub use images::features::{Features, calibration_features};
pub use images::findings::{Finding, also_in, scene_change_finding};
pub use images::lines::{FoundLines, channel_of, lines_of};
pub use images::search::{Directions, LineSearch, Region};
pub use images::strong_light::StrongLight;
pub use part_axis::calibrate_axis;
pub use progress::{Reporter, Task};
pub use provenance::extract;
pub use refusal::{failure_of, unusable_document};
pub use scan::{
    WrittenCloud, check_camera, collected, evaluated_scan, median_mm, scan_capture, write_capture_peaks,
    write_scan_cloud,
};
