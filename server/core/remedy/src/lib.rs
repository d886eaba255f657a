//! Errors with remedies.
//!
//! An error's text states what happened, its source why, and its [`Remedy`] what helps. The presentation places the
//! three; none is parsed out of another. Every crate may import this one; it imports nothing.

use std::borrow::Cow;
use std::error::Error;

/// An error with a remedy.
pub trait Remedy: Error {
    /// The remedy, beginning in lower case and without a full stop: `home the stage first`. `None` if there is nothing to
    /// add.
    fn remedy(&self) -> Option<Cow<'_, str>>;
}

/// An error and its chain of causes in one line, the nearest cause first.
pub fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut next = error.source();
    while let Some(cause) = next {
        text.push_str(": ");
        text.push_str(&cause.to_string());
        next = cause.source();
    }
    text
}

/// The error and its remedy in one line, for places with limited room.
pub fn with_remedy(error: &dyn Remedy) -> String {
    match error.remedy() {
        Some(remedy) => format!("{error}; {remedy}"),
        None => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug)]
    struct Outer(std::fmt::Error);

    impl std::fmt::Display for Outer {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("outer")
        }
    }

    impl Error for Outer {
        fn source(&self) -> Option<&(dyn Error + 'static)> {
            Some(&self.0)
        }
    }

    impl Remedy for Outer {
        fn remedy(&self) -> Option<Cow<'_, str>> {
            Some("write elsewhere".into())
        }
    }

    #[test]
    fn a_remedy_follows_in_one_line() {
        assert_eq!(with_remedy(&Outer(std::fmt::Error)), "outer; write elsewhere");
    }

    #[test]
    fn causes_follow_what_happened() {
        assert_eq!(with_causes(&Outer(std::fmt::Error)), format!("outer: {}", std::fmt::Error));
    }
}
