//! From a cloud to a measured part: fits, values with their uncertainty, verdicts.
//!
//! [`measure`] finds the features a [`Tool`] needs in a cloud that holds table and object together, fits them by
//! robust weighted geometric least squares, and states the value with an expanded uncertainty (k = 2).
//! Units: millimetres, degrees for the tool `angle`; frame: the cloud's (part) frame.

mod fitting;
mod interface;
mod measuring;
pub mod params;

pub use interface::doubts::{Finding, Missing};
pub use interface::measurement::{ErrorSummary, FittedFeature, Measurement, OrderRow, Unit};
pub use interface::part_verdict::{CharacteristicKey, PartVerdict, part_verdict};
pub use interface::request::{MeasureError, MeasureRequest, Region, Tool};
pub use interface::shape::Shape;
pub use interface::verdict::{Verdict, verdict};
pub use measuring::measure::measure;

#[cfg(test)]
mod tests;
