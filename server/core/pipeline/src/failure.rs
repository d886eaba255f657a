//! Failures of procedures, with remedies.

use std::error::Error;
use std::fmt;
use std::path::Path;

/// Kind of a failure, by who can fix it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureKind {
    /// A defect of the program or of the machine.
    Internal,
    /// An impossible parameter.
    BadParameter,
    /// A file is missing, damaged, malformed or of the wrong size.
    BadInput,
    /// The data do not determine the result.
    Unobservable,
    /// It was cancelled.
    Cancelled,
}

/// A failure as presented to the user: what failed, where, why, and the remedy.
#[derive(Debug)]
pub struct Failure(Box<Content>);

/// Content of a failure; boxed, so that results stay small.
#[derive(Debug)]
struct Content {
    kind: FailureKind,
    what: String,
    file: Option<String>,
    entry: Option<String>,
    causes: Vec<String>,
    remedy: Option<String>,
    is_about_content: bool,
}

impl Failure {
    /// A failure of a kind, with one line about what failed.
    pub fn new(kind: FailureKind, what: impl Into<String>) -> Self {
        Self(Box::new(Content {
            kind,
            what: what.into(),
            file: None,
            entry: None,
            causes: Vec::new(),
            remedy: None,
            is_about_content: false,
        }))
    }

    /// The input is wrong.
    pub fn bad_input(what: impl Into<String>) -> Self {
        Self::new(FailureKind::BadInput, what)
    }

    /// The data do not determine the result.
    pub fn unobservable(what: impl Into<String>) -> Self {
        Self::new(FailureKind::Unobservable, what)
    }

    /// The procedure was cancelled.
    pub fn cancelled() -> Self {
        Self::new(FailureKind::Cancelled, "cancelled")
    }

    /// See [`Failure::cancelled`].
    pub fn is_cancelled(&self) -> bool {
        self.0.kind == FailureKind::Cancelled
    }

    /// A result could not be written.
    pub fn unwritable(path: &Path, cause: &dyn Error) -> Self {
        Self::new(FailureKind::BadInput, format!("cannot write {}", path.display()))
            .in_file(path)
            .because(cause)
            .remedy("choose a folder that exists, is writable and has free space")
    }

    /// Adds the file.
    pub fn in_file(mut self, path: &Path) -> Self {
        self.0.file = Some(path.display().to_string());
        self
    }

    /// Adds the entry of that file, such as `poses[3].laser`.
    pub fn at_entry(mut self, entry: impl Into<String>) -> Self {
        self.0.entry = Some(entry.into());
        self
    }

    /// Adds an error and its chain of causes.
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

    /// Adds the remedy.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.0.remedy = Some(remedy.into());
        self
    }

    /// Marks the failure as due to the content of an image that was read correctly: the procedure may continue
    /// without this image.
    pub fn about_content(mut self) -> Self {
        self.0.is_about_content = true;
        self
    }

    /// See [`Failure::about_content`].
    pub fn is_about_content(&self) -> bool {
        self.0.is_about_content
    }

    /// What failed, in one line.
    pub fn what(&self) -> &str {
        &self.0.what
    }

    /// The entry of the file.
    pub fn entry(&self) -> Option<&str> {
        self.0.entry.as_deref()
    }

    /// The chain of causes, nearest first.
    pub fn causes(&self) -> &[String] {
        &self.0.causes
    }

    /// The remedy.
    pub fn advice(&self) -> Option<&str> {
        self.0.remedy.as_deref()
    }

    /// The file.
    pub fn file(&self) -> Option<&str> {
        self.0.file.as_deref()
    }

    /// Its kind.
    pub fn kind(&self) -> FailureKind {
        self.0.kind
    }
}

/// Formatted for the user.
impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error: {}", self.0.what)?;
        let place: Vec<&str> = [self.0.file.as_deref(), self.0.entry.as_deref()]
            .into_iter()
            .flatten()
            .filter(|place| !self.0.what.contains(place))
            .collect();
        if !place.is_empty() {
            write!(f, "\n   at: {}", place.join(", entry "))?;
        }
        for cause in &self.0.causes {
            write!(f, "\ncause: {cause}")?;
        }
        if let Some(remedy) = &self.0.remedy {
            write!(f, "\nremedy: {remedy}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("outer")]
    struct Outer(#[source] std::fmt::Error);

    #[test]
    fn a_failure_names_file_entry_cause_and_remedy() {
        let failure = Failure::bad_input("cannot read the image")
            .in_file(Path::new("a/capture.json"))
            .at_entry("poses[3].board")
            .because(&Outer(std::fmt::Error))
            .remedy("take it again");
        let text = failure.to_string();
        for word in ["error: cannot read", "a/capture.json, entry poses[3].board", "cause: outer", "remedy: take"]
        {
            assert!(text.contains(word), "{text}");
        }
        assert_eq!(failure.causes().len(), 2);
    }
}
