//! A catalogue that is not the one of the artifacts beside it: the store does not open, and touches nothing.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{capture, event};
use remedy::Remedy as _;
use store::{ArtifactId, Change, Store, StoreError};
use tempfile::TempDir;

const BYTES: &[u8] = b"an archive";

/// A data directory with a capture, closed.
async fn station() -> (TempDir, ArtifactId) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).await.unwrap();
    let mut record = capture();
    record.archive = store.artifacts.put(BYTES).await.unwrap();
    let archive = record.archive.clone();
    store.catalogue.commit(vec![Change::InsertCapture(record)]).await.unwrap();
    closed(store, folder.path()).await;
    // Opening folds the log into the database.
    closed(Store::open(folder.path()).await.unwrap(), folder.path()).await;
    (folder, archive)
}

fn catalogue(folder: &Path) -> PathBuf {
    folder.join("catalogue.sqlite3")
}

/// Closes the store and waits until its log is gone: the last connection closes on a thread of its own, and what it
/// still writes must not meet a catalogue that was put in its place.
async fn closed(store: Store, folder: &Path) {
    store.close().await;
    let begun = std::time::Instant::now();
    while folder.join("catalogue.sqlite3-wal").exists() {
        assert!(begun.elapsed() < std::time::Duration::from_secs(10), "the catalogue is not closed");
        tokio::time::sleep(std::time::Duration::from_millis(2)).await;
    }
}

fn drop_log(folder: &Path) {
    for ending in ["-wal", "-shm"] {
        let _ = fs::remove_file(folder.join(format!("catalogue.sqlite3{ending}")));
    }
}

#[track_caller]
fn is_refused(opened: Result<Store, StoreError>, words: &[&str]) {
    let error = opened.err().expect("it must not open");
    assert!(matches!(error, StoreError::NotItsCatalogue { .. }), "{error}");
    let text = format!("{error}; {}", error.remedy().unwrap());
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

#[tokio::test]
async fn an_emptied_or_missing_catalogue_is_refused_naming_the_newest_backup_and_opens_after_restoring_it() {
    let (folder, archive) = station().await;
    let file = catalogue(folder.path());
    let backup = folder.path().join("backups/catalogue-schema-3-9.sqlite3");
    for ruin in ["emptied", "missing"] {
        fs::copy(&file, &backup).unwrap();
        match ruin {
            "emptied" => fs::write(&file, "").unwrap(),
            _ => fs::remove_file(&file).unwrap(),
        }
        let backup_path = backup.display().to_string();
        for _ in ["first", "again"] {
            is_refused(Store::open(folder.path()).await, &[&backup_path, "nothing was changed", "copy"]);
        }
        fs::copy(&backup, &file).unwrap();
        drop_log(folder.path());
        let store = Store::open(folder.path()).await.unwrap();
        assert_eq!(store.artifacts.read(&archive).await.unwrap(), BYTES);
        closed(store, folder.path()).await;
        fs::remove_file(&backup).unwrap();
        fs::write(&file, "").unwrap();
        is_refused(Store::open(folder.path()).await, &["--data", "no copy"]);
        fs::remove_file(&file).unwrap();
        drop_log(folder.path());
        // What the next turn begins with.
        let (other, _) = station().await;
        fs::copy(catalogue(other.path()), &file).unwrap();
        fs::copy(other.path().join("artifacts/station"), folder.path().join("artifacts/station")).unwrap();
    }
}

#[tokio::test]
async fn the_catalogue_of_another_station_is_refused() {
    let (folder, archive) = station().await;
    let other = tempfile::tempdir().unwrap();
    closed(Store::open(other.path()).await.unwrap(), other.path()).await;
    closed(Store::open(other.path()).await.unwrap(), other.path()).await;
    fs::copy(catalogue(other.path()), catalogue(folder.path())).unwrap();
    drop_log(folder.path());
    is_refused(Store::open(folder.path()).await, &["another station"]);
    // A store that also lost the mark of the artifacts is refused as well: none of its files can be identified.
    fs::remove_file(folder.path().join("artifacts/station")).unwrap();
    is_refused(Store::open(folder.path()).await, &["artifacts"]);
    let name = archive.as_str();
    let kept = folder.path().join("artifacts").join(&name[..2]).join(&name[2..4]).join(name);
    assert_eq!(fs::read(kept).unwrap(), BYTES);
}

#[tokio::test]
async fn a_restored_copy_without_the_mark_and_a_station_with_leftovers_alone_open() {
    let (folder, _) = station().await;
    fs::remove_file(folder.path().join("artifacts/station")).unwrap();
    closed(Store::open(folder.path()).await.unwrap(), folder.path()).await;
    assert!(folder.path().join("artifacts/station").is_file(), "marked again");

    // A process that dies between storing and naming leaves artifacts that no record names.
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).await.unwrap();
    let left = store.artifacts.put(BYTES).await.unwrap();
    closed(store, folder.path()).await;
    let store = Store::open(folder.path()).await.unwrap();
    store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
    assert!(store.artifacts.read(&left).await.is_err(), "the next process deletes them");
}

