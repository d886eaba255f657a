//! From a cloud to a measured part: fits, values with their uncertainty, verdicts.
//!
//! [`measure`] finds the features a [`Tool`] needs in a cloud that holds table and object together, fits them by
//! robust weighted geometric least squares, and states the value with an expanded uncertainty (k = 2).
//! Units: millimetres, degrees for the tool `angle`; frame: the cloud's (part) frame.

mod budget;
mod doubts;
mod features;
mod find;
mod fit;
mod fitness;
mod footprint;
mod form;
mod measure;
mod measurement;
mod noise;
mod orders;
mod outline;
pub mod params;
mod part_verdict;
mod ransac;
mod request;
mod robust;
mod sample;
mod shape;
mod systematic;
mod temperature;
mod value;
mod verdict;

pub use doubts::{Finding, Missing};
pub use measure::measure;
pub use measurement::{ErrorSummary, FittedFeature, Measurement, OrderRow, Unit};
pub use part_verdict::{CharacteristicKey, PartVerdict, part_verdict};
pub use request::{MeasureError, MeasureRequest, Region, Tool};
pub use shape::Shape;
pub use verdict::{Verdict, verdict};

#[cfg(test)]
mod tests;
