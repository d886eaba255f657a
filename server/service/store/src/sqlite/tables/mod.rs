//! Reading and writing of rows, one module per kind of record.

pub mod calibrations;
pub mod captures;
pub mod doors;
pub mod events;
pub mod inspections;
pub mod jobs;
pub mod measurements;
pub mod models;
pub mod recipes;
pub mod recordings;
pub mod scans;
pub mod sessions;
pub mod settings;
pub mod studies;
