//! Reports and tables of results.
//!
//! Self-contained HTML with headline figures, plots as inline SVG and images as data URIs; PDF; certificates of
//! calibrations as XML; results as text and JSON; images of lines and clouds. This crate does not depend on where they
//! are shown, sent or printed.

pub mod calibration;
pub mod certificate;
mod chapters;
mod comparison;
mod drawing;
pub mod inspection;
pub mod scan;
pub mod study;
pub mod tables;
pub mod target_sheet;

pub use chapters::dark_frame::{ImageCorrection, UsedDarkFrame};
pub use chapters::measurement;
pub use drawing::{labelled_images, page, palette, plot, raster};

pub use calibration::calibration_page;
pub use comparison::comparison_page;
pub use scan::scan_page;
