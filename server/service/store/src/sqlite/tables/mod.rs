//! One kind of record each: its rows, read and changed.

pub mod calibrations;
pub mod captures;
pub mod events;
pub mod jobs;
pub mod measurements;
pub mod recordings;
pub mod scans;
pub mod sessions;
pub mod settings;
