//! A disk that fails, fills up or loses data: what the store reports and refuses.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicI32, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use store::{ArtifactId, Change, Disk, LocalDisk, Store, StoreError};
use tokio::io::AsyncReadExt;

use crate::common::{event, job};

const EIO: i32 = 5;
const ENOSPC: i32 = 28;

/// A disk on which one step fails with an error number (0: none), and which keeps a diary.
#[derive(Default)]
struct FaultyDisk {
    step: Mutex<&'static str>,
    errno: AtomicI32,
    n_failed: AtomicUsize,
    diary: Mutex<Vec<String>>,
}

impl FaultyDisk {
    fn fail(&self, step: &'static str, errno: i32) {
        *self.step.lock().unwrap() = step;
        self.errno.store(errno, Ordering::SeqCst);
    }

    fn at(&self, step: &'static str, path: &Path) -> io::Result<()> {
        self.diary.lock().unwrap().push(format!("{step} {}", path.display()));
        match self.errno.load(Ordering::SeqCst) {
            errno if errno != 0 && *self.step.lock().unwrap() == step => {
                self.n_failed.fetch_add(1, Ordering::SeqCst);
                Err(io::Error::from_raw_os_error(errno))
            }
            _ => Ok(()),
        }
    }
}

impl Disk for FaultyDisk {
    fn write(&self, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        self.at("write", Path::new("")).and_then(|()| LocalDisk.write(file, bytes))
    }

    fn sync_file(&self, file: &File) -> io::Result<()> {
        self.at("sync_file", Path::new("")).and_then(|()| LocalDisk.sync_file(file))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.at("rename", to).and_then(|()| LocalDisk.rename(from, to))
    }

    fn sync_folder(&self, folder: &Path) -> io::Result<()> {
        self.at("sync_folder", folder).and_then(|()| LocalDisk.sync_folder(folder))
    }
}

async fn store_on_faulty_disk() -> (tempfile::TempDir, Arc<FaultyDisk>, Store) {
    let folder = tempfile::tempdir().unwrap();
    let disk = Arc::new(FaultyDisk::default());
    let store = Store::open_on(folder.path(), disk.clone()).await.unwrap();
    (folder, disk, store)
}

#[tokio::test]
async fn bytes_are_synced_before_their_name_and_the_name_before_the_answer() {
    let (folder, disk, store) = store_on_faulty_disk().await;
    disk.diary.lock().unwrap().clear();
    let id = store.artifacts.put(b"twice").await.unwrap();
    let root = folder.path().join("artifacts");
    let (outer, name) = (root.join(&id.as_str()[..2]), id.as_str());
    let inner = outer.join(&name[2..4]);
    let expected = [
        format!("sync_folder {}", root.display()),
        format!("sync_folder {}", outer.display()),
        format!("rename {}", inner.join(name).display()),
        format!("sync_folder {}", inner.display()),
    ];
    let diary = std::mem::take(&mut *disk.diary.lock().unwrap());
    assert_eq!(diary[..2], ["write ", "sync_file "]);
    assert_eq!(diary[2..], expected);

    store.artifacts.put(b"twice").await.unwrap();
    let again = format!("sync_folder {}", inner.display());
    assert_eq!(*disk.diary.lock().unwrap(), [again], "bytes that are there are not written again");
}

