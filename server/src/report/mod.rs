//! Self-contained HTML reports: figures at a glance, plots as inline SVG, pictures as data URIs.

mod calibration;
mod camera;
mod cloud_view;
mod correlation;
mod demo;
mod html;
mod light;
mod measurement;
mod page;
mod pictures;
mod plot;
mod scan;
mod stage;
mod study;

pub use calibration::calibration_page;
pub use demo::demo_page;
pub use scan::scan_page;
pub use study::study_page;
