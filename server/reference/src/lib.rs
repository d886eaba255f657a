//! Test requirements outside the repository: reference data, and a Python environment with the packages of the checks.
//!
//! A test without its requirements returns immediately and counts as passed by the test runner, so it is recorded as *not
//! run*: on stderr, and in the file given by `SHEAF_TEST_NOT_RUN`, which `cargo xtask test` lists at the end.
//! Only tests may import this crate.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The file that collects the tests that were not run.
const NOT_RUN: &str = "SHEAF_TEST_NOT_RUN";

/// `part` of the reference data, such as `rig-a` or `real/ciclop`, below `SHEAF_DATA` or, without that, below
/// `../shared/data` beside the repository.
///
/// Returns `None` if it is missing: the calling test is then recorded as not run and must return.
pub fn data(part: &str) -> Option<PathBuf> {
    let default = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("SHEAF_DATA").map_or_else(default, PathBuf::from).join(part);
    if folder.is_dir() {
        return Some(folder);
    }
    not_run(&format!("{part} is not in the reference data; set SHEAF_DATA"));
    None
}

/// The Python given by `SHEAF_TEST_PYTHON`, with the packages of `server/cli/tests/requirements.txt`.
///
/// Returns `None` if it is not set: the calling test is then recorded as not run and must return.
pub fn python() -> Option<PathBuf> {
    let python = std::env::var_os("SHEAF_TEST_PYTHON").map(PathBuf::from);
    if python.is_none() {
        not_run("SHEAF_TEST_PYTHON is not set; cargo xtask test sets it");
    }
    python
}

/// The `node_modules` given by `SHEAF_TEST_NODE_MODULES`, with the packages of `server/cli/tests/package.json`.
///
/// Returns `None` if it is not set: the calling test is then recorded as not run and must return.
pub fn node_modules() -> Option<PathBuf> {
    let folder = std::env::var_os("SHEAF_TEST_NODE_MODULES").map(PathBuf::from);
    if folder.is_none() {
        not_run("SHEAF_TEST_NODE_MODULES is not set; cargo xtask test sets it");
    }
    folder
}

/// Whether `program` is on the path.
///
/// Returns `false` where it is not: the calling test is then noted as not run, with the Debian package that holds it, and
/// must end.
pub fn has_program(program: &str, package: &str) -> bool {
    let on_path = std::env::var_os("PATH")
        .is_some_and(|path| std::env::split_paths(&path).any(|folder| folder.join(program).is_file()));
    if !on_path {
        not_run(&format!("{program} is not installed; it is in the Debian package {package}"));
    }
    on_path
}

/// The program that the environment variable `variable` names: firmware of other authors, built outside this repository.
///
/// Returns `None` where it names none: the calling test is then noted as not run and must end.
pub fn named_program(variable: &str) -> Option<PathBuf> {
    let program = std::env::var_os(variable).map(PathBuf::from);
    if program.is_none() {
        not_run(&format!("{variable} names no program; server/docs/devices/grbl.md describes how to build one"));
    }
    program
}

/// Records that the calling test is not run because the program was built without `feature`, which needs `library`.
pub fn without_feature(feature: &str, library: &str) {
    not_run(&format!("built without the feature {feature}, which needs {library}"));
}

/// Records that the calling test is not run because no disk of its own can be mounted.
pub fn without_small_disk() {
    not_run("this system lets nobody mount a disk (unshare --user --mount)");
}

/// Records the calling test as not run. The test is identified by the name of its thread, so this must be called on it.
fn not_run(reason: &str) {
    let package = std::env::var("CARGO_PKG_NAME").unwrap_or_default();
    let thread = std::thread::current();
    let line = format!("{package} {}: {reason}\n", thread.name().unwrap_or("(unnamed)"));
    eprint!("NOT RUN: {line}");
    if let Some(file) = std::env::var_os(NOT_RUN) {
        let written = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&file)
            .and_then(|mut file| file.write_all(line.as_bytes()));
        if let Err(error) = written {
            panic!("{NOT_RUN}: {} cannot be written: {error}", Path::new(&file).display());
        }
    }
}
