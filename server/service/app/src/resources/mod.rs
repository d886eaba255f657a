//! What is kept, kind by kind, and how a record of it is read back.

pub mod calibrations;
pub mod captures;
pub mod labels;
pub mod measurements;
pub mod points_page;
pub mod scan_run;
pub mod stored_scan;
pub mod watches;
