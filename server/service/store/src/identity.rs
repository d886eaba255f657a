//! Checks that the catalogue belongs to the artifacts beside it.
//!
//! A catalogue that was emptied, lost or copied from another station refers to none of them; the first sweep would delete
//! them all. So catalogue and artifacts carry the same station id; without one, the catalogue must refer to some of them.
//! The artifacts also carry the last known event number of the catalogue: a catalogue with a smaller one was restored
//! from a copy, and unreferenced artifacts are set aside, not deleted.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde_json::Value;

use crate::artifacts::ArtifactId;
use crate::catalogue::{Catalogue, Change};
use crate::error::StoreError;
use crate::files::disk::{Disk, LocalDisk};
use crate::local::LocalArtifacts;
use crate::params::{ARTIFACTS_FOLDER, BACKUPS_FOLDER, CATALOGUE_FILE, SET_ASIDE_FOLDER, STATION_FILE};
use crate::records::SettingRecord;
use crate::sqlite::SqliteCatalogue;

/// The setting that holds the station's id.
const STATION: &str = "station_id";

/// The setting that counts the copies made of the catalogue; a copy does not include itself.
const COPIES: &str = "catalogue_copies";

/// Progress of a catalogue: copies made of it, newest event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Progress {
    n_copies: i64,
    last_seq: i64,
}

impl Progress {
    async fn of(catalogue: &dyn Catalogue) -> Result<Self, StoreError> {
        let n_copies = catalogue.setting(COPIES).await?.and_then(|kept| kept.value.as_i64()).unwrap_or(0);
        Ok(Self { n_copies, last_seq: catalogue.last_event_seq().await? })
    }

    fn is_behind(self, seen: Self) -> bool {
        self.n_copies < seen.n_copies || self.last_seq < seen.last_seq
    }
}

/// Refuses a missing or empty catalogue beside the artifacts of a station. Checked before the
/// database is opened: SQLite deletes the write-ahead log of an empty one.
pub fn check_before_opening(folder: &Path, artifacts: &LocalArtifacts) -> Result<(), StoreError> {
    let why = match fs::metadata(folder.join(CATALOGUE_FILE)) {
        Ok(file) if file.len() > 0 => return Ok(()),
        Ok(_) => "is empty, but the artifacts of a station exist beside it",
        Err(_) => "is missing, but the artifacts of a station exist",
    };
    let is_new = id_of_artifacts(folder).is_none() && artifacts.is_empty()?;
    if is_new { Ok(()) } else { Err(refusal(folder, why)) }
}

/// Refuses a catalogue of another station than the artifacts; assigns both the same id if they have none.
pub async fn check(
    folder: &Path,
    catalogue: &SqliteCatalogue,
    artifacts: &LocalArtifacts,
) -> Result<(), StoreError> {
    let of_catalogue = catalogue.setting(STATION).await?.and_then(|kept| kept.value.as_str().map(str::to_owned));
    let (of_artifacts, seen) = id_of_artifacts(folder).unzip();
    let progress = Progress::of(catalogue).await?;
    let foreign = || refusal(folder, "belongs to another station than the artifacts beside it");
    if let (Some(one), Some(other)) = (&of_catalogue, &of_artifacts) {
        return match one == other {
            false => Err(foreign()),
            true if progress.is_behind(seen.unwrap_or_default()) => set_aside(folder, catalogue, artifacts).await,
            true => Ok(()),
        };
    }
    let expects_content = of_artifacts.is_some() && of_catalogue.is_none();
    let nothing_lost = artifacts.is_empty()? && !(expects_content && progress.last_seq == 0);
    if !nothing_lost && !names_any(catalogue, artifacts).await? {
        return Err(match progress.last_seq {
            0 => refusal(folder, "has no records, but the artifacts of a station exist beside it"),
            _ => foreign(),
        });
    }
    let id = of_catalogue.clone().or(of_artifacts.clone()).unwrap_or_else(|| uuid::Uuid::now_v7().to_string());
    if of_catalogue.is_none() {
        catalogue.commit(vec![setting(STATION, Value::from(id.as_str()))]).await?;
    }
    match of_artifacts {
        None => mark_artifacts(folder, &id, progress),
        // A copy from before the catalogue had an id.
        Some(_) => set_aside(folder, catalogue, artifacts).await,
    }
}

/// Stores the progress of the catalogue, so that a restored older one is recognised.
pub async fn note_progress(folder: &Path, catalogue: &dyn Catalogue) -> Result<(), StoreError> {
    let progress = Progress::of(catalogue).await?;
    match id_of_artifacts(folder) {
        Some((id, seen)) if seen != progress => mark_artifacts(folder, &id, progress),
        _ => Ok(()),
    }
}

