//! Why a command ended without its result, in words a person can act on, and the exit code that goes with it.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

/// How a command ended; the number is the process's exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done; with a tolerance: pass.
    Done = 0,
    /// A defect of the program or the machine under it.
    Internal = 1,
    /// Wrong usage of the command line.
    Usage = 2,
    /// A file is missing, damaged, malformed or of the wrong size.
    BadInput = 3,
    /// The data cannot carry the result.
    Unobservable = 4,
    /// Measured; verdict: fail.
    VerdictFail = 5,
    /// Measured; verdict: undecided.
    VerdictUndecided = 6,
}

impl Exit {
    /// The name used in JSON problems.
    pub fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Internal => "internal",
            Self::Usage => "usage",
            Self::BadInput => "bad_input",
            Self::Unobservable => "data_cannot_carry_result",
            Self::VerdictFail => "verdict_fail",
            Self::VerdictUndecided => "verdict_undecided",
        }
    }
}

/// An error on its way to the person: what failed, where, why, and what to do about it.
#[derive(Debug)]
pub struct Failure(Box<Content>);

/// What a failure says; boxed, so that results stay small.
#[derive(Debug)]
struct Content {
    exit: Exit,
    what: String,
    file: Option<String>,
    entry: Option<String>,
    causes: Vec<String>,
    remedy: Option<String>,
    nature: Nature,
}

/// What a caller may want to tell apart without reading the words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Nature {
    Plain,
    AboutContent,
    Cancelled,
}

impl Failure {
    /// A failure with its exit code and one line of what failed.
    pub fn new(exit: Exit, what: impl Into<String>) -> Self {
        Self(Box::new(Content {
            exit,
            what: what.into(),
            file: None,
            entry: None,
            causes: Vec::new(),
            remedy: None,
            nature: Nature::Plain,
        }))
    }

    /// Something in the input is wrong.
    pub fn bad_input(what: impl Into<String>) -> Self {
        Self::new(Exit::BadInput, what)
    }

    /// The data cannot carry the result.
    pub fn unobservable(what: impl Into<String>) -> Self {
        Self::new(Exit::Unobservable, what)
    }

    /// The procedure was asked to end, and did.
    pub fn cancelled() -> Self {
        let mut failure = Self::new(Exit::Internal, "cancelled");
        failure.0.nature = Nature::Cancelled;
        failure
    }

    /// See [`Failure::cancelled`].
    pub fn is_cancelled(&self) -> bool {
        self.0.nature == Nature::Cancelled
    }

    /// A result could not be written.
    pub fn unwritable(path: &Path, cause: &dyn Error) -> Self {
        Self::new(Exit::BadInput, format!("cannot write {}", path.display()))
            .in_file(path)
            .because(cause)
            .remedy("choose a folder that exists, is writable and has room")
    }

    /// The file it is about.
    pub fn in_file(mut self, path: &Path) -> Self {
        self.0.file = Some(path.display().to_string());
        self
    }

    /// The entry of that file, such as `poses[3].laser`.
    pub fn at_entry(mut self, entry: impl Into<String>) -> Self {
        self.0.entry = Some(entry.into());
        self
    }

    /// The error behind it, with everything behind that one.
    pub fn because(mut self, error: &dyn Error) -> Self {
        let mut next = Some(error);
        while let Some(cause) = next {
            let text = cause.to_string();
            if self.0.causes.last() != Some(&text) && self.0.what != text {
                self.0.causes.push(text);
            }
            next = cause.source();
        }
        self
    }

    /// What the person can do.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.0.remedy = Some(remedy.into());
        self
    }

    /// Marks a picture that was read well and shows the wrong thing: one may choose to go on without it.
    pub fn about_content(mut self) -> Self {
        self.0.nature = Nature::AboutContent;
        self
    }

    /// See [`Failure::about_content`].
    pub fn is_about_content(&self) -> bool {
        self.0.nature == Nature::AboutContent
    }

    /// What failed, in one line.
    pub fn what(&self) -> &str {
        &self.0.what
    }

    /// Where: an entry of the file it is about.
    pub fn entry(&self) -> Option<&str> {
        self.0.entry.as_deref()
    }

    /// Why, from the nearest cause to the farthest.
    pub fn causes(&self) -> &[String] {
        &self.0.causes
    }

    /// What the person can do.
    pub fn advice(&self) -> Option<&str> {
        self.0.remedy.as_deref()
    }

    /// The exit code.
    pub fn exit(&self) -> Exit {
        self.0.exit
    }

    /// Lines for a person.
    pub fn to_text(&self) -> String {
        let mut text = format!("error: {}", self.0.what);
        let place: Vec<&str> = [self.0.file.as_deref(), self.0.entry.as_deref()]
            .into_iter()
            .flatten()
            .filter(|place| !self.0.what.contains(place))
            .collect();
        if !place.is_empty() {
            let _ = write!(text, "\n   at: {}", place.join(", entry "));
        }
        for cause in &self.0.causes {
            let _ = write!(text, "\ncause: {cause}");
        }
        if let Some(remedy) = &self.0.remedy {
            let _ = write!(text, "\nremedy: {remedy}");
        }
        text
    }

    /// The problem for a machine.
    pub fn to_json(&self) -> Value {
        json!({ "problem": {
            "kind": self.0.exit.name(),
            "exit_code": self.0.exit as u8,
            "what": self.0.what,
            "file": self.0.file,
            "entry": self.0.entry,
            "causes": self.0.causes,
            "remedy": self.0.remedy,
        }})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("outer")]
    struct Outer(#[source] std::fmt::Error);

    #[test]
    fn a_failure_names_file_entry_cause_and_remedy() {
        let failure = Failure::bad_input("cannot read the picture")
            .in_file(Path::new("a/capture.json"))
            .at_entry("poses[3].board")
            .because(&Outer(std::fmt::Error))
            .remedy("take it again");
        let text = failure.to_text();
        for word in ["error: cannot read", "a/capture.json, entry poses[3].board", "cause: outer", "remedy: take"]
        {
            assert!(text.contains(word), "{text}");
        }
        assert_eq!(failure.to_json()["problem"]["exit_code"], 3);
        assert_eq!(failure.to_json()["problem"]["causes"].as_array().map(Vec::len), Some(2));
    }
}
