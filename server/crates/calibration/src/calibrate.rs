//! The procedure: camera, labels, light models, joint refinement, stage, report.

use optics::Calibration;

use crate::input::{CalibrationInput, CalibrationOptions};
use crate::report::CalibrationReport;

/// A calibration and what it says about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationResult {
    /// The calibrated station; `light` is empty planes for a camera-only calibration.
    pub calibration: Calibration,
    /// Residuals, covariance, cross-validation.
    pub report: CalibrationReport,
}

/// Whether a long computation goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// Go on.
    Continue,
    /// Give up with [`CalibrationError::Cancelled`].
    Cancel,
}

/// Why a calibration was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// The caller asked to stop.
    #[error("the calibration was cancelled")]
    Cancelled,
}

/// Calibrates a station.
///
/// `progress` is told the step in the operator's words and the fraction done, and may cancel.
///
/// # Errors
/// [`CalibrationError`], which names what the data cannot determine.
pub fn calibrate(
    input: &CalibrationInput,
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(&str, f64) -> Stop,
) -> Result<CalibrationResult, CalibrationError> {
    let _ = (input, options, progress);
    Err(CalibrationError::Cancelled)
}
