//! Scans, captures and recordings on the wire.

pub mod captures;
pub mod profiles;
pub mod recordings;
pub mod scan_reports;
pub mod scan_runs;
pub mod scans;
pub mod settings;
pub mod watches;
