//! Orders in a real folder, with inspections that follow a script: each is started once, whatever happens in between.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::os::unix::fs::symlink;
use std::sync::atomic::{AtomicBool, Ordering};

use app::error::ErrorKind;
use async_trait::async_trait;
use parking_lot::Mutex;
use tempfile::TempDir;

use super::*;
use crate::disk::LocalDisk;

type Answer = Box<dyn FnMut(&str) -> Result<(), AppError> + Send>;

/// The service: what was started, and the stored keys, which outlive a crash of the folder.
struct Service {
    answer: Mutex<Answer>,
    serials: Mutex<Vec<String>>,
    keys: Mutex<BTreeSet<String>>,
}

#[async_trait]
impl Inspections for Service {
    async fn is_started(&self, key: &str) -> Result<bool, AppError> {
        Ok(self.keys.lock().contains(key))
    }

    async fn start(&self, _file: &str, order: &Order, key: &str) -> Result<(), AppError> {
        (self.answer.lock())(&order.part.serial)?;
        assert!(self.keys.lock().insert(key.to_owned()), "{key} is started again");
        self.serials.lock().push(order.part.serial.clone());
        Ok(())
    }

    async fn release(&self, key: &str) -> Result<(), AppError> {
        assert!(self.keys.lock().remove(key), "{key} is not stored");
        Ok(())
    }
}

/// A disk whose renames fail on request.
#[derive(Default)]
struct Moves {
    fail: AtomicBool,
}

impl Disk for Moves {
    fn rename_new(&self, from: &Path, to: &Path) -> io::Result<()> {
        match self.fail.load(Ordering::SeqCst) {
            true => Err(nix::errno::Errno::EROFS.into()),
            false => LocalDisk.rename_new(from, to),
        }
    }
}

struct Bench {
    folder: TempDir,
    service: Arc<Service>,
    disk: Arc<Moves>,
    orders: Orders,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let answer: Answer = Box::new(|_| Ok(()));
        let service =
            Arc::new(Service { answer: Mutex::new(answer), serials: Mutex::default(), keys: Mutex::default() });
        let disk = Arc::new(Moves::default());
        let orders = Orders::new("mes", folder.path().to_owned(), disk.clone(), service.clone());
        Self { folder, service, disk, orders }
    }

    /// The process was killed and started again.
    fn restart(&mut self) {
        self.orders = Orders::new("mes", self.folder.path().to_owned(), self.disk.clone(), self.service.clone());
    }

    fn put(&self, name: &str, text: &str) {
        fs::write(self.folder.path().join(name), text).unwrap();
    }

    fn answer(&self, answer: impl FnMut(&str) -> Result<(), AppError> + Send + 'static) {
        *self.service.answer.lock() = Box::new(answer);
    }

    /// Finds files, and then takes those that have not changed.
    async fn poll_twice(&mut self) {
        self.orders.poll().await;
        self.orders.poll().await;
    }

    fn started(&self) -> Vec<String> {
        self.service.serials.lock().clone()
    }

    /// All files below the folder with their texts.
    fn files(&self) -> BTreeMap<String, String> {
        let mut files = BTreeMap::new();
        for below in ["", "accepted/", "refused/"] {
            let Ok(entries) = fs::read_dir(self.folder.path().join(below)) else { continue };
            for entry in entries.map(Result::unwrap).filter(|entry| !entry.path().is_dir()) {
                let name = entry.file_name().into_string().unwrap();
                let text = fs::read(entry.path()).unwrap();
                files.insert(format!("{below}{name}"), String::from_utf8_lossy(&text).into_owned());
            }
        }
        files
    }

    fn names(&self) -> Vec<String> {
        self.files().into_keys().collect()
    }
}

fn halted() -> AppError {
    AppError::new(ErrorKind::Halted, "the station is stopped").remedy("reset it")
}

fn impossible() -> AppError {
    AppError::new(ErrorKind::Impossible, "there is no such recipe").remedy("give another one")
}

