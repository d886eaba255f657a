//! From pictures to results, as the command line and the service both do it: same input, same bytes.
//!
//! Here live the procedures that open captures, read their pictures, calibrate and scan, and the one type of failure
//! with cause and remedy that they share. What a procedure reports goes through [`Reporter`]. There is no HTTP here, no
//! terminal, no exit code and no job.

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
