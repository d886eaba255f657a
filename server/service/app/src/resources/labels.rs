//! Validation of user-given names.

use crate::error::{AppError, ErrorKind};

/// Checks a name: not empty, not too long, no invisible characters. `place` is its JSON pointer.
pub fn label(text: &str, place: &str) -> Result<(), AppError> {
    /// Longer names break tables and file names.
    const LONGEST: usize = 100;
    let plain = !text.chars().any(|letter| letter.is_control() || turns_text(letter));
    if !text.trim().is_empty() && text.chars().count() <= LONGEST && plain {
        return Ok(());
    }
    Err(AppError::new(ErrorKind::Impossible, "a name is empty, too long or has control characters")
        .at(place)
        .remedy(format!("give 1 to {LONGEST} letters")))
}

/// Invisible characters that change how the rest is displayed: writing direction, line breaks.
fn turns_text(letter: char) -> bool {
    matches!(letter, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}
