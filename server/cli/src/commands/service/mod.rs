//! Commands of the service: run it, show its configuration, devices and API.

pub mod config;
pub mod devices;
pub mod openapi;
pub mod serve;
