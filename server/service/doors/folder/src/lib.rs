//! A door that writes the results of inspections as files, and reads orders.
//!
//! Results: one file per inspection and format in a folder, usually on a network share. A file appears whole or not at
//! all, and none is ever overwritten. Orders: files that others put into a second folder start
//! inspections, each exactly once. A share that does not answer delays neither scans nor inspections. What
//! an inspection is and what its verdict is are decided in `app`.

mod disk;
mod door;
mod orders;
mod params;
mod results;
mod settings;
mod time_limit;

pub use door::open;
pub use settings::{Format, Settings};
