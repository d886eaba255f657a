//! Errors that know what a person can do about them.
//!
//! What happened is the error's text, why is its source, what helps is its [`Remedy`]. Who shows an error puts the three
//! where they belong; nobody looks for one of them within another. Everything may import this crate; it imports nothing.

use std::borrow::Cow;
use std::error::Error;

/// An error that knows what a person can do about it.
pub trait Remedy: Error {
    /// What to do, in words that begin in lower case and end without a full stop: `home it first`. `None` where nothing
    /// more can be said than what happened.
    fn remedy(&self) -> Option<Cow<'_, str>>;
}

/// An error and everything behind it in one line, the nearest cause first.
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

/// What happened and what to do about it in one line, for places that have room for no more.
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
