//! What every laser refuses by the same words.

use crate::LaserError;

/// `power` is a share of full power above 0.
///
/// # Errors
/// [`LaserError::BadPower`].
pub fn check_power(power: f64) -> Result<(), LaserError> {
    if power.is_finite() && power > 0.0 && power <= 1.0 {
        return Ok(());
    }
    Err(LaserError::BadPower { value: power })
}
