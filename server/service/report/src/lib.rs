//! Reports and tables: what was found, for a person to read.
//!
//! Self-contained HTML with figures at a glance, plots as inline SVG and pictures as data URIs; results as text and as
//! JSON; pictures of lines and clouds. Where they are shown, sent or printed is not known here.

pub mod calibration;
mod chapters;
mod drawing;
pub mod inspection;
pub mod scan;
pub mod tables;
pub mod target_sheet;

pub use chapters::measurement;
pub use drawing::{page, palette, picture, pictures, plot};

pub use calibration::calibration_page;
pub use scan::scan_page;
