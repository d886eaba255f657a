//! How a scan is made: settings, source of the frames, plan, measurements; and its stored form.

mod input;
mod plan;
mod range;
mod settings;
mod stored;

pub use input::{BackgroundInput, MeasureInput, ScanMode, ScanPurpose, ScanSource};
pub use plan::ScanPlan;
pub use range::{ScanRange, stage_kind};
pub use settings::ScanSettings;
pub use stored::ScanRun;

#[cfg(test)]
pub(crate) use stored::tests::stored_by_the_station;
