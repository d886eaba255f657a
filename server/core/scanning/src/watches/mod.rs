//! Watches: checks of the station from several orders, each of which observes a point of the part at another
//! position of the stage. `docs/maths/watches.md`.

mod drift;
mod fit;
mod lost_steps;
mod order_powers;
mod places;
mod power_verdicts;
mod samples;
mod student;
mod verdicts;

pub use drift::{Drift, Estimate, with_wavelength_changed};
pub use lost_steps::{LostSteps, LostStepsWatch};
pub use order_powers::OrderPowers;
pub use samples::{FrameReducer, FrameSamples};
pub use verdicts::{PowerReference, Watch, WatchReason, WatchState, WatchVerdict, verdicts};

use optics::{Calibration, LightSurfaces};

use crate::error::ScanError;
use crate::evaluation::Evaluation;
use places::OrderSamples;
use samples::LineSampler;

/// Results of the watches for a scan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WatchReport {
    /// Lost steps, in the order of travel.
    pub lost_steps: Vec<LostSteps>,
    /// The smallest loss that would have been detected on most of this part, mm; `None` if none could be.
    pub smallest_loss_mm: Option<f64>,
    /// Drift of wavelength and stage since the calibration; `None` if two orders observed too little common
    /// surface.
    pub drift: Option<Drift>,
    /// Powers of the orders; `None` if two orders observed too little common surface.
    pub powers: Option<OrderPowers>,
    /// Extent of the observed surface along the travel, mm.
    pub length_mm: f64,
    /// The calibration has one light sheet only: nothing can be compared.
    pub single_line: bool,
    /// The lines are independent, not orders of a grating: each has a power of its own.
    pub independent_lines: bool,
}

/// Runs the watches on an evaluated scan. `None` on stations without a linear stage.
///
/// # Errors
/// [`ScanError::UnreadableFrame`].
pub fn watch_scan(evaluation: &Evaluation, calibration: &Calibration) -> Result<Option<WatchReport>, ScanError> {
    let (Some(sampler), Some(mut steps)) = (LineSampler::new(calibration), LostStepsWatch::new(calibration))
    else {
        return Ok(None);
    };
    let single_line = calibration.orders.len() < 2;
    let independent_lines = has_independent_lines(calibration);
    let mut samples_of_orders = OrderSamples::new(sampler.clone());
    let mut report = WatchReport { single_line, independent_lines, ..WatchReport::default() };
    evaluation.for_each_profile(
        |frame, points, motion, position_mm| (sampler.samples(points, motion, position_mm, frame), position_mm),
        |(samples, position_mm)| {
            samples_of_orders.add(&samples);
            report.lost_steps.extend(steps.note(samples, position_mm));
        },
    )?;
    report.smallest_loss_mm = steps.smallest_detectable_mm();
    report.drift = drift::drift(&samples_of_orders, calibration);
    report.powers = order_powers::order_powers(&samples_of_orders);
    report.length_mm = samples_of_orders.length_mm();
    Ok(Some(report))
}

/// Whether the lines are those of independent lasers: free planes, numbered from 0.
fn has_independent_lines(calibration: &Calibration) -> bool {
    let numbered = calibration.orders.iter().zip(0i8..).all(|(line, number)| *line == number);
    matches!(calibration.light, LightSurfaces::Planes(_)) && numbered
}
