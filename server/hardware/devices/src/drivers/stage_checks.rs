//! What every stage refuses by the same words.

use crate::StageError;

/// The distance or target called `name` and the speed are numbers that make a move.
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

/// `target_mm` is within the travel.
///
/// # Errors
/// [`StageError::OutOfTravel`].
pub fn check_travel(target_mm: f64, (min_mm, max_mm): (f64, f64)) -> Result<(), StageError> {
    if target_mm < min_mm || target_mm > max_mm {
        return Err(StageError::OutOfTravel { target_mm, min_mm, max_mm });
    }
    Ok(())
}
