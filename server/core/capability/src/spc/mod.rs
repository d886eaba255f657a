//! Statistical process control: control charts, run rules, capability of a process.

mod chart;
mod normality;
mod process;
mod rules;
mod sigma;
mod specification;

pub use chart::{
    ChartError, ControlLimits, IndividualsChart, MeansChart, beyond_limits, individuals_chart, means_chart,
};
pub use normality::{Normality, anderson_darling};
pub use process::{Indices, Note, ProcessCapability, ProcessError, ProcessRequest, process_capability};
pub use rules::{Rule, Violation, violations};
pub use sigma::{Grouping, SigmaEstimate};
pub use specification::{Nonconforming, SpecificationLimits};
