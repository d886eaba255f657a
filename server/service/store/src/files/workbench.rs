//! Temporary files on the local disk; every store has them, wherever it keeps finished artifacts.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Local folders for unfinished files.
#[derive(Debug, Clone)]
pub struct Workbench {
    data: PathBuf,
    scratch: PathBuf,
}

impl Workbench {
    /// In the data directory `data`, with unfinished files in its folder `scratch`.
    pub(crate) fn new(data: PathBuf, scratch: PathBuf) -> Self {
        Self { data, scratch }
    }

    /// The folder for unfinished files; emptied at every start.
    pub fn scratch(&self) -> &Path {
        &self.scratch
    }

    /// The folder of that name on the same disk for files that survive a restart; it may not exist yet.
    pub fn kept(&self, name: &str) -> PathBuf {
        self.data.join(name)
    }
}

/// A finished file of the workbench. A store on the same disk moves it, any other copies it.
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
    /// If it does not exist or cannot be read.
    pub fn open(&self) -> io::Result<impl io::Read + use<>> {
        File::open(&self.0)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}
