//! A scan under way on the disk: what a crash leaves is found at the next start and kept as a partial scan.
//!
//! `work/<scan id>/` on the workbench holds `scan.json`, then the peaks as they come, and the pictures if they
//! are kept. The pictures of a partial scan stay there until it is resumed or deleted.

use std::path::{Path, PathBuf};

use scanning::Frames;
use scanning::files::peaks::{PeaksFile, PeaksHeader, PeaksWriter};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use station::wall_clock::now_ms;
use store::{ArtifactId, Artifacts, FinishedFile, ScanRecord, ScanState, StoreError};

use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::scan::taking::writing::NewPeaks;
use crate::jobs::scan::{pictures, scan_changes};
use crate::resources::stored_scan::disk_problem;

const FOLDER: &str = "work";
const NOTE: &str = "scan.json";
const PEAKS: &str = "peaks";
const PICTURES: &str = "pictures";
const BACKGROUNDS: &str = "backgrounds";

/// What has to be known of a scan before its first frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorkNote {
    /// Of the record that will be.
    pub scan_id: String,
    /// What a person calls it.
    pub name: String,
    /// How it is run.
    pub plan: Value,
    /// What it is labelled with.
    pub calibration_id: String,
    /// The job that runs it.
    pub job_id: String,
    /// Whether a partial record of this id exists.
    pub replaces: bool,
    /// Frames lost so far, in words.
    pub losses: Vec<String>,
}

/// The folder of a scan under way.
pub struct Work {
    /// What the scan is.
    pub note: WorkNote,
    folder: PathBuf,
}

fn home(artifacts: &dyn Artifacts) -> PathBuf {
    artifacts.workbench().kept(FOLDER)
}

impl Work {
    /// Makes the folder, and a peaks file that begins with the frames that are there already.
    pub fn begin(
        artifacts: &dyn Artifacts,
        note: WorkNote,
        header: &PeaksHeader,
        earlier: Option<&PeaksFile>,
        keep_pictures: bool,
    ) -> Result<(Self, NewPeaks), AppError> {
        let work = Self { folder: home(artifacts).join(&note.scan_id), note };
        work.make_folder(artifacts)?;
        if keep_pictures {
            work.check_pictures(earlier.map_or(0, Frames::n_frames))?;
            std::fs::create_dir_all(pictures::folder_in(&work.pictures())).map_err(disk_problem)?;
        }
        let _ = std::fs::remove_file(work.peaks());
        let mut peaks = PeaksWriter::create(&work.peaks(), header).map_err(disk_problem)?;
        if let Some(earlier) = earlier {
            for idx in 0..earlier.n_frames() {
                let frame = earlier.frame(idx).map_err(disk_problem)?;
                peaks.add(&frame, earlier.captured_at_ns(idx)).map_err(disk_problem)?;
            }
        }
        peaks.flush().map_err(disk_problem)?;
        Ok((work, peaks))
    }

    /// The folder appears with its note: one without is what is left of a scan.
    fn make_folder(&self, artifacts: &dyn Artifacts) -> Result<(), AppError> {
        let text = serde_json::to_vec_pretty(&self.note).map_err(disk_problem)?;
        if self.folder.is_dir() {
            return std::fs::write(self.folder.join(NOTE), text).map_err(disk_problem);
        }
        let draft = tempfile::tempdir_in(artifacts.workbench().scratch()).map_err(disk_problem)?;
        std::fs::write(draft.path().join(NOTE), text).map_err(disk_problem)?;
        std::fs::create_dir_all(home(artifacts)).map_err(disk_problem)?;
        std::fs::rename(draft.keep(), &self.folder).map_err(disk_problem)
    }

    /// The pictures of earlier rows must be there.
    fn check_pictures(&self, n_rows: usize) -> Result<(), AppError> {
        let missing = (0..n_rows).find(|idx| !self.pictures().join(pictures::picture_path(*idx)).is_file());
        match missing {
            None => Ok(()),
            Some(idx) => Err(AppError::new(
                ErrorKind::Conflict,
                format!("the picture of row {} is gone, the pictures of this scan cannot be completed", idx + 1),
            )
            .remedy("scan anew")),
        }
    }

    /// The peaks file.
    pub fn peaks(&self) -> PathBuf {
        self.folder.join(PEAKS)
    }

    /// Stores the peaks as far as they are written. A copy: until the record is stored, the work folder is what a
    /// crash leaves.
    pub async fn keep_peaks(&self, artifacts: &dyn Artifacts) -> Result<ArtifactId, AppError> {
        let place = tempfile::tempdir_in(artifacts.workbench().scratch()).map_err(disk_problem)?;
        let copy = place.path().join(PEAKS);
        std::fs::copy(self.peaks(), &copy).map_err(disk_problem)?;
        Ok(artifacts.adopt(FinishedFile::at(&copy)).await?)
    }

    /// The capture folder of the pictures.
    pub fn pictures(&self) -> PathBuf {
        self.folder.join(PICTURES)
    }

