//! Valid and malicious archives, stored by the real store.
//!
//! Not tested: memory use. The limits count bytes written and images decoded at once.

#![allow(clippy::unwrap_used)]

use crate::error::ErrorKind;
use std::collections::BTreeSet;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use capture::{
    CameraFormat, ChessboardTarget, Frame, GratingProjector, Manifest, NominalPosition, Scan, StageDescription,
    write_manifest, write_png,
};
use store::Store;
use tar::{Builder, EntryType, Header};
use vision::{GreyImage, Pixels};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::*;

type Entries = Vec<(String, Vec<u8>)>;

/// An empty store.
struct Bench {
    folder: tempfile::TempDir,
    runtime: tokio::runtime::Runtime,
    captures: Captures,
    catalogue: EventedCatalogue,
    _store: Store,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let runtime = tokio::runtime::Runtime::new().unwrap();
        let store = runtime.block_on(Store::open(&folder.path().join("data"))).unwrap();
        let catalogue = runtime.block_on(EventedCatalogue::open(store.catalogue.clone())).unwrap();
        let _guard = runtime.enter();
        let cache = folder.path().join("cache");
        let captures = Captures::new(catalogue.clone(), store.artifacts.clone(), &cache).unwrap();
        drop(_guard);
        Self { folder, runtime, captures, catalogue, _store: store }
    }

    fn take_in(&self, bytes: &[u8], format: ArchiveFormat) -> Result<CaptureRecord, AppError> {
        let path = self.captures.artifacts.workbench().scratch().join("upload");
        std::fs::write(&path, bytes).unwrap();
        let (record, change) = self.captures.take_in(&path, format, CaptureOrigin::Upload, "test")?;
        self.runtime.block_on(self.catalogue.commit(vec![change])).unwrap();
        Ok(record)
    }

    /// Everything on disk except the files of the catalogue.
    fn files(&self) -> BTreeSet<PathBuf> {
        let mut files = BTreeSet::new();
        let mut folders = vec![self.folder.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if !path.to_string_lossy().contains("sqlite") && !path.to_string_lossy().contains(".db") {
                    files.insert(path);
                }
            }
        }
        files
    }
}

/// A capture of two frames, 48 × 32 pixels.
fn good() -> Entries {
    let folder = tempfile::tempdir().unwrap();
    let frame = |idx: usize| Frame::new(format!("scan/{idx}.png"), NominalPosition::PositionMm(idx as f64));
    let manifest = Manifest {
        format: "sheaf-capture/1".to_owned(),
        stage: StageDescription::default(),
        background: None,
        camera: CameraFormat::of_size(48, 32),
        target: ChessboardTarget { inner_columns: 11, inner_rows: 8, square_mm: 12.0.into() }.into(),
        projector: GratingProjector {
            wavelength_nm: 660.0,
            grating_lines_per_mm: 50.0,
            orders: vec![-1, 0, 1],
            line_direction: None,
        }
        .into(),
        poses: Vec::new(),
        stage_views: Vec::new(),
        scans: vec![Scan { name: "part".to_owned(), frames: vec![frame(0), frame(1)] }],
    };
    write_manifest(folder.path(), &manifest).unwrap();
    let noise = |seed: usize| (0..48 * 32).map(|pixel| ((pixel * 7919 + seed * 31) % 251) as u8).collect();
    let png = |seed| {
        let path = folder.path().join("picture.png");
        write_png(&path, &GreyImage::new(48, 32, Pixels::Eight(noise(seed))).unwrap()).unwrap();
        std::fs::read(path).unwrap()
    };
    vec![
        ("capture.json".to_owned(), std::fs::read(folder.path().join("capture.json")).unwrap()),
        ("scan/0.png".to_owned(), png(0)),
        ("scan/1.png".to_owned(), png(1)),
    ]
}

fn with(name: &str, bytes: &[u8]) -> Entries {
    let mut entries = good();
    entries.retain(|(other, _)| other != name);
    entries.push((name.to_owned(), bytes.to_vec()));
    entries
}

