//! What can go wrong with a file, in words a person can act on.

use std::io;
use std::path::{Path, PathBuf};

/// A file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The extension stands for no format known here.
    #[error("{}: the extension names no known format; use one of {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Extensions that would do.
        known: String,
    },
    /// The operating system refused to read.
    #[error("{}: cannot be read; check that it exists and may be opened", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        cause: io::Error,
    },
    /// The operating system refused to write.
    #[error("{}: cannot be written; check that the folder exists, may be written to and has room", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        cause: io::Error,
    },
    /// The content is not what the format demands.
    #[error("{}: {place}: {problem}; {remedy}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, vertex or part of the file.
        place: String,
        /// What is wrong there.
        problem: String,
        /// What to do about it.
        remedy: &'static str,
    },
}

/// As [`FileError`], for bytes whose file name is not known.
#[derive(Debug, thiserror::Error)]
pub enum ContentError {
    /// Reading or writing failed.
    #[error("input or output failed")]
    Io(#[from] io::Error),
    /// The content is not what the format demands.
    #[error("{place}: {problem}; {remedy}")]
    Malformed {
        /// Line, vertex or part of the file.
        place: String,
        /// What is wrong there.
        problem: String,
        /// What to do about it.
        remedy: &'static str,
    },
}

impl ContentError {
    pub(crate) fn malformed(place: impl Into<String>, problem: impl Into<String>, remedy: &'static str) -> Self {
        Self::Malformed { place: place.into(), problem: problem.into(), remedy }
    }

    /// An end of file where more was promised becomes a finding with its place; other errors pass.
    pub(super) fn truncated(cause: io::Error, place: impl FnOnce() -> String) -> Self {
        if cause.kind() != io::ErrorKind::UnexpectedEof {
            return Self::Io(cause);
        }
        Self::malformed(
            place(),
            "the file ends before the records its header promises",
            "copy or export the file again; it is cut off or its header lies",
        )
    }
}

impl FileError {
    pub(super) fn reading(path: &Path, error: ContentError) -> Self {
        match error {
            ContentError::Io(cause) => Self::Read { path: path.to_owned(), cause },
            ContentError::Malformed { place, problem, remedy } => {
                Self::Malformed { path: path.to_owned(), place, problem, remedy }
            }
        }
    }

    pub(super) fn writing(path: &Path, error: ContentError) -> Self {
        match error {
            ContentError::Io(cause) => Self::Write { path: path.to_owned(), cause },
            ContentError::Malformed { place, problem, remedy } => {
                Self::Malformed { path: path.to_owned(), place, problem, remedy }
            }
        }
    }
}
