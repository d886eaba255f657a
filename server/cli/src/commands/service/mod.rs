//! The service, and what it is set up with.

pub mod config;
pub mod devices;
pub mod openapi;
pub mod serve;