fn zip(entries: &Entries) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        writer.start_file(name.as_str(), SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn tar(entries: &Entries) -> Vec<u8> {
    let mut builder = Builder::new(Vec::new());
    for (name, bytes) in entries {
        add(&mut builder, EntryType::Regular, name, bytes);
    }
    builder.into_inner().unwrap()
}

/// Writes the name unchanged; the library would refuse malicious ones.
fn add(builder: &mut Builder<Vec<u8>>, kind: EntryType, name: &str, bytes: &[u8]) {
    let mut header = Header::new_gnu();
    header.as_gnu_mut().unwrap().name[..name.len()].copy_from_slice(name.as_bytes());
    header.set_entry_type(kind);
    header.set_size(bytes.len() as u64);
    header.set_mode(0o644);
    header.set_cksum();
    builder.append(&header, bytes).unwrap();
}

fn good_tar_and(kind: EntryType, name: &str, bytes: &[u8]) -> Vec<u8> {
    let mut builder = Builder::new(Vec::new());
    add(&mut builder, kind, name, bytes);
    for (name, bytes) in good() {
        add(&mut builder, EntryType::Regular, &name, &bytes);
    }
    builder.into_inner().unwrap()
}

fn under(folder: &str, entries: Entries) -> Entries {
    entries.into_iter().map(|(name, bytes)| (format!("{folder}/{name}"), bytes)).collect()
}

/// Stores an archive that must be refused with one of `kinds` and must leave nothing behind.
fn refused(bench: &Bench, what: &str, bytes: &[u8], format: ArchiveFormat, kinds: &[ErrorKind]) {
    let before = bench.files();
    let problem = bench.take_in(bytes, format).map(|record| record.summary).expect_err(what);
    assert!(kinds.contains(&problem.kind), "{what}: {problem:?}");
    assert!(problem.remedy.is_some(), "{what}: {problem:?}");
    let message = format!("{problem:?}");
    assert!(!message.contains(&*bench.folder.path().to_string_lossy()), "{what} reveals a server path: {message}");
    assert_eq!(bench.files(), before, "{what} leaves something");
}

#[test]
fn a_capture_is_returned_unchanged_even_without_the_cache() {
    let bench = Bench::new();
    for (bytes, format) in [
        (zip(&good()), ArchiveFormat::Zip),
        (tar(&good()), ArchiveFormat::Tar),
        (zip(&under("rig-a", good())), ArchiveFormat::Zip),
        (tar(&under("./rig-a", good())), ArchiveFormat::Tar),
    ] {
        let record = bench.take_in(&bytes, format).unwrap();
        assert_eq!(record.summary["scans"][0]["n_frames"], 2);
        for wiped in [false, true] {
            if wiped {
                let cache = bench.folder.path().join("cache").join(record.archive.as_str());
                std::fs::remove_dir_all(cache).unwrap();
            }
            let out = bench.captures.check_out(&record.id).unwrap();
            for (name, bytes) in good() {
                assert_eq!(std::fs::read(out.folder.join(name)).unwrap(), bytes);
            }
        }
    }
}

#[test]
fn names_that_leave_the_folder_are_refused_and_leave_nothing() {
    let bench = Bench::new();
    for name in ["../evil.png", "a/../../evil.png", "/tmp/evil.png", "a\\..\\evil.png", "C:evil.png"] {
        refused(&bench, name, &zip(&with(name, b"x")), ArchiveFormat::Zip, &[ErrorKind::Impossible]);
        refused(&bench, name, &tar(&with(name, b"x")), ArchiveFormat::Tar, &[ErrorKind::Impossible]);
    }
    refused(
        &bench,
        "deep",
        &tar(&with(&("d/".repeat(20) + "x"), b"x")),
        ArchiveFormat::Tar,
        &[ErrorKind::Impossible],
    );
}

#[test]
fn two_entries_of_one_name_are_refused() {
    let bench = Bench::new();
    refused(&bench, "case", &zip(&with("SCAN/0.PNG", b"x")), ArchiveFormat::Zip, &[ErrorKind::Impossible]);
    refused(&bench, "case", &tar(&with("CAPTURE.json", b"x")), ArchiveFormat::Tar, &[ErrorKind::Impossible]);
    let mut twice = good();
    twice.push(good()[1].clone());
    refused(&bench, "twice", &tar(&twice), ArchiveFormat::Tar, &[ErrorKind::Impossible]);
    // The zip library refuses to write a name twice, so a name is changed in the finished archive.
    let mut bytes = zip(&with("scan/2.png", b"x"));
    for at in 0..bytes.len() - 10 {
        if &bytes[at..at + 10] == b"scan/2.png" {
            bytes[at + 5] = b'1';
        }
    }
    refused(&bench, "twice", &bytes, ArchiveFormat::Zip, &[ErrorKind::Impossible]);
}

#[test]
fn links_and_devices_are_refused() {
    let bench = Bench::new();
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    writer.add_symlink("capture.json", "/etc/passwd", SimpleFileOptions::default()).unwrap();
    let bytes = writer.finish().unwrap().into_inner();
    refused(&bench, "symlink", &bytes, ArchiveFormat::Zip, &[ErrorKind::Impossible]);
    for kind in [
        EntryType::Symlink,
        EntryType::Link,
        EntryType::Char,
        EntryType::Block,
        EntryType::Fifo,
        EntryType::GNUSparse,
    ] {
        refused(
            &bench,
            "link or device",
            &good_tar_and(kind, "x.png", b""),
            ArchiveFormat::Tar,
            &[ErrorKind::BadRequest, ErrorKind::Impossible],
        );
    }
}

#[test]
fn extended_tar_headers_are_read_within_limits() {
    let bench = Bench::new();
    let long = vec![b'a'; 1 << 20];
    refused(
        &bench,
        "long name",
        &good_tar_and(EntryType::GNULongName, "x", &long),
        ArchiveFormat::Tar,
        &[ErrorKind::BadRequest],
    );
    refused(
        &bench,
        "long header",
        &good_tar_and(EntryType::XHeader, "x", &long),
        ArchiveFormat::Tar,
        &[ErrorKind::BadRequest],
    );
    let records: [&[u8]; 4] = [b"999 path=x\n", b"path=x\n", b"0 path=x\n", b"19 size=99999999999\n"];
    for record in records {
        refused(
            &bench,
            "bad record",
            &good_tar_and(EntryType::XHeader, "x", record),
            ArchiveFormat::Tar,
            &[ErrorKind::BadRequest],
        );
    }
    // The header's name applies to the entry after it: the manifest, which is then not found.
    let evil = good_tar_and(EntryType::XHeader, "x", b"21 path=../../passwd\n");
    refused(&bench, "evil path", &evil, ArchiveFormat::Tar, &[ErrorKind::Impossible]);
    let named = good_tar_and(EntryType::XHeader, "x", b"21 path=capture.json\n");
    bench.take_in(&named, ArchiveFormat::Tar).unwrap();
}

#[test]
fn archive_bombs_are_stopped_while_unpacking() {
    let bench = Bench::new();
    let zeros = vec![0; limits::FILE_LIMIT_BYTES as usize + 1];
    refused(&bench, "large file", &zip(&with("zeros", &zeros)), ArchiveFormat::Zip, &[ErrorKind::TooLarge]);
    // Each file is small enough; together they are 300 times the archive.
    let many: Entries = (0..5).map(|idx| (format!("{idx}.bin"), zeros[..60 << 20].to_vec())).collect();
    refused(&bench, "ratio", &zip(&many), ArchiveFormat::Zip, &[ErrorKind::TooLarge]);
}

#[test]
fn a_hundred_thousand_entries_are_too_many() {
    let bench = Bench::new();
    let entries: Entries = (0..100_000).map(|idx| (format!("{idx}"), Vec::new())).collect();
    refused(&bench, "entries", &zip(&entries), ArchiveFormat::Zip, &[ErrorKind::TooLarge]);
    refused(&bench, "entries", &tar(&entries), ArchiveFormat::Tar, &[ErrorKind::TooLarge]);
}

#[test]
fn an_archive_without_a_capture_is_refused() {
    let bench = Bench::new();
    let whole = zip(&good());
    refused(&bench, "random bytes", &[7; 3000], ArchiveFormat::Zip, &[ErrorKind::BadRequest]);
    refused(&bench, "random bytes", &[7; 3000], ArchiveFormat::Tar, &[ErrorKind::BadRequest]);
    refused(&bench, "empty", &[], ArchiveFormat::Zip, &[ErrorKind::BadRequest]);
    refused(&bench, "empty", &[], ArchiveFormat::Tar, &[ErrorKind::Impossible]);
    refused(&bench, "truncated", &whole[..whole.len() - 30], ArchiveFormat::Zip, &[ErrorKind::BadRequest]);
    refused(
        &bench,
        "truncated",
        &tar(&good())[..1500],
        ArchiveFormat::Tar,
        &[ErrorKind::BadRequest, ErrorKind::Impossible],
    );
    refused(&bench, "no manifest", &zip(&good()[1..].to_vec()), ArchiveFormat::Zip, &[ErrorKind::Impossible]);
    let two: Entries = [under("a", good()), under("b", good())].concat();
    refused(&bench, "two captures", &zip(&two), ArchiveFormat::Zip, &[ErrorKind::Impossible]);
    let text = String::from_utf8(good()[0].1.clone()).unwrap().replace("scan/1.png", "../../../etc/passwd");
    refused(
        &bench,
        "manifest leaves",
        &zip(&with("capture.json", text.as_bytes())),
        ArchiveFormat::Zip,
        &[ErrorKind::Impossible],
    );
    let large = vec![b' '; limits::MANIFEST_LIMIT_BYTES as usize + 1];
    refused(
        &bench,
        "manifest large",
        &zip(&with("capture.json", &large)),
        ArchiveFormat::Zip,
        &[ErrorKind::TooLarge],
    );
}

#[test]
fn images_with_false_headers_are_refused() {
    let bench = Bench::new();
    let picture = good()[1].1.clone();
    let sized = |width: u32, height: u32| {
        let mut bytes = picture.clone();
        bytes[16..20].copy_from_slice(&width.to_be_bytes());
        bytes[20..24].copy_from_slice(&height.to_be_bytes());
        bytes
    };
    let cut = picture[..picture.len() / 2].to_vec();
    for (what, bytes) in [
        ("huge", sized(60_000, 60_000)),
        ("larger than the disk", sized(u32::MAX, u32::MAX)),
        ("another size", sized(49, 32)),
        ("a header checksum that is wrong", sized(32, 48)),
        ("cut", cut),
        ("no picture", b"hello".to_vec()),
    ] {
        refused(&bench, what, &zip(&with("scan/1.png", &bytes)), ArchiveFormat::Zip, &[ErrorKind::Impossible]);
    }
}

#[test]
fn packing_is_reproducible() {
    let bench = Bench::new();
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in good() {
        std::fs::create_dir_all(folder.path().join("scan")).unwrap();
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let take = |folder: &Path| bench.captures.take_in_folder(folder, CaptureOrigin::Scan, "frames").unwrap();
    let (first, change) = take(folder.path());
    let (second, _) = take(folder.path());
    assert_eq!(first.archive, second.archive);
    bench.runtime.block_on(bench.catalogue.commit(vec![change])).unwrap();
    let out = bench.captures.check_out(&first.id).unwrap();
    for (name, bytes) in good() {
        assert_eq!(std::fs::read(out.folder.join(name)).unwrap(), bytes);
    }
}