#[tokio::test]
async fn a_failed_write_makes_the_whole_store_read_only_and_is_not_tried_again() {
    for step in ["write", "sync_file", "rename", "sync_folder"] {
        let (_folder, disk, store) = store_on_faulty_disk().await;
        let kept = store.artifacts.put(b"before").await.unwrap();
        let job = job();
        store.catalogue.commit(vec![Change::InsertJob(job.clone())]).await.unwrap();
        let mut failure = store.watch_failure();
        disk.fail(step, EIO);
        let error = store.artifacts.put(b"after").await.unwrap_err();
        assert!(matches!(error, StoreError::ReadOnly { .. }), "{step}: {error}");

        disk.fail("nothing", 0);
        assert!(store.is_read_only());
        assert!(failure.wait_for(Option::is_some).await.unwrap().is_some());
        assert!(matches!(store.artifacts.put(b"again").await.unwrap_err(), StoreError::ReadOnly { .. }));
        assert!(matches!(store.artifacts.create().await.err(), Some(StoreError::ReadOnly { .. })));
        let refused = store.catalogue.commit(vec![Change::AppendEvent(event("x"))]).await.unwrap_err();
        assert!(matches!(refused, StoreError::ReadOnly { .. }));
        assert_eq!(disk.n_failed.load(Ordering::SeqCst), 1, "{step} was tried again");
        assert_eq!(store.artifacts.read(&kept).await.unwrap(), b"before");
        assert_eq!(store.catalogue.job(&job.id).await.unwrap(), job);
    }
}

#[tokio::test]
async fn a_full_disk_is_reported_leaves_nothing_and_recovers_when_there_is_space() {
    for step in ["write", "sync_file", "rename"] {
        let (_folder, disk, store) = store_on_faulty_disk().await;
        disk.fail(step, ENOSPC);
        let bytes = vec![7; 3_000_000];
        assert!(matches!(store.artifacts.put(&bytes).await.unwrap_err(), StoreError::Full), "{step}");
        let mut writer = store.artifacts.create().await.unwrap();
        let written = match writer.write(&bytes).await {
            Ok(()) => writer.finish().await.map(drop),
            Err(error) => {
                assert!(writer.finish().await.is_err(), "an artifact with a hole");
                Err(error)
            }
        };
        assert!(matches!(written.unwrap_err(), StoreError::Full), "{step}");
        assert_eq!(fs::read_dir(store.artifacts.workbench().scratch()).unwrap().count(), 0);
        assert!(!store.is_read_only());

        disk.fail("nothing", 0);
        let id = store.artifacts.put(&bytes).await.unwrap();
        assert_eq!(store.artifacts.read(&id).await.unwrap(), bytes);
    }
}

fn file_of(folder: &Path, id: &ArtifactId) -> PathBuf {
    let name = id.as_str();
    folder.join("artifacts").join(&name[..2]).join(&name[2..4]).join(name)
}

#[tokio::test]
async fn every_read_detects_a_flipped_bit_and_a_missing_byte() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).await.unwrap();
    let bytes: Vec<u8> = (0..300_000).map(|i| (i % 251) as u8).collect();
    let id = store.artifacts.put(&bytes).await.unwrap();
    let mut flips = vec![bytes[..bytes.len() - 1].to_vec(), Vec::new()];
    for at in [0, 150_000, bytes.len() - 1] {
        let mut flipped = bytes.clone();
        flipped[at] ^= 0x10;
        flips.push(flipped);
    }
    for damaged in flips {
        fs::write(file_of(folder.path(), &id), &damaged).unwrap();
        assert!(matches!(store.artifacts.read(&id).await.unwrap_err(), StoreError::Damaged { .. }));
        assert!(matches!(store.artifacts.check(&id).await.unwrap_err(), StoreError::Damaged { .. }));
        let mut reader = match store.artifacts.open(&id).await {
            Ok(reader) => reader,
            Err(error) => {
                assert!(damaged.is_empty() && matches!(error, StoreError::Damaged { .. }));
                continue;
            }
        };
        // A reader that counts the bytes and stops at the last one gets the error as well.
        let mut read = vec![0; damaged.len()];
        let error = reader.bytes.read_exact(&mut read).await.unwrap_err();
        let cause = error.get_ref().unwrap().downcast_ref::<StoreError>();
        assert!(matches!(cause, Some(StoreError::Damaged { .. })));
    }
    fs::write(file_of(folder.path(), &id), &bytes).unwrap();
    store.artifacts.check(&id).await.unwrap();
    assert_eq!(store.artifacts.read(&id).await.unwrap(), bytes);
}

