//! Reports of calibrations.
pub(crate) mod document_report;
pub mod report;
