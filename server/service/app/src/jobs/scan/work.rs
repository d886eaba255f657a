//! The work folder of a running scan: after a crash the next start turns it into a partial scan.
//!
//! `work/<scan id>/` on the workbench contains `scan.json`, the peaks as they arrive, and the images if they are kept.
//! The images of a partial scan stay there until it is resumed or deleted.

use std::path::{Path, PathBuf};

use scanning::Frames;
use scanning::files::peaks::{PeaksFile, PeaksHeader, PeaksWriter};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use station::wall_clock::now_ms;
use store::{ArtifactId, Artifacts, FinishedFile, ScanRecord, ScanState, StoreError};

use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::scan::taking::writing::NewPeaks;
use crate::jobs::scan::{images, scan_changes};

const FOLDER: &str = "work";
const NOTE: &str = "scan.json";
const PEAKS: &str = "peaks";
const IMAGES_FOLDER: &str = "pictures";
const BACKGROUNDS: &str = "backgrounds";

/// The metadata of a scan, written before its first frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorkNote {
    /// Id of the future record.
    pub scan_id: String,
    /// Its name.
    pub name: String,
    /// Its plan.
    pub plan: Value,
    /// The calibration.
    pub calibration_id: String,
    /// The job that runs it.
    pub job_id: String,
    /// Whether a partial record with this id exists.
    pub replaces: bool,
    /// Frames lost so far, as text.
    pub losses: Vec<String>,
}

/// The work folder of a running scan.
pub struct Work {
    /// The metadata of the scan.
    pub note: WorkNote,
    folder: PathBuf,
}

fn home(artifacts: &dyn Artifacts) -> PathBuf {
    artifacts.workbench().kept(FOLDER)
}

impl Work {
    /// Creates the folder, and a peaks file that starts with the existing frames.
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
            std::fs::create_dir_all(images::folder_in(&work.images())).map_err(disk_problem)?;
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

    /// The folder is created together with its metadata: a folder without it is a leftover.
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

    /// Checks that the images of earlier rows exist.
    fn check_pictures(&self, n_rows: usize) -> Result<(), AppError> {
        let missing = (0..n_rows).find(|idx| !self.images().join(images::image_path(*idx)).is_file());
        match missing {
            None => Ok(()),
            Some(idx) => Err(AppError::new(
                ErrorKind::Conflict,
                format!("the image of row {} is missing, the images of this scan cannot be completed", idx + 1),
            )
            .remedy("start a new scan")),
        }
    }

    /// The peaks file.
    pub fn peaks(&self) -> PathBuf {
        self.folder.join(PEAKS)
    }

    /// Stores a copy of the peaks written so far: until the record is stored, the work folder is needed after a
    /// crash.
    pub async fn keep_peaks(&self, artifacts: &dyn Artifacts) -> Result<ArtifactId, AppError> {
        let place = tempfile::tempdir_in(artifacts.workbench().scratch()).map_err(disk_problem)?;
        let copy = place.path().join(PEAKS);
        std::fs::copy(self.peaks(), &copy).map_err(disk_problem)?;
        Ok(artifacts.adopt(FinishedFile::at(&copy)).await?)
    }

    /// The capture folder of the images.
    pub fn images(&self) -> PathBuf {
        self.folder.join(IMAGES_FOLDER)
    }

    /// File that records the background subtraction.
    pub fn backgrounds(&self) -> PathBuf {
        self.folder.join(BACKGROUNDS)
    }

    /// Removes the folder.
    pub fn clear(&self) {
        removed(std::fs::remove_dir_all(&self.folder));
    }

    /// The scan is stored as partial: keeps only its images.
    pub fn clear_but_pictures(&self) {
        if !self.images().is_dir() {
            return self.clear();
        }
        removed(std::fs::remove_file(self.folder.join(NOTE)));
        removed(std::fs::remove_file(self.peaks()));
    }

    /// The record of the scan so far.
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

/// The scan is stored: removes its work folder.
pub fn clear_work(artifacts: &dyn Artifacts, scan_id: &str) {
    removed(std::fs::remove_dir_all(home(artifacts).join(scan_id)));
}

fn removed(result: std::io::Result<()>) {
    if let Err(cause) = result
        && cause.kind() != std::io::ErrorKind::NotFound
    {
        tracing::warn!(%cause, "the work folder of a scan cannot be removed");
    }
}

/// Turns the work folders of a crashed process into partial scans. Called at start-up, before requests are served.
pub async fn recover(catalogue: &EventedCatalogue, artifacts: &dyn Artifacts) {
    let Ok(folders) = std::fs::read_dir(home(artifacts)) else { return };
    for folder in folders.flatten().map(|entry| entry.path()) {
        if let Err(problem) = recover_one(catalogue, artifacts, &folder).await {
            let cause = problem.cause.unwrap_or_default();
            tracing::error!(folder = %folder.display(), "{}: {cause}", problem.detail);
        }
    }
}

async fn recover_one(
    catalogue: &EventedCatalogue,
    artifacts: &dyn Artifacts,
    folder: &Path,
) -> Result<(), AppError> {
    if is_made(catalogue, folder).await? {
        removed(std::fs::remove_dir_all(folder));
        return Ok(());
    }
    let Ok(text) = std::fs::read(folder.join(NOTE)) else { return remove_orphan(catalogue, folder).await };
    let note: WorkNote = serde_json::from_slice(&text).map_err(disk_problem)?;
    let work = Work { note, folder: folder.to_owned() };
    let Ok((peaks, prefix)) = PeaksWriter::resume(&work.peaks()) else {
        work.clear_but_pictures();
        return remove_orphan(catalogue, folder).await;
    };
    let n_frames = prefix.peaks.frames.len();
    if n_frames == 0 {
        work.clear();
        return Ok(());
    }
    peaks.finish().map_err(disk_problem)?;
    let id = work.keep_peaks(artifacts).await?;
    let record = work.partial(n_frames, id, None, "the service ended while the scan was running");
    catalogue.commit(scan_changes(&record, work.note.replaces)).await?;
    work.clear_but_pictures();
    Ok(())
}

/// Deletes the images of deleted partial scans. The folder of a running scan has its metadata and is kept.
pub async fn remove_orphans(catalogue: &EventedCatalogue, artifacts: &dyn Artifacts) {
    let Ok(folders) = std::fs::read_dir(home(artifacts)) else { return };
    for folder in folders.flatten().map(|entry| entry.path()).filter(|folder| !folder.join(NOTE).exists()) {
        if let Err(problem) = remove_orphan(catalogue, &folder).await {
            tracing::warn!(detail = problem.detail, "the work folder of a scan cannot be deleted");
        }
    }
}

/// Whether the scan was stored completely and only its folder remained.
async fn is_made(catalogue: &EventedCatalogue, folder: &Path) -> Result<bool, AppError> {
    let id = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match catalogue.read().scan(&id).await {
        Ok(scan) => Ok(scan.state != ScanState::Partial),
        Err(StoreError::NotFound { .. }) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// Images are unreferenced unless their scan is partial.
async fn remove_orphan(catalogue: &EventedCatalogue, folder: &Path) -> Result<(), AppError> {
    let id = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match catalogue.read().scan(&id).await {
        Ok(scan) if scan.state == ScanState::Partial => Ok(()),
        Ok(_) | Err(StoreError::NotFound { .. }) => {
            removed(std::fs::remove_dir_all(folder));
            Ok(())
        }
        Err(error) => Err(error.into()),
    }
}
