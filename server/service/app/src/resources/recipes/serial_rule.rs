//! Rules on serial numbers.

use regex::{Regex, RegexBuilder};

use crate::error::AppError;
use crate::resources::recipes::check::refused;

/// Largest compiled rule: far beyond any form of serial numbers.
const SIZE_LIMIT_BYTES: usize = 256 * 1024;

/// A rule for whole serial numbers.
#[derive(Debug)]
pub(crate) struct SerialRule(Regex);

impl SerialRule {
    /// The rule of a recipe.
    pub(crate) fn new(pattern: &str) -> Result<Self, AppError> {
        let compiled = |text: &str| RegexBuilder::new(text).size_limit(SIZE_LIMIT_BYTES).build();
        // Compiled alone first: unbalanced parentheses could otherwise escape the anchors.
        let rule = compiled(pattern).and_then(|_| compiled(&format!("^(?:{pattern})$")));
        rule.map(Self).map_err(|cause| {
            refused(
                "/recipe/serial_pattern",
                "this is not a valid regular expression",
                "see docs.rs/regex for the syntax",
            )
            .because(cause.to_string().lines().last().unwrap_or_default())
        })
    }

    /// Whether it matches this serial number.
    pub(crate) fn matches(&self, serial: &str) -> bool {
        self.0.is_match(serial)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_serial_pattern_must_match_the_whole_serial_number() {
        let rule = SerialRule::new("BR-[0-9]{4}|X.*").unwrap();
        assert_eq!(
            ["BR-0001", "X", "BR-00012", "aX", "br-0001"].map(|serial| rule.matches(serial)),
            [true, true, false, false, false]
        );
        for broken in ["a)|(b", "[", "(?<x", "a{1000}{1000}"] {
            let problem = SerialRule::new(broken).unwrap_err();
            assert_eq!(problem.pointer.as_deref(), Some("/recipe/serial_pattern"), "{broken}");
        }
    }
}
