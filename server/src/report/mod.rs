//! Self-contained HTML reports: figures at a glance, plots as inline SVG, pictures as data URIs.

mod calibration;
mod camera;
mod cloud_view;
mod correlation;
mod light;
mod page;
mod pictures;
mod plot;
mod scan;
mod stage;

pub use calibration::calibration_page;
pub use scan::scan_page;
