//! The binary under test, a small rendered capture, and copies of it to be damaged.

pub mod controller;
pub mod server;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::UNIX_EPOCH;

use serde_json::Value;
use tempfile::TempDir;

pub const SHEAF: &str = env!("CARGO_BIN_EXE_sheaf");

/// Runs `sheaf` with the arguments.
pub fn sheaf<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Output {
    Command::new(SHEAF).args(arguments).stdin(Stdio::null()).output().unwrap()
}

/// Runs `sheaf` and asserts success.
#[track_caller]
pub fn sheaf_ok<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Output {
    let output = sheaf(arguments);
    assert!(output.status.success(), "{}", err(&output));
    output
}

/// Runs `sheaf --json` and returns the one JSON value on stdout.
#[track_caller]
pub fn sheaf_json<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> (Value, i32) {
    let output = Command::new(SHEAF).args(arguments).arg("--json").output().unwrap();
    let value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}{}", out(&output), err(&output)));
    (value, output.status.code().unwrap())
}

pub fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

pub fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub fn path(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

/// A capture of six poses, three stage views and a gauge scan at 640 × 512, rendered once per build of the binary.
///
/// Test runners start a process per test, so the folder is shared on disk; it appears under its name only when complete.
pub fn small_capture() -> PathBuf {
    shared("small", |folder| {
        sheaf_ok(&[
            "twin",
            "capture",
            "--scene",
            "gauge,sphere",
            "--seed",
            "5",
            "--width-px",
            "640",
            "--height-px",
            "512",
            "--poses",
            "6",
            "--frames",
            "16",
            "--quiet",
            "-o",
            folder,
        ]);
    })
}

/// The calibration of [`small_capture`].
pub fn small_calibration() -> PathBuf {
    shared("small-calibration", |folder| {
        std::fs::create_dir_all(folder).unwrap();
        let capture = small_capture();
        sheaf_ok(&["calibrate", capture.to_str().unwrap(), "-o", &path(Path::new(folder), "cal.json"), "--quiet"]);
    })
    .join("cal.json")
}

fn shared(name: &str, make: impl FnOnce(&str)) -> PathBuf {
    let built = std::fs::metadata(SHEAF).unwrap().modified().unwrap().duration_since(UNIX_EPOCH).unwrap();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", built.as_nanos()));
    if folder.is_dir() {
        return folder;
    }
    std::fs::create_dir_all(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let draft = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let inner = draft.path().join("made");
    make(inner.to_str().unwrap());
    // Another test may have been faster; its folder has the same content.
    let _ = std::fs::rename(&inner, &folder);
    assert!(folder.is_dir());
    folder
}

/// A copy of the small capture that may be damaged. Images are linked; replace them, do not write into them.
pub fn copy_of_small() -> TempDir {
    let copy = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    copy_folder(&small_capture(), copy.path());
    copy
}

fn copy_folder(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            std::fs::create_dir_all(&target).unwrap();
            copy_folder(&entry.path(), &target);
        } else {
            std::fs::hard_link(entry.path(), &target).unwrap();
        }
    }
}

/// Replaces a file of a copy.
pub fn replace(folder: &Path, name: &str, bytes: &[u8]) {
    let file = folder.join(name);
    let _ = std::fs::remove_file(&file);
    std::fs::write(file, bytes).unwrap();
}

/// Changes the manifest of a copy.
pub fn edit_manifest(folder: &Path, edit: impl FnOnce(&mut Value)) {
    let file = folder.join("capture.json");
    let mut manifest: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    edit(&mut manifest);
    replace(folder, "capture.json", serde_json::to_string_pretty(&manifest).unwrap().as_bytes());
}
