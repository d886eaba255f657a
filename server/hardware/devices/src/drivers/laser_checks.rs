//! Checks common to all lasers.

use crate::LaserError;

/// Checks that `power` is a fraction of full power above 0.
///
/// # Errors
/// [`LaserError::BadPower`].
pub fn check_power(power: f64) -> Result<(), LaserError> {
    if power.is_finite() && power > 0.0 && power <= 1.0 {
        return Ok(());
    }
    Err(LaserError::BadPower { value: power })
}
