//! The door over a folder: what it wants, writes and leaves; when it is unreachable.

use std::fs::{self, File};
use std::io;
use std::sync::mpsc::{Receiver, Sender, channel};

use parking_lot::Mutex;
use serde_json::{Value, json};
use tempfile::TempDir;

use super::*;
use crate::results::tests::inspection;

const PATIENCE: Duration = Duration::from_secs(60);

fn settings(share: &TempDir) -> Settings {
    let all = ["json", "csv", "dfq"];
    serde_json::from_value(json!({ "name": "mes", "path": share.path(), "formats": all })).unwrap()
}

fn door(share: &TempDir) -> Folder {
    Folder::new(settings(share), Arc::new(LocalDisk), PATIENCE).unwrap()
}

fn event(kind: &str, recipe: &str) -> EventRecord {
    let body = json!({ "recipe": recipe });
    EventRecord { seq: 9, kind: kind.to_owned(), subject: "01J".to_owned(), body, at_ms: 5 }
}

fn delivery() -> Delivery {
    Delivery::new(event(INSPECTION_FINISHED, "bracket@7"), Some(inspection()))
}

fn names(share: &TempDir) -> Vec<String> {
    let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<_> = fs::read_dir(share.path()).unwrap().map(name).collect();
    names.sort();
    names
}

#[test]
fn it_wants_the_inspections_of_the_chosen_recipes() {
    let share = tempfile::tempdir().unwrap();
    assert!(door(&share).wants(&event(INSPECTION_FINISHED, "bracket@7")));
    assert!(!door(&share).wants(&event("scan.created", "bracket@7")));
    let chosen = Settings { recipes: vec!["plate".to_owned()], ..settings(&share) };
    let door = Folder::new(chosen, Arc::new(LocalDisk), PATIENCE).unwrap();
    assert!(!door.wants(&event(INSPECTION_FINISHED, "bracket@7")));
    assert!(door.wants(&event(INSPECTION_FINISHED, "plate@1")));
}

#[tokio::test]
async fn an_inspection_is_written_in_every_format_and_a_repetition_changes_nothing() {
    let share = tempfile::tempdir().unwrap();
    door(&share).deliver(&delivery()).await.unwrap();
    let expected = ["S1_812.csv", "S1_812.dfq", "S1_812.json"];
    assert_eq!(names(&share), expected);
    let read = |name: &str| fs::read(share.path().join(name)).unwrap();
    let message: Value = serde_json::from_slice(&read("S1_812.json")).unwrap();
    assert_eq!(message, delivery().message());
    assert!(read("S1_812.csv").starts_with(b"inspection_id,"));
    assert!(read("S1_812.dfq").starts_with(b"K0100 2\r\n"));
    door(&share).deliver(&delivery()).await.unwrap();
    assert_eq!(names(&share), expected);
}

#[tokio::test]
async fn the_report_is_written_if_it_is_one_of_the_formats() {
    let share = tempfile::tempdir().unwrap();
    let formats = vec![Format::Json, Format::Pdf];
    let folder = Folder::new(Settings { formats, ..settings(&share) }, Arc::new(LocalDisk), PATIENCE).unwrap();
    assert!(folder.wants_report() && !door(&share).wants_report());
    let report_pdf = Some(b"%PDF-1.7".to_vec());
    folder.deliver(&Delivery { report_pdf, ..delivery() }).await.unwrap();
    assert_eq!(names(&share), ["S1_812.json", "S1_812.pdf"]);
    assert_eq!(fs::read(share.path().join("S1_812.pdf")).unwrap(), b"%PDF-1.7");
    let outcome = folder.deliver(&delivery()).await;
    assert_eq!(outcome, Err(Undelivered::Refused("the report is missing".to_owned())));
}

#[tokio::test]
async fn a_test_leaves_no_file_and_fails_without_the_share() {
    let share = tempfile::tempdir().unwrap();
    door(&share).deliver(&Delivery::test("mes")).await.unwrap();
    assert_eq!(names(&share), [""; 0]);
    let door = door(&share);
    share.close().unwrap();
    let outcome = door.deliver(&Delivery::test("mes")).await;
    assert!(matches!(outcome, Err(Undelivered::Unreachable { .. })), "{outcome:?}");
}

#[tokio::test]
async fn files_of_a_crash_are_removed_and_those_of_others_are_not() {
    let share = tempfile::tempdir().unwrap();
    for name in [".S1_811.csv.sheaf.tmp", ".S1_812.json.sheaf.tmp", ".other.tmp", "S0.csv"] {
        fs::write(share.path().join(name), "half").unwrap();
    }
    door(&share).deliver(&delivery()).await.unwrap();
    assert_eq!(names(&share), [".other.tmp", "S0.csv", "S1_812.csv", "S1_812.dfq", "S1_812.json"]);
}

/// A disk that blocks until the test lets it write.
struct Hanging {
    go: Mutex<Receiver<()>>,
}

impl Disk for Hanging {
    fn write(&self, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        self.go.lock().recv().ok();
        LocalDisk.write(file, bytes)
    }
}

fn hanging(share: &TempDir) -> (Folder, Sender<()>) {
    let (go, released) = channel();
    let disk = Hanging { go: Mutex::new(released) };
    (Folder::new(settings(share), Arc::new(disk), Duration::from_millis(50)).unwrap(), go)
}

#[tokio::test]
async fn a_hung_share_is_unreachable_and_the_delivery_is_repeated_once_it_answers() {
    let share = tempfile::tempdir().unwrap();
    let (door, go) = hanging(&share);
    for _ in 0..2 {
        match door.deliver(&delivery()).await {
            Err(Undelivered::Unreachable { reason, .. }) => assert!(reason.contains("hangs"), "{reason}"),
            other => panic!("{other:?}"),
        }
    }
    // From now on every write succeeds: the sender is gone.
    drop(go);
    while door.deliver(&delivery()).await.is_err() {}
    assert_eq!(names(&share), ["S1_812.csv", "S1_812.dfq", "S1_812.json"]);
}

#[test]
fn a_bad_template_or_folder_is_refused_at_the_start() {
    let share = tempfile::tempdir().unwrap();
    let bad = |settings: Settings| open(settings).map(|_| ()).unwrap_err().setting;
    assert_eq!(bad(Settings { file_name: "{part}".to_owned(), ..settings(&share) }), "file_name");
    assert_eq!(bad(Settings { path: "results".into(), ..settings(&share) }), "path");
    let orders = Some(share.path().to_owned());
    assert_eq!(bad(Settings { orders, ..settings(&share) }), "orders");
    let missing = Settings { path: "/mnt/missing/results".into(), ..settings(&share) };
    assert_eq!(open(missing).unwrap().target(), "/mnt/missing/results");
}
