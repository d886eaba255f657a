//! A reserve of disk space, released on a full disk so that records can still be deleted.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::StoreError;
use crate::params::{RESERVE_BYTES, RESERVE_FILE};

/// The reserve of a data directory.
#[derive(Debug, Clone)]
pub struct Reserve(PathBuf);

impl Reserve {
    /// The reserve of the data directory `folder`; no file is created yet.
    pub fn new(folder: &Path) -> Self {
        Self(folder.join(RESERVE_FILE))
    }

    /// Creates the reserve unless it exists or too little space would remain.
    pub fn fill(&self, free_bytes: u64) {
        let there = fs::metadata(&self.0).is_ok_and(|file| file.len() == RESERVE_BYTES);
        if there || free_bytes <= 2 * RESERVE_BYTES {
            return;
        }
        if let Err(cause) = write_zeros(&self.0) {
            tracing::warn!(%cause, "the reserve for a full disk could not be created");
        }
    }

    /// Releases the reserve.
    ///
    /// # Errors
    /// [`StoreError::File`] if the file cannot be deleted.
    pub fn release(&self) -> Result<(), StoreError> {
        match fs::remove_file(&self.0) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                Err(StoreError::File { what: "delete", path: self.0.display().to_string(), cause })
            }
            _ => Ok(()),
        }
    }
}

/// Written with data: a sparse file reserves nothing.
fn write_zeros(path: &Path) -> io::Result<()> {
    let filled = File::create(path)?.write_all(&vec![0; RESERVE_BYTES as usize]);
    filled.inspect_err(|_| drop(fs::remove_file(path)))
}