    /// Which frame was freed from which background.
    pub fn backgrounds(&self) -> PathBuf {
        self.folder.join(BACKGROUNDS)
    }

    /// Nothing of it is needed any more.
    pub fn clear(&self) {
        removed(std::fs::remove_dir_all(&self.folder));
    }

    /// The scan is stored as partial: only its pictures stay.
    pub fn clear_but_pictures(&self) {
        if !self.pictures().is_dir() {
            return self.clear();
        }
        removed(std::fs::remove_file(self.folder.join(NOTE)));
        removed(std::fs::remove_file(self.peaks()));
    }

    /// The record of the scan as far as it has come.
    pub fn partial(
        &self,
        n_frames: usize,
        peaks: ArtifactId,
        display: Option<ArtifactId>,
        why: &str,
    ) -> ScanRecord {
        let note = &self.note;
        ScanRecord {
            id: note.scan_id.clone(),
            name: note.name.clone(),
            state: ScanState::Partial,
            calibration_id: note.calibration_id.clone(),
            plan: note.plan.clone(),
            peaks,
            capture_id: None,
            cloud: None,
            display,
            report: json!({ "scan": note.name, "n_frames": n_frames, "losses": note.losses, "stopped": why }),
            recomputed_from: None,
            job_id: Some(note.job_id.clone()),
            software_version: env!("CARGO_PKG_VERSION").to_owned(),
            created_at_ms: now_ms(),
        }
    }
}

/// The scan is stored: nothing else of its making is needed.
pub fn clear_work(artifacts: &dyn Artifacts, scan_id: &str) {
    removed(std::fs::remove_dir_all(home(artifacts).join(scan_id)));
}

fn removed(result: std::io::Result<()>) {
    if let Err(cause) = result
        && cause.kind() != std::io::ErrorKind::NotFound
    {
        tracing::warn!(%cause, "what is left of a scan cannot be removed");
    }
}

/// Turns what a dead process left of its scans into partial scans. Called at the start, before anybody can see them.
pub async fn recover(ledger: &EventedCatalogue, artifacts: &dyn Artifacts) {
    let Ok(folders) = std::fs::read_dir(home(artifacts)) else { return };
    for folder in folders.flatten().map(|entry| entry.path()) {
        if let Err(problem) = recover_one(ledger, artifacts, &folder).await {
            let cause = problem.cause.unwrap_or_default();
            tracing::error!(folder = %folder.display(), "{}: {cause}", problem.detail);
        }
    }
}

async fn recover_one(ledger: &EventedCatalogue, artifacts: &dyn Artifacts, folder: &Path) -> Result<(), AppError> {
    if is_made(ledger, folder).await? {
        removed(std::fs::remove_dir_all(folder));
        return Ok(());
    }
    let Ok(text) = std::fs::read(folder.join(NOTE)) else { return forget_orphan(ledger, folder).await };
    let note: WorkNote = serde_json::from_slice(&text).map_err(disk_problem)?;
    let work = Work { note, folder: folder.to_owned() };
    let Ok((peaks, prefix)) = PeaksWriter::resume(&work.peaks()) else {
        work.clear_but_pictures();
        return forget_orphan(ledger, folder).await;
    };
    let n_frames = prefix.peaks.frames.len();
    if n_frames == 0 {
        work.clear();
        return Ok(());
    }
    peaks.finish().map_err(disk_problem)?;
    let id = work.keep_peaks(artifacts).await?;
    let record = work.partial(n_frames, id, None, "the service ended while the scan ran");
    ledger.commit(scan_changes(&record, work.note.replaces)).await?;
    work.clear_but_pictures();
    Ok(())
}

/// Deletes the pictures of stopped scans that are gone. A scan under way has its note and stays.
pub async fn forget_orphans(ledger: &EventedCatalogue, artifacts: &dyn Artifacts) {
    let Ok(folders) = std::fs::read_dir(home(artifacts)) else { return };
    for folder in folders.flatten().map(|entry| entry.path()).filter(|folder| !folder.join(NOTE).exists()) {
        if let Err(problem) = forget_orphan(ledger, &folder).await {
            tracing::warn!(detail = problem.detail, "what is left of a scan cannot be deleted");
        }
    }
}

/// Whether the scan was stored to its end, and only its folder not cleared any more.
async fn is_made(ledger: &EventedCatalogue, folder: &Path) -> Result<bool, AppError> {
    let id = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match ledger.read().scan(&id).await {
        Ok(scan) => Ok(scan.state != ScanState::Partial),
        Err(StoreError::NotFound { .. }) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// Pictures whose scan is not partial any more belong to nobody.
async fn forget_orphan(ledger: &EventedCatalogue, folder: &Path) -> Result<(), AppError> {
    let id = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match ledger.read().scan(&id).await {
        Ok(scan) if scan.state == ScanState::Partial => Ok(()),
        Ok(_) | Err(StoreError::NotFound { .. }) => {
            removed(std::fs::remove_dir_all(folder));
            Ok(())
        }
        Err(error) => Err(error.into()),
    }
}
