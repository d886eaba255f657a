//! Checks common to all stages.

use crate::StageError;

/// Checks that the distance or target called `name` and the speed are valid numbers.
///
/// # Errors
/// [`StageError::BadNumber`].
pub fn check_numbers(name: &'static str, value: f64, speed_mm_s: f64) -> Result<(), StageError> {
    if !value.is_finite() {
        return Err(StageError::BadNumber { name, value });
    }
    if !(speed_mm_s.is_finite() && speed_mm_s > 0.0) {
        return Err(StageError::BadNumber { name: "speed_mm_s", value: speed_mm_s });
    }
    Ok(())
}

/// Checks that `target_mm` is within the travel.
///
/// # Errors
/// [`StageError::OutOfTravel`].
pub fn check_travel(target_mm: f64, (min_mm, max_mm): (f64, f64)) -> Result<(), StageError> {
    if target_mm < min_mm || target_mm > max_mm {
        return Err(StageError::OutOfTravel { target_mm, min_mm, max_mm });
    }
    Ok(())
}
