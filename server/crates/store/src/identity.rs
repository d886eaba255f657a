//! Whether the catalogue is the one of the artifacts beside it.
//!
//! A catalogue that was emptied, lost or taken from another station names none of them; the first sweep would delete
//! them all. So catalogue and artifacts carry the same station id, and without one they must know each other.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde_json::Value;

use crate::artifacts::ArtifactId;
use crate::catalogue::{Catalogue, Change, StoreError};
use crate::disk::{Disk, LocalDisk};
use crate::local::LocalArtifacts;
use crate::params::{ARTIFACTS_FOLDER, BACKUPS_FOLDER, CATALOGUE_FILE, STATION_FILE};
use crate::records::SettingRecord;
use crate::sqlite::SqliteCatalogue;

/// The setting that holds the station's id.
const STATION: &str = "station_id";

/// Refuses to open a catalogue that is not there or has no byte while something of a station is. Asked before the
/// database is touched: SQLite deletes the write-ahead log of an empty one.
pub fn check_before_opening(folder: &Path, artifacts: &LocalArtifacts) -> Result<(), StoreError> {
    let why = match fs::metadata(folder.join(CATALOGUE_FILE)) {
        Ok(file) if file.len() > 0 => return Ok(()),
        Ok(_) => "is empty, but the artifacts of a station lie beside it",
        Err(_) => "is missing, but the artifacts of a station are there",
    };
    let is_new = id_of_artifacts(folder).is_none() && artifacts.is_empty()?;
    if is_new { Ok(()) } else { Err(refusal(folder, why)) }
}

/// Refuses a catalogue that is of another station than the artifacts; gives both the same id if they have none.
pub async fn check(
    folder: &Path,
    catalogue: &SqliteCatalogue,
    artifacts: &LocalArtifacts,
) -> Result<(), StoreError> {
    let of_catalogue = catalogue.setting(STATION).await?.and_then(|kept| kept.value.as_str().map(str::to_owned));
    let of_artifacts = id_of_artifacts(folder);
    let foreign = || refusal(folder, "is of another station than the artifacts beside it");
    if let (Some(one), Some(other)) = (&of_catalogue, &of_artifacts) {
        return if one == other { Ok(()) } else { Err(foreign()) };
    }
    let expects_content = of_artifacts.is_some() && of_catalogue.is_none();
    let nothing_lost = artifacts.is_empty()? && !(expects_content && catalogue.last_event_seq().await? == 0);
    if !nothing_lost && !names_any(catalogue, artifacts).await? {
        return Err(match catalogue.last_event_seq().await? {
            0 => refusal(folder, "has no record, but the artifacts of a station lie beside it"),
            _ => foreign(),
        });
    }
    let id = of_catalogue.clone().or(of_artifacts.clone()).unwrap_or_else(|| uuid::Uuid::now_v7().to_string());
    if of_catalogue.is_none() {
        catalogue.commit(vec![setting(STATION, Value::from(id.as_str()))]).await?;
    }
    if of_artifacts.is_none() { mark_artifacts(folder, &id) } else { Ok(()) }
}

fn setting(name: &str, value: Value) -> Change {
    Change::PutSetting(SettingRecord { name: name.to_owned(), value, changed_at_ms: now_ms() })
}

fn now_ms() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| i64::try_from(since.as_millis()).unwrap_or(i64::MAX))
}

/// Whether any of the artifacts that the catalogue names is there. While a record is damaged nothing is swept, and the
/// catalogue is taken for what it seems to be.
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

fn id_of_artifacts(folder: &Path) -> Option<String> {
    fs::read_to_string(station_file(folder)).ok().map(|text| text.trim().to_owned())
}

fn mark_artifacts(folder: &Path, id: &str) -> Result<(), StoreError> {
    let file = station_file(folder);
    let draft = file.with_extension("part");
    let write = || {
        fs::write(&draft, id)?;
        LocalDisk.sync_file(&fs::File::open(&draft)?)?;
        LocalDisk.rename(&draft, &file)?;
        LocalDisk.sync_folder(&folder.join(ARTIFACTS_FOLDER))
    };
    write().map_err(|cause| match crate::disk::is_full(&cause) {
        true => StoreError::Full,
        false => StoreError::File { what: "write", path: file.display().to_string(), cause },
    })
}

fn refusal(folder: &Path, why: &'static str) -> StoreError {
    let catalogue = folder.join(CATALOGUE_FILE);
    let remedy = match newest_backup(folder) {
        Some(backup) => format!(
            "nothing was changed: move {CATALOGUE_FILE} and its -wal and -shm away, copy the newest backup {} to {}, \
             then start again",
            backup.display(),
            catalogue.display()
        ),
        None => format!(
            "nothing was changed, and {BACKUPS_FOLDER} holds no copy: bring {} back from a backup of your own, or \
             begin anew in another folder with --data",
            catalogue.display()
        ),
    };
    StoreError::NotItsCatalogue { catalogue: catalogue.display().to_string(), why, remedy }
}

fn newest_backup(folder: &Path) -> Option<PathBuf> {
    let written_at =
        |file: &PathBuf| fs::metadata(file).and_then(|file| file.modified()).unwrap_or(SystemTime::UNIX_EPOCH);
    let files = fs::read_dir(folder.join(BACKUPS_FOLDER)).ok()?.flatten().map(|entry| entry.path());
    files.filter(|file| file.extension().is_some_and(|ending| ending == "sqlite3")).max_by_key(written_at)
}
