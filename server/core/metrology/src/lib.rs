//! Measures a part in a point cloud: fits, values with their uncertainty, verdicts.
//!
//! [`measure`] finds the features a [`Tool`] needs in a cloud that contains both table and object, fits them by
//! robust weighted geometric least squares, and states the value with an expanded uncertainty (k = 2).
//! Units: millimetres, degrees for the tool `angle`; frame: the cloud's (part) frame. Images, calibrations and recipes
//! do not belong here.

pub mod acceptance;
mod cad;
mod evaluation;
mod fitting;
mod interface;
mod measuring;
pub mod params;
mod plan;
mod results;

pub use interface::findings::{Finding, Missing};
pub use interface::measurement::{ErrorSummary, FittedFeature, Measurement, OrderRow, Unit};
pub use interface::part_verdict::{CharacteristicKey, PartVerdict, part_verdict};
pub use interface::region::Region;
pub use interface::request::{MeasureError, MeasureRequest, Tool};
pub use interface::shape::Shape;
pub use interface::verdict::{Limits, Verdict, verdict};
pub use measuring::measure::measure;

pub use cad::compare::compare;
pub use cad::comparison::{AlignTo, CompareRequest, Comparison};
pub use cad::nominal::{Nominal, NominalError};
pub use cad::statistics::{DeviationStatistics, LargestDeviation, WorstDeviation};
pub use evaluation::alignment::DatumFrame;
pub use evaluation::geometry::Geometry;
pub use plan::alignment::Alignment;
pub use plan::characteristic::{Axis, Characteristic, Measure, ModelRef};
pub use plan::check::PlanError;
pub use plan::document::{Plan, PlanDocumentError, PlanFormat};
pub use plan::feature::{Facing, Feature, FeatureShape, LineOf, PointOf, Selection};
pub use results::evaluate::evaluate;
pub use results::result::{CharacteristicResult, FeatureResult, PlanResult};
pub use results::surface_profile::Models;

#[cfg(test)]
mod tests;
