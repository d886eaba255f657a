//! Capability of measuring systems and of processes, calculated from lists of measured values.
//!
//! - [`type_1`]: type-1 study of a measuring system, repeated measurements of one reference part: Cg, Cgk, bias.
//! - [`gauge_rr`]: gauge R&R study of parts × operators × trials, by analysis of variance or by averages and ranges.
//! - [`spc`]: Shewhart control charts, run rules, capability indices of a process, test of normality.
//!
//! Equations and sources: `server/docs/maths/capability.md`; numbers in brackets in the comments are its equations.
//! Values, tolerances and limits of one call share one unit, which is also the unit of standard deviations; indices,
//! percentages and p-values have none. A measured value is an `Option<f64>`: `None`, and also a number that is not
//! finite, is a missing measurement. Missing measurements are counted, never dropped silently.

pub mod control_constants;
mod distributions;
pub mod gauge_rr;
pub mod params;
mod sample;
pub mod spc;
pub mod type_1;

/// Verdict on a measuring system or a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// All requirements are met.
    Capable,
    /// At least one requirement is not met.
    NotCapable,
    /// Too few values, or no scatter between them: no verdict is possible.
    Undecided,
}
