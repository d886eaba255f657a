//! What a calibration says: document, report, differences.

pub mod difference;
pub mod document;
pub(crate) mod document_report;
pub mod report;
pub(crate) mod reporting;