#[tokio::test]
async fn orders_are_started_once_and_their_files_are_accepted() {
    let mut bench = Bench::new();
    bench.put("a.json", r#"{"serial":"S1"}"#);
    bench.put("b.CSV", "serial,recipe\nS2,bracket\nS3,bracket\nS3,bracket\n");
    bench.put("readme.txt", "not an order");
    bench.put(".hidden.json", "not an order");
    bench.poll_twice().await;
    bench.poll_twice().await;
    let mut started = bench.started();
    started.sort();
    assert_eq!(started, ["S1", "S2", "S3", "S3"]);
    assert_eq!(bench.names(), [".hidden.json", "accepted/a.json", "accepted/b.CSV", "readme.txt"]);
    assert_eq!(bench.service.keys.lock().len(), 0);
}

#[tokio::test]
async fn the_same_file_put_there_again_is_a_new_order() {
    let mut bench = Bench::new();
    for _ in 0..2 {
        bench.put("a.json", r#"{"serial":"S1"}"#);
        bench.poll_twice().await;
    }
    assert_eq!(bench.started(), ["S1", "S1"]);
    assert_eq!(bench.names(), ["accepted/a-2.json", "accepted/a.json"]);
}

#[tokio::test]
async fn a_file_that_is_still_being_written_is_left_alone() {
    let mut bench = Bench::new();
    let whole = "serial\nS1\nS2\n";
    for n in 1..=whole.len() {
        bench.put("a.csv", &whole[..n]);
        bench.orders.poll().await;
        assert_eq!(bench.started(), [""; 0]);
    }
    bench.orders.poll().await;
    assert_eq!(bench.started(), ["S1", "S2"]);
}

#[tokio::test]
async fn nothing_is_started_twice_when_the_server_is_killed_before_the_file_is_moved() {
    let mut bench = Bench::new();
    bench.put("a.csv", "serial\nS1\nS2\n");
    // Killed after the second order was stored.
    bench.disk.fail.store(true, Ordering::SeqCst);
    bench.poll_twice().await;
    assert_eq!((bench.started().len(), bench.names()), (2, vec!["a.csv".to_owned()]));
    bench.restart();
    bench.poll_twice().await;
    bench.disk.fail.store(false, Ordering::SeqCst);
    bench.restart();
    bench.poll_twice().await;
    assert_eq!(bench.started(), ["S1", "S2"]);
    assert_eq!(bench.names(), ["accepted/a.csv"]);
}

#[tokio::test]
async fn orders_wait_while_the_station_is_stopped_and_are_then_started_in_order() {
    let mut bench = Bench::new();
    bench.put("a.csv", "serial\nS1\nS2\nS3\n");
    bench.poll_twice().await;
    bench.put("b.csv", "serial\nS4\nS5\nS6\n");
    bench.answer(|serial| if serial == "S5" { Err(halted()) } else { Ok(()) });
    bench.poll_twice().await;
    let begun = std::time::Instant::now();
    while begun.elapsed() < std::time::Duration::from_millis(20) {}
    bench.put("c.json", r#"{"serial":"S7"}"#);
    bench.poll_twice().await;
    assert_eq!(bench.started(), ["S1", "S2", "S3", "S4"]);
    assert_eq!(bench.names(), ["accepted/a.csv", "b.csv", "c.json"]);
    assert_eq!(bench.orders.waiting.as_deref(), Some("Halted"));
    // A restart while they wait repeats nothing.
    bench.restart();
    bench.answer(|_| Ok(()));
    bench.poll_twice().await;
    assert_eq!(bench.started(), ["S1", "S2", "S3", "S4", "S5", "S6", "S7"]);
    assert_eq!(bench.orders.waiting, None);
    assert_eq!(bench.service.keys.lock().len(), 0);
}

#[test]
fn every_state_of_the_station_that_passes_makes_an_order_wait() {
    use ErrorKind::*;
    let temporary = [Halted, StationBusy, ControlRequired, Unavailable, StorageFull, DeviceFault, TooMany];
    assert!(temporary.into_iter().all(is_temporary));
    let lasting = [BadRequest, NotFound, Conflict, TooLarge, Impossible, Damaged];
    assert!(!lasting.into_iter().any(is_temporary));
}

#[tokio::test]
async fn a_refused_file_has_a_text_with_reason_and_remedy_beside_it() {
    let mut bench = Bench::new();
    bench.answer(|_| Err(impossible()));
    bench.put("a.json", r#"{"serial":"S1"}"#);
    bench.put("b.json", "{");
    bench.poll_twice().await;
    assert_eq!(bench.names(), ["refused/a.json", "refused/a.json.txt", "refused/b.json", "refused/b.json.txt"]);
    let note = bench.files().remove("refused/a.json.txt").unwrap();
    assert!(note.contains("there is no such recipe") && note.contains("Remedy: give another one"), "{note}");
    // Again under the same name, with another reason.
    bench.put("a.json", "[]");
    bench.poll_twice().await;
    let note = bench.files().remove("refused/a-2.json.txt").unwrap();
    assert!(note.contains("not an order"), "{note}");
    assert_eq!(bench.started(), [""; 0]);
}

#[tokio::test]
async fn a_corrected_table_does_not_repeat_what_was_accepted() {
    let mut bench = Bench::new();
    bench.answer(|serial| if serial == "bad" { Err(impossible()) } else { Ok(()) });
    bench.put("a.csv", "serial\nS1\nbad\nS2\n");
    bench.poll_twice().await;
    assert_eq!(bench.started(), ["S1", "S2"]);
    let note = bench.files().remove("refused/a.csv.txt").unwrap();
    assert!(note.contains("Row 3: there is no such recipe") && note.contains("2 other orders"), "{note}");
    bench.restart();
    bench.put("a.csv", "serial\nS1\ngood\nS2\n");
    bench.poll_twice().await;
    assert_eq!(bench.started(), ["S1", "S2", "good"]);
    assert_eq!(bench.service.keys.lock().len(), 0);
}

#[tokio::test]
async fn a_malformed_row_starts_none_of_the_others() {
    let mut bench = Bench::new();
    bench.put("a.csv", "serial,recipe\nS1,bracket\nS2,b@c\n");
    bench.poll_twice().await;
    assert_eq!((bench.started(), bench.names().len()), (vec![], 2));
}

#[tokio::test]
async fn nothing_is_started_from_a_folder_whose_files_cannot_be_moved() {
    let mut bench = Bench::new();
    fs::write(bench.folder.path().join("accepted"), "not a folder").unwrap();
    bench.put("a.json", r#"{"serial":"S1"}"#);
    bench.poll_twice().await;
    assert_eq!(bench.started(), [""; 0]);
    assert!(bench.orders.waiting.as_ref().is_some_and(|cause| cause.contains("not a folder")));
    fs::remove_file(bench.folder.path().join("accepted")).unwrap();
    bench.orders.poll().await;
    assert_eq!(bench.started(), ["S1"]);
}

#[tokio::test]
async fn links_are_never_followed() {
    let mut bench = Bench::new();
    let outside = tempfile::tempdir().unwrap();
    let secret = outside.path().join("secret.json");
    fs::write(&secret, r#"{"serial":"secret"}"#).unwrap();
    symlink(&secret, bench.folder.path().join("a.json")).unwrap();
    bench.poll_twice().await;
    assert_eq!(bench.started(), [""; 0]);
    let note = bench.files().remove("refused/a.json.txt").unwrap();
    assert!(note.contains("is a link"), "{note}");
    assert!(secret.exists());
    // Nor is a file moved out of the folder.
    symlink(outside.path(), bench.folder.path().join("accepted")).unwrap();
    bench.put("b.json", r#"{"serial":"S1"}"#);
    bench.poll_twice().await;
    assert_eq!((bench.started(), outside.path().join("b.json").exists()), (vec![], false));
}

#[tokio::test]
async fn a_link_put_in_place_of_a_file_after_it_was_found_is_not_read() {
    let bench = Bench::new();
    let secret = bench.folder.path().join("secret.txt");
    bench.put("secret.txt", r#"{"serial":"S1"}"#);
    bench.put("a.json", r#"{"serial":"S1"}"#);
    let [found] = &files::found(bench.folder.path()).unwrap()[..] else { panic!() };
    fs::remove_file(&found.path).unwrap();
    symlink(&secret, &found.path).unwrap();
    files::read(found).unwrap_err();
}

#[tokio::test]
async fn a_file_of_more_than_a_mebibyte_is_refused() {
    let mut bench = Bench::new();
    let rows = "S1,aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\n".repeat(20_000);
    bench.put("a.csv", &format!("serial,line\n{rows}"));
    bench.poll_twice().await;
    assert_eq!(bench.started(), [""; 0]);
    assert!(bench.files()["refused/a.csv.txt"].contains("too large"));
}

#[tokio::test]
async fn a_file_that_is_replaced_while_it_is_taken_is_read_again() {
    let mut bench = Bench::new();
    bench.put("a.csv", "serial\nS1\n");
    let path = bench.folder.path().join("a.csv");
    let mut is_first = true;
    bench.answer(move |_| {
        if std::mem::take(&mut is_first) {
            fs::write(&path, "serial\nS1\nS2\n").unwrap();
        }
        Ok(())
    });
    bench.poll_twice().await;
    assert_eq!((bench.started(), bench.names()), (vec!["S1".to_owned()], vec!["a.csv".to_owned()]));
    bench.poll_twice().await;
    assert_eq!(bench.started(), ["S1", "S2"]);
    assert_eq!(bench.names(), ["accepted/a.csv"]);
}

#[tokio::test]
async fn a_missing_folder_is_waited_for_and_not_created() {
    let mut bench = Bench::new();
    let folder = bench.folder.path().join("share");
    bench.orders = Orders::new("mes", folder.clone(), bench.disk.clone(), bench.service.clone());
    bench.poll_twice().await;
    assert!(!folder.exists());
    assert!(bench.orders.waiting.as_ref().is_some_and(|cause| cause.contains("mounted")));
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("a.json"), r#"{"serial":"S1"}"#).unwrap();
    bench.poll_twice().await;
    assert_eq!((bench.started(), &bench.orders.waiting), (vec!["S1".to_owned()], &None));
}
