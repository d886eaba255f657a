//! Validation of requested measurements.

use crate::error::{AppError, ErrorKind};
use crate::resources::measurements::MeasureInput;

/// Maximum number of measurements per scan.
const MEASUREMENTS_LIMIT: usize = 50;

/// Checks that the measurements are possible and no characteristic occurs twice.
///
/// # Errors
/// A problem with its place under `/measure`.
pub fn check_measurements(measure: &[MeasureInput]) -> Result<(), AppError> {
    let refused = |place: String, detail: String, remedy: &str| {
        Err(AppError::new(ErrorKind::Impossible, detail).at(place).remedy(remedy))
    };
    if measure.len() > MEASUREMENTS_LIMIT {
        let detail = format!("{} measurements are too many for one scan", measure.len());
        return refused("/measure".to_owned(), detail, &format!("request at most {MEASUREMENTS_LIMIT}"));
    }
    for (idx, asked) in measure.iter().enumerate() {
        if let Err(problem) = asked.request() {
            let place = format!("/measure/{idx}{}", problem.pointer.clone().unwrap_or_default());
            return Err(problem.at(place));
        }
        let twice = measure[..idx].iter().any(|other| (&other.tool, &other.name) == (&asked.tool, &asked.name));
        if twice {
            let detail = format!("{} occurs twice", asked.name.as_deref().unwrap_or(&asked.tool));
            return refused(format!("/measure/{idx}"), detail, "give each its own name");
        }
    }
    Ok(())
}