#[tokio::test]
async fn a_data_directory_has_one_process_and_is_tidied_when_it_opens() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).await.unwrap();
    let half = store.artifacts.workbench().scratch().join("half");
    fs::create_dir(&half).unwrap();
    fs::write(half.join("upload.zip"), "half").unwrap();
    let second = Store::open(folder.path()).await.err().unwrap();
    assert!(matches!(second, StoreError::InUse { .. }), "{second}");
    assert!(half.exists(), "who does not have the lock touches nothing");
    store.close().await;
    let store = Store::open(folder.path()).await.unwrap();
    assert!(!half.exists() && store.artifacts.workbench().scratch().is_dir());
}

#[tokio::test]
async fn the_reserve_takes_disk_space_and_releases_it() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).await.unwrap();
    let reserve = folder.path().join("reserve");
    let blocks = std::os::unix::fs::MetadataExt::blocks(&fs::metadata(&reserve).unwrap());
    assert!(blocks * 512 >= store::params::RESERVE_BYTES, "a sparse file reserves nothing");
    assert!(store.free_bytes().unwrap() > 0);
    store.release_reserve().unwrap();
    store.release_reserve().unwrap();
    assert!(!reserve.exists());
    store.sweep_unreferenced(|_| HashSet::new()).await.unwrap();
    assert!(reserve.exists(), "filled again once there is room");
}

const FOLDER: &str = "SHEAF_STORE_LIMITED_FOLDER";

/// The kernel refuses to let files grow (RLIMIT_FSIZE, without its signal), which SQLite meets as an I/O error: in
/// the log if the limit is below the size at which it is folded, in the database otherwise.
#[tokio::test]
async fn a_catalogue_that_cannot_be_written_is_read_only_and_keeps_what_it_acknowledged() {
    for limit_kib in [1024, 6 * 1024] {
        let folder = tempfile::tempdir().unwrap();
        let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$0\" \"$@\"", limit_kib * 2);
        let output = Command::new("sh")
            .args(["-c", &script])
            .arg(std::env::current_exe().unwrap())
            .args(["faults::write_until_refused", "--exact", "--ignored", "--nocapture"])
            .env(FOLDER, folder.path())
            .output()
            .unwrap();
        let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{stdout}{}", String::from_utf8_lossy(&output.stderr));
        let n_acknowledged: i64 =
            stdout.lines().find_map(|line| line.strip_prefix("acknowledged ")).unwrap().parse().unwrap();
        let store = Store::open(folder.path()).await.unwrap();
        assert!(n_acknowledged > 0);
        assert_eq!(store.catalogue.last_event_seq().await.unwrap(), n_acknowledged);
        assert_eq!(store.catalogue.events_after(0, 100_000).await.unwrap().records.len() as i64, n_acknowledged);
    }
}

/// The child. Alone it does nothing.
#[tokio::test]
#[ignore = "run by a_catalogue_that_cannot_be_written_is_read_only_and_keeps_what_it_acknowledged"]
async fn write_until_refused() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let store = Store::open(Path::new(&folder)).await.unwrap();
    let mut n_acknowledged = 0;
    let error = loop {
        let mut big = event("x");
        big.body = serde_json::Value::from("x".repeat(50_000));
        match store.catalogue.commit(vec![Change::AppendEvent(big)]).await {
            Ok(_) => n_acknowledged += 1,
            Err(error) => break error,
        }
    };
    assert!(matches!(error, StoreError::ReadOnly { .. }), "{error}");
    let next = store.catalogue.commit(vec![Change::AppendEvent(event("y"))]).await.unwrap_err();
    assert!(matches!(next, StoreError::ReadOnly { .. }), "{next}");
    assert!(matches!(store.artifacts.put(b"z").await.unwrap_err(), StoreError::ReadOnly { .. }));
    assert_eq!(store.catalogue.last_event_seq().await.unwrap(), n_acknowledged);
    println!("\nacknowledged {n_acknowledged}");
}
