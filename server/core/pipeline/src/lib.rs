//! From pictures to results, as the command line and the service both do it: same input, same bytes.
//!
//! Here live the procedures that open captures, read their pictures, calibrate and scan, and the one type of failure
//! with cause and remedy that they share. What a procedure reports goes through [`Reporter`]. There is no HTTP here, no
//! terminal, no exit code and no job.

mod background;
mod board;
mod calibrate;
mod document_file;
mod failure;
mod features;
mod findings;
mod lines;
mod progress;
mod provenance;
mod refusal;
mod scan;
mod search;
mod strong_light;

pub use background::Background;
pub use board::{board_geometry, board_remedy, find_board};
pub use calibrate::{Calibrated, calibrate_features, open_capture, read_features};
pub use document_file::read_document;
pub use failure::{Failure, FailureKind};
pub use features::{Features, calibration_features};
pub use findings::{Finding, room_finding};
pub use lines::{FoundLines, channel_of, lines_of};
pub use progress::{Reporter, Task};
pub use provenance::extract;
pub use refusal::{failure_of, unusable_document};
pub use scan::{
    check_camera, collected, evaluated_scan, median_mm, scan_capture, write_capture_peaks, write_scan_cloud,
};
pub use search::{Directions, LineSearch, Region};
pub use strong_light::StrongLight;
