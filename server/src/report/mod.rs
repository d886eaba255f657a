//! Self-contained HTML reports: figures at a glance, plots as inline SVG, pictures as data URIs.

mod calibration;
mod camera;
mod correlation;
mod light;
mod page;
mod pictures;
mod plot;
mod stage;

pub use calibration::calibration_page;
