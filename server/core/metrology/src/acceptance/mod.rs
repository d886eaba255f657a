//! Acceptance of a station: what a calibrated artefact shows after VDI/VDE 2634 and ISO 10360-13, and the linearity and
//! repeatability of a plate as makers of line scanners state them.
//!
//! [`probe()`] turns the cloud of one position into figures; [`evaluate()`] compares the figures of all positions with the
//! limits (MPE).

mod dispersion;
mod evaluate;
mod figures;
mod heights;
mod plan;
mod probe;
mod test_uncertainty;
#[cfg(test)]
mod tests;

pub use dispersion::Dispersion;
pub use evaluate::{AcceptanceResult, MissingPositions, PositionError, Quantity, QuantityResult, evaluate};
pub use figures::{Ball, Figures, OrderMean, Plate, Position};
pub use heights::{Linearity, Repeatability};
pub use plan::{
    AcceptancePlan, LinearityTest, PlanFault, PlateTest, Procedure, RepeatabilityTest, SpherePairTest, SphereTest,
};
pub use probe::{ProbeRequest, probe, repeat_difference_mm};