/// Counts a copy that was just made, so that the copy is recognised as older.
pub async fn count_copy(folder: &Path, catalogue: &dyn Catalogue) -> Result<(), StoreError> {
    let value = Value::from(Progress::of(catalogue).await?.n_copies + 1);
    catalogue.commit(vec![setting(COPIES, value)]).await?;
    note_progress(folder, catalogue).await
}

/// Sets aside artifacts that a restored catalogue does not refer to, before the first sweep.
async fn set_aside(
    folder: &Path,
    catalogue: &SqliteCatalogue,
    artifacts: &LocalArtifacts,
) -> Result<(), StoreError> {
    let named = match catalogue.artifacts_named().await {
        Ok(named) => named,
        // Nothing is swept while a record is damaged.
        Err(StoreError::DamagedRecord { .. }) => return Ok(()),
        Err(error) => return Err(error),
    };
    let target = folder.join(format!("{SET_ASIDE_FOLDER}-{}", now_ms()));
    let n_moved = artifacts.set_aside(&named, &target)?;
    if n_moved > 0 {
        let folder = target.display();
        tracing::warn!(%folder, n_moved, "the catalogue was restored; unknown files were set aside");
    }
    note_progress(folder, catalogue).await
}

fn setting(name: &str, value: Value) -> Change {
    Change::PutSetting(SettingRecord { name: name.to_owned(), value, changed_at_ms: now_ms() })
}

fn now_ms() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| i64::try_from(since.as_millis()).unwrap_or(i64::MAX))
}

/// Whether any of the artifacts that the catalogue refers to exists. While a record is damaged nothing is swept, and the
/// catalogue is accepted.
async fn names_any(catalogue: &SqliteCatalogue, artifacts: &LocalArtifacts) -> Result<bool, StoreError> {
    match catalogue.artifacts_named().await {
        Ok(named) => Ok(named.iter().any(|id: &ArtifactId| artifacts.has(id))),
        Err(StoreError::DamagedRecord { .. }) => Ok(true),
        Err(error) => Err(error),
    }
}

fn station_file(folder: &Path) -> PathBuf {
    folder.join(ARTIFACTS_FOLDER).join(STATION_FILE)
}

/// The station's id, and the last stored progress of its catalogue.
fn id_of_artifacts(folder: &Path) -> Option<(String, Progress)> {
    let text = fs::read_to_string(station_file(folder)).ok()?;
    let mut words = text.split_whitespace();
    let id = words.next()?.to_owned();
    let mut number = || words.next().and_then(|word| word.parse().ok()).unwrap_or(0);
    Some((id, Progress { n_copies: number(), last_seq: number() }))
}

fn mark_artifacts(folder: &Path, id: &str, progress: Progress) -> Result<(), StoreError> {
    let file = station_file(folder);
    let draft = file.with_extension("part");
    let write = || {
        fs::write(&draft, format!("{id} {} {}\n", progress.n_copies, progress.last_seq))?;
        LocalDisk.sync_file(&fs::File::open(&draft)?)?;
        LocalDisk.rename(&draft, &file)?;
        LocalDisk.sync_folder(&folder.join(ARTIFACTS_FOLDER))
    };
    write().map_err(|cause| match crate::files::disk::is_full(&cause) {
        true => StoreError::Full,
        false => StoreError::File { what: "write", path: file.display().to_string(), cause },
    })
}

fn refusal(folder: &Path, why: &'static str) -> StoreError {
    let catalogue = folder.join(CATALOGUE_FILE);
    let remedy = match newest_backup(folder) {
        Some(backup) => format!(
            "nothing was changed: move {CATALOGUE_FILE} and its -wal and -shm away, copy the newest backup {} to {}, \
             then start again: files that are newer than it are set aside",
            backup.display(),
            catalogue.display()
        ),
        None => format!(
            "nothing was changed, and {BACKUPS_FOLDER} holds no copy: bring {} back from a backup of your own, or \
start over in another folder with --data",
            catalogue.display()
        ),
    };
    StoreError::NotItsCatalogue { catalogue: catalogue.display().to_string(), why, remedy }
}

/// The newest copy of the catalogue.
pub fn newest_backup(folder: &Path) -> Option<PathBuf> {
    let written_at =
        |file: &PathBuf| fs::metadata(file).and_then(|file| file.modified()).unwrap_or(SystemTime::UNIX_EPOCH);
    let files = fs::read_dir(folder.join(BACKUPS_FOLDER)).ok()?.flatten().map(|entry| entry.path());
    files.filter(|file| file.extension().is_some_and(|ending| ending == "sqlite3")).max_by_key(written_at)
}
