//! Stored resources by kind, and how their records are read.

pub mod calibrations;
pub mod captures;
pub mod health;
pub mod inspections;
pub mod labels;
pub mod measurements;
pub mod models;
pub mod points_page;
pub mod recipes;
pub mod scan_run;
pub mod statistics;
pub mod stored_scan;
pub mod studies;
pub mod watches;
