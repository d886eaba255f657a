//! Temporary files on this machine: every store has a local workbench, wherever it keeps finished artifacts.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// The folders of this machine for what is not finished.
#[derive(Debug, Clone)]
pub struct Workbench {
    data: PathBuf,
    scratch: PathBuf,
}

impl Workbench {
    /// In the data directory `data`, with files in the making in `scratch` within it.
    pub(crate) fn new(data: PathBuf, scratch: PathBuf) -> Self {
        Self { data, scratch }
    }

    /// The folder for files in the making; emptied at every start.
    pub fn scratch(&self) -> &Path {
        &self.scratch
    }

    /// The folder of that name on the same disk for what outlives a restart; it may not be there yet.
    pub fn kept(&self, name: &str) -> PathBuf {
        self.data.join(name)
    }
}

/// A file of the workbench that is complete. A store on the same disk moves it, any other reads it.
#[derive(Debug, Clone)]
pub struct FinishedFile(PathBuf);

impl FinishedFile {
    /// The file `path`, written by this process under [`Workbench::scratch`].
    pub fn at(path: impl Into<PathBuf>) -> Self {
        Self(path.into())
    }

    /// Its bytes.
    ///
    /// # Errors
    /// If it is not there or cannot be read.
    pub fn open(&self) -> io::Result<impl io::Read + use<>> {
        File::open(&self.0)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}
