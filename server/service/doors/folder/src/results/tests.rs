//! Writing results: whole, never over another file, once; on a real folder, with injected failures.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use app::doors::{InspectionMessage, Undelivered};
use nix::errno::Errno;
use tempfile::TempDir;

use crate::disk::{Disk, LocalDisk};
use crate::results::{Document, write_all};

/// An inspection with a two-sided and a one-sided characteristic.
pub fn inspection() -> InspectionMessage {
    let sample = include_str!("../../../../../../tests/golden/doors/inspection.json");
    serde_json::from_str(sample).unwrap()
}

/// A disk on which one operation fails.
#[derive(Default)]
struct Failing {
    write: Option<Errno>,
    sync_file: Option<Errno>,
    rename: Option<Errno>,
    sync_folder: Option<Errno>,
}

fn failed(errno: Option<Errno>) -> io::Result<()> {
    errno.map_or(Ok(()), |errno| Err(errno.into()))
}

impl Disk for Failing {
    fn write(&self, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        // Half of it has been written when the disk is full.
        LocalDisk.write(file, &bytes[..bytes.len() / 2])?;
        failed(self.write)?;
        LocalDisk.write(file, &bytes[bytes.len() / 2..])
    }

    fn sync_file(&self, file: &File) -> io::Result<()> {
        failed(self.sync_file)?;
        LocalDisk.sync_file(file)
    }

    fn rename_new(&self, from: &Path, to: &Path) -> io::Result<()> {
        failed(self.rename)?;
        LocalDisk.rename_new(from, to)
    }

    fn sync_folder(&self, folder: &Path) -> io::Result<()> {
        failed(self.sync_folder)?;
        LocalDisk.sync_folder(folder)
    }
}

fn both(text: &str) -> [Document; 2] {
    ["json", "csv"].map(|extension| Document { extension, bytes: text.as_bytes().to_vec() })
}

fn write(folder: &TempDir, text: &str) -> Result<(), Undelivered> {
    write_all(&LocalDisk, folder.path(), "S1", &both(text))
}

/// Names and contents of all files.
fn files(folder: &TempDir) -> Vec<(String, String)> {
    let read = |entry: io::Result<fs::DirEntry>| {
        let entry = entry.unwrap();
        (entry.file_name().into_string().unwrap(), fs::read_to_string(entry.path()).unwrap())
    };
    let mut files: Vec<_> = fs::read_dir(folder.path()).unwrap().map(read).collect();
    files.sort();
    files
}

fn named(names: &[(&str, &str)]) -> Vec<(String, String)> {
    names.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect()
}

#[test]
fn a_repetition_changes_nothing_and_another_content_gets_a_suffix() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder, "one").unwrap();
    write(&folder, "one").unwrap();
    assert_eq!(files(&folder), named(&[("S1.csv", "one"), ("S1.json", "one")]));
    write(&folder, "two").unwrap();
    write(&folder, "two").unwrap();
    write(&folder, "one").unwrap();
    let all = [("S1-2.csv", "two"), ("S1-2.json", "two"), ("S1.csv", "one"), ("S1.json", "one")];
    assert_eq!(files(&folder), named(&all));
}

#[test]
fn a_repetition_after_a_crash_between_two_formats_writes_the_missing_one() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("S1.json"), "one").unwrap();
    write(&folder, "one").unwrap();
    assert_eq!(files(&folder), named(&[("S1.csv", "one"), ("S1.json", "one")]));
}

#[test]
fn all_formats_of_an_inspection_have_the_same_name() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("S1.csv"), "of somebody else").unwrap();
    write(&folder, "one").unwrap();
    let all = [("S1-2.csv", "one"), ("S1-2.json", "one"), ("S1.csv", "of somebody else")];
    assert_eq!(files(&folder), named(&all));
}

#[test]
fn a_share_that_cannot_be_written_is_unreachable_and_nothing_half_written_remains() {
    let all = [
        (Failing { write: Some(Errno::ENOSPC), ..Failing::default() }, "full"),
        (Failing { write: Some(Errno::EDQUOT), ..Failing::default() }, "full"),
        (Failing { write: Some(Errno::EROFS), ..Failing::default() }, "read-only"),
        (Failing { sync_file: Some(Errno::EIO), ..Failing::default() }, "write S1.json"),
        (Failing { rename: Some(Errno::EHOSTDOWN), ..Failing::default() }, "rename S1.json"),
        (Failing { rename: Some(Errno::ESTALE), ..Failing::default() }, "rename S1.json"),
    ];
    for (disk, expected) in all {
        let folder = tempfile::tempdir().unwrap();
        match write_all(&disk, folder.path(), "S1", &both("one")) {
            Err(Undelivered::Unreachable { reason, .. }) => assert!(reason.contains(expected), "{reason}"),
            other => panic!("{other:?}"),
        }
        assert_eq!(files(&folder), []);
        write(&folder, "one").unwrap();
        assert_eq!(files(&folder), named(&[("S1.csv", "one"), ("S1.json", "one")]));
    }
}

#[test]
fn a_folder_that_cannot_be_synced_is_no_delivery() {
    let folder = tempfile::tempdir().unwrap();
    let disk = Failing { sync_folder: Some(Errno::EIO), ..Failing::default() };
    // Neither new files nor those that exist already.
    for _ in 0..2 {
        let outcome = write_all(&disk, folder.path(), "S1", &both("one"));
        assert!(matches!(outcome, Err(Undelivered::Unreachable { .. })), "{outcome:?}");
    }
    write(&folder, "one").unwrap();
    assert_eq!(files(&folder).len(), 2);
}

#[test]
fn a_missing_folder_is_unreachable_and_not_created() {
    let folder = tempfile::tempdir().unwrap();
    let share = folder.path().join("share");
    match write_all(&LocalDisk, &share, "S1", &both("one")) {
        Err(Undelivered::Unreachable { reason, .. }) => assert!(reason.contains("mounted"), "{reason}"),
        other => panic!("{other:?}"),
    }
    assert!(!share.exists());
    fs::write(&share, "no folder").unwrap();
    let outcome = write_all(&LocalDisk, &share, "S1", &both("one"));
    assert!(matches!(outcome, Err(Undelivered::Unreachable { .. })), "{outcome:?}");
}

#[test]
fn a_name_that_the_share_refuses_does_not_hold_up_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = write_all(&LocalDisk, folder.path(), &"n".repeat(300), &both("one"));
    assert!(matches!(outcome, Err(Undelivered::Refused(_))), "{outcome:?}");
}

#[test]
fn a_writer_of_the_same_name_in_between_is_not_overwritten() {
    /// Another server is faster, each time.
    struct Overtaken;
    impl Disk for Overtaken {
        fn rename_new(&self, from: &Path, to: &Path) -> io::Result<()> {
            if !to.to_str().unwrap().contains("-2") {
                fs::write(to, "faster")?;
            }
            LocalDisk.rename_new(from, to)
        }
    }
    let folder = tempfile::tempdir().unwrap();
    write_all(&Overtaken, folder.path(), "S1", &both("one")).unwrap();
    let all = [("S1-2.csv", "one"), ("S1-2.json", "one"), ("S1.json", "faster")];
    assert_eq!(files(&folder), named(&all));
}
