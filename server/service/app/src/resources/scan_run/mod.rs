//! How a scan is made: where its frames come from, how the station takes them, what is measured on it; and the form of
//! it that the record of a scan keeps.

mod input;
mod plan;
mod range;
mod stored;

pub use input::{BackgroundInput, MeasureInput, ScanMode, ScanPurpose, ScanSource};
pub use plan::ScanPlan;
pub use range::{ScanRange, stage_kind};
pub use stored::ScanRun;

#[cfg(test)]
pub(crate) use stored::tests::stored_by_the_station;
