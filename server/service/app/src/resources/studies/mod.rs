//! Studies of how well the station measures: acceptance tests from scans of calibrated artefacts, and capability of the
//! measuring system from repeated inspections.
//!
//! A study is a stored plan. An acceptance test also stores the figures of its positions; the others find their values
//! among the inspections whenever they are read.

mod figures;
mod outcome;
mod plan;
mod readings;
mod sheet;
mod study;

pub use figures::{position_figures, repeat_difference_mm};
pub use outcome::{Found, MissingInspections, Outcome, outcome, outcome_without_inspections};
pub use plan::{GaugeRrPlan, StudyPlan, Type1Plan};
pub use readings::Selected;
pub use sheet::study_report;
pub use study::{Study, StudyBody, StudyPosition};
