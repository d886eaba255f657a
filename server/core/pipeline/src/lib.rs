//! From pictures to results, for the command line and the service alike: same input, same bytes.
//!
//! The procedures that open captures, read their pictures, calibrate and scan, and their common failure type with cause
//! and remedy. Progress is reported through [`Reporter`]. HTTP, terminals, exit codes and jobs do not belong here.

mod calibrate;
mod document_file;
mod failure;
mod part_axis;
mod pictures;
mod progress;
mod provenance;
mod refusal;
mod scan;

pub use calibrate::{Calibrated, calibrate_features, open_capture, read_features};
pub use document_file::read_document;
pub use failure::{Failure, FailureKind};
pub use part_axis::calibrate_axis;
pub use pictures::background::Background;
pub use pictures::board::{board_geometry, board_remedy, find_board};
pub use pictures::features::{Features, calibration_features};
pub use pictures::findings::{Finding, room_finding};
pub use pictures::lines::{FoundLines, channel_of, lines_of};
pub use pictures::search::{Directions, LineSearch, Region};
pub use pictures::strong_light::StrongLight;
pub use progress::{Reporter, Task};
pub use provenance::extract;
pub use refusal::{failure_of, unusable_document};
pub use scan::{
    check_camera, collected, evaluated_scan, median_mm, scan_capture, write_capture_peaks, write_scan_cloud,
};
