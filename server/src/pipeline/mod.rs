//! From pictures to results, as the command line and the service both do it: same input, same bytes.

mod calibration;
mod scan;

pub use calibration::{Calibrated, calibrate_features, open_capture, read_features};
pub use scan::{capture_frames, check_camera, evaluated_scan, scan_capture};
