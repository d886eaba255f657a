//! Errors of files, with remedies.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use remedy::Remedy;

use crate::error::ContentError;

/// A file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The extension does not name a supported format.
    #[error("{}: unknown file extension", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Supported extensions.
        known: String,
    },
    /// The operating system failed to read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        cause: io::Error,
    },
    /// The operating system failed to write.
    #[error("{}: cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        cause: io::Error,
    },
    /// The content does not match the format.
    #[error("{}: {place}: {problem}", path.display())]
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

impl Remedy for FileError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::UnknownFormat { known, .. } => format!("use one of {known}").into(),
            Self::Read { .. } => "check that it exists and may be opened".into(),
            Self::Write { .. } => "check that the folder exists, may be written to and has free space".into(),
            Self::Malformed { remedy, .. } => (*remedy).into(),
        })
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
