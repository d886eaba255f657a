//! Reports and tables: what was found, for a person to read.
//!
//! Self-contained HTML with figures at a glance, plots as inline SVG and pictures as data URIs; results as text and as
//! JSON; pictures of lines and clouds. Where they are shown, sent or printed is not known here.

pub mod calibration;
mod camera;
mod cloud_view;
mod correlation;
pub mod html;
mod light;
pub mod measurement;
pub mod page;
pub mod palette;
pub mod picture;
pub mod pictures;
pub mod plot;
pub mod scan;
mod stage;
pub mod tables;
pub mod target_sheet;
mod turntable;

pub use calibration::calibration_page;
pub use scan::scan_page;
