//! Wire types: what clients send and get. Their doc comments are the API's documentation.

pub mod calibrations;
pub mod captures;
pub mod control;
pub mod devices;
pub mod differences;
pub mod events;
pub mod jobs;
pub mod measurement_plan;
pub mod measurements;
pub mod paging;
pub mod profiles;
pub mod scans;
pub mod service;
pub mod simulation;
pub mod station;