#[tokio::test]
async fn artifacts_newer_than_a_restored_copy_are_set_aside_and_not_deleted() {
    let (folder, old) = station().await;
    let copy = fs::read(catalogue(folder.path())).unwrap();
    let store = Store::open(folder.path()).await.unwrap();
    let mut record = capture();
    record.archive = store.artifacts.put(b"a newer archive").await.unwrap();
    let newer = record.archive.clone();
    store.catalogue.commit(vec![Change::InsertCapture(record), Change::AppendEvent(event("x"))]).await.unwrap();
    store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
    closed(store, folder.path()).await;

    fs::write(catalogue(folder.path()), copy).unwrap();
    drop_log(folder.path());
    for _ in ["restored", "opened again"] {
        let store = Store::open(folder.path()).await.unwrap();
        store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
        assert_eq!(store.artifacts.read(&old).await.unwrap(), BYTES);
        assert!(store.artifacts.read(&newer).await.is_err());
        closed(store, folder.path()).await;
    }
    let entries = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
    let aside: Vec<_> = entries.filter(|path| path.to_string_lossy().contains("set-aside")).collect();
    let [aside] = &aside[..] else { panic!("{aside:?}") };
    assert_eq!(fs::read(aside.join(newer.as_str())).unwrap(), b"a newer archive");
}

#[tokio::test]
async fn a_copy_is_made_daily_and_named_in_the_remedy() {
    let (folder, archive) = station().await;
    let store = Store::open(folder.path()).await.unwrap();
    for _ in ["first", "again"] {
        store.back_up().await.unwrap();
    }
    let mut record = capture();
    record.archive = store.artifacts.put(b"newer than the copy").await.unwrap();
    let newer = record.archive.clone();
    store.catalogue.commit(vec![Change::InsertCapture(record)]).await.unwrap();
    closed(store, folder.path()).await;
    let copies: Vec<_> =
        fs::read_dir(folder.path().join("backups")).unwrap().map(|entry| entry.unwrap().path()).collect();
    let [copy] = &copies[..] else { panic!("{copies:?}") };
    fs::write(catalogue(folder.path()), "").unwrap();
    drop_log(folder.path());
    is_refused(Store::open(folder.path()).await, &[&copy.display().to_string()]);
    fs::copy(copy, catalogue(folder.path())).unwrap();
    drop_log(folder.path());
    let store = Store::open(folder.path()).await.unwrap();
    store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
    assert_eq!(store.artifacts.read(&archive).await.unwrap(), BYTES);
    let entries = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
    let mut aside = entries.filter(|path| path.to_string_lossy().contains("set-aside"));
    assert!(
        aside.any(|folder| folder.join(newer.as_str()).is_file()),
        "a copy does not know it, and it is not lost"
    );
}
