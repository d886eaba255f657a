//! Capability of measuring systems and of processes, calculated from lists of measured values.
//!
//! Type-1 studies ([`type_1`]), gauge R&R ([`gauge_rr`]), control charts and capability indices ([`spc`]); equations and
//! sources: `server/docs/maths/capability.md`. Values, tolerances and limits of one call share one unit. A value that is
//! `None` or not finite is a missing measurement, and is counted. Parts, inspections and where values come from do not
//! belong here.

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
