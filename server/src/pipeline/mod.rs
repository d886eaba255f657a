//! From pictures to results, as the command line and the service both do it: same input, same bytes.

mod calibration;
mod scan;

pub use calibration::{Calibrated, calibrate_features, open_capture, read_features};
pub use scan::{check_camera, collected, evaluated_scan, scan_capture, write_capture_peaks, write_scan_cloud};
