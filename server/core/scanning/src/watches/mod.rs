//! Watches: checks of the station from several orders, each of which observes a place of the part at another position
//! of the stage.
//! `docs/maths/watches.md`.

mod drift;
mod fit;
mod lost_steps;
mod order_powers;
mod places;
mod strips;
mod verdicts;

pub use drift::{Drift, Estimate, with_wavelength_changed};
pub use lost_steps::{LostSteps, LostStepsWatch};
pub use order_powers::OrderPowers;
pub use verdicts::{PowerReference, Watch, WatchReason, WatchState, WatchVerdict, verdicts};

use optics::Calibration;

use crate::error::ScanError;
use crate::evaluation::Evaluation;
use places::Strips;
use strips::Condenser;

/// Results of the watches for a scan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WatchReport {
    /// Lost steps, in the order of travel.
    pub lost_steps: Vec<LostSteps>,
    /// The smallest loss that would have been detected on most of this part, mm; `None` where none would.
    pub smallest_loss_mm: Option<f64>,
    /// Drift of wavelength and stage since the calibration; `None` where two orders hardly observed the same places.
    pub drift: Option<Drift>,
    /// Powers of the orders; `None` where two orders hardly observed the same places.
    pub powers: Option<OrderPowers>,
    /// Extent of the observed surface along the travel, mm.
    pub length_mm: f64,
}

/// Runs the watches on an evaluated scan. `None` on stations without a linear stage.
///
/// # Errors
/// [`ScanError::UnreadableFrame`].
pub fn watch_scan(evaluation: &Evaluation, calibration: &Calibration) -> Result<Option<WatchReport>, ScanError> {
    let (Some(condenser), Some(mut steps)) = (Condenser::new(calibration), LostStepsWatch::new(calibration))
    else {
        return Ok(None);
    };
    let mut strips = Strips::new(condenser.clone());
    let mut report = WatchReport::default();
    evaluation.for_each_profile(
        |frame, points, motion, position_mm| (condenser.samples(points, motion, position_mm, frame), position_mm),
        |(samples, position_mm)| {
            strips.add(&samples);
            report.lost_steps.extend(steps.note_samples(samples, position_mm));
        },
    )?;
    report.smallest_loss_mm = steps.smallest_noticed_mm();
    report.drift = drift::drift(&strips, calibration);
    report.powers = order_powers::order_powers(&strips);
    report.length_mm = strips.length_mm();
    Ok(Some(report))
}
