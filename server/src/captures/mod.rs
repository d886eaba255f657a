//! Captures: archives in the store, folders for the core.

use std::path::PathBuf;
use std::sync::Arc;

use store::{Artifacts, CaptureRecord, Change};

use crate::ledger::Ledger;
use crate::problem::Problem;

/// How the files of a capture come packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ArchiveFormat {
    /// `application/zip`.
    Zip,
    /// `application/x-tar`.
    Tar,
}

/// Where a capture comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CaptureOrigin {
    /// Sent by a client.
    Upload,
    /// Taken for a calibration.
    Calibration,
    /// The frames of a scan.
    Scan,
}

/// Takes captures in and hands them out as folders.
#[derive(Clone)]
pub struct Captures {
    ledger: Ledger,
    artifacts: Arc<dyn Artifacts>,
}

/// A capture as a folder, as long as this lives.
pub struct CheckedOut {
    /// The folder that holds `capture.json`.
    pub folder: PathBuf,
}

impl Captures {
    /// Over the store.
    pub fn new(ledger: Ledger, artifacts: Arc<dyn Artifacts>) -> Self {
        Self { ledger, artifacts }
    }

    /// Unpacks `archive` (a file under the artifacts' scratch folder) within all limits, checks the capture with every
    /// picture in it, stores the archive, and returns the change that records it. Blocks; leaves nothing on failure.
    pub fn take_in(
        &self,
        _archive: &std::path::Path,
        _format: ArchiveFormat,
        _origin: CaptureOrigin,
        _name: &str,
    ) -> Result<(CaptureRecord, Change), Problem> {
        let _ = (&self.ledger, &self.artifacts);
        todo!()
    }

    /// Packs a capture folder made by this process and takes it in.
    pub fn take_in_folder(
        &self,
        _folder: &std::path::Path,
        _origin: CaptureOrigin,
        _name: &str,
    ) -> Result<(CaptureRecord, Change), Problem> {
        todo!()
    }

    /// The capture as a folder; unpacked again if it is not there. Blocks.
    pub fn check_out(&self, _capture_id: &str) -> Result<CheckedOut, Problem> {
        todo!()
    }
}
