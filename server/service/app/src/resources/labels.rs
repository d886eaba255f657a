//! Names that people give to things: what is shown as a line must be one.

use crate::error::{AppError, ErrorKind};

/// A name from outside: not empty, not endless, without characters that are not seen. `place` says where it stands.
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

/// Characters that are not seen and change how the rest is: of writing direction, of lines.
fn turns_text(letter: char) -> bool {
    matches!(letter, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}
