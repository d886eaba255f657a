//! What a calibration says about itself, as values.
pub(crate) mod document_report;
pub mod report;
