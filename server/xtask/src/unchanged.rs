//! Skips test executables, and checks of the page, that passed and whose inputs have not changed: most of them after a small
//! change.
//!
//! A fresh machine has no record, so continuous integration runs all of them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::UNIX_EPOCH;

use serde_json::Value;

use crate::command::{Outcome, target_folder, workspace};
use crate::linted::linted;
use crate::steps::{data_folder, debug_program};

/// State of the inputs of each test executable, by name: the executable itself, the program if the tests run it, all files
/// of the repository except Rust code, and the folder of the reference data.
#[derive(PartialEq)]
pub struct Executables(BTreeMap<String, String>);

impl Executables {
    /// The executables of this build.
    pub fn built(features: &[&str]) -> Outcome<Self> {
        let list = ["nextest", "list", "--workspace", "--list-type", "binaries-only", "--message-format", "json"];
        let output = linted(&list).args(features).stderr(Stdio::null()).output()?;
        let list: Value = serde_json::from_slice(&output.stdout)?;
        let environment = environment()?;
        let program = state(&debug_program());
        let known = |(name, one): (&String, &Value)| {
            let own = state(Path::new(one["binary-path"].as_str()?));
            let runs_program = name == "sheaf" || name.starts_with("sheaf::");
            let program = if runs_program { program.as_str() } else { "" };
            Some((name.clone(), format!("{own} {program} {environment}")))
        };
        let all = list["rust-binaries"].as_object().ok_or("nextest lists no executables")?;
        Ok(Self(all.iter().filter_map(known).collect()))
    }

    /// The names of those that passed in their current state.
    pub fn passed(&self) -> Vec<&str> {
        let passed = recorded();
        let is_unchanged = |(name, state): &(&String, &String)| passed.get(*name) == Some(*state);
        self.0.iter().filter(is_unchanged).map(|(name, _)| name.as_str()).collect()
    }

    /// Records that all of them passed, except those of packages with tests that were not run: these have not passed.
    pub fn record_passed(&self, not_run: &BTreeSet<&str>) -> Outcome {
        let mut passed: BTreeMap<String, String> =
            recorded().into_iter().filter(|(name, _)| name == PAGE).collect();
        let of_tests = self.0.iter().filter(|(name, _)| !not_run.contains(package_of(name)));
        passed.extend(of_tests.map(|(name, state)| (name.clone(), state.clone())));
        write_record(&passed)
    }
}

/// Name of the page's checks in the record.
const PAGE: &str = "page";

/// Whether the page's checks passed with its files as they are; not known outside of a repository.
pub fn page_passed() -> bool {
    page().is_ok_and(|state| recorded().get(PAGE) == Some(&state))
}

/// Records that the page's checks passed.
pub fn record_page_passed() -> Outcome {
    let Ok(state) = page() else { return Ok(()) };
    let mut passed = recorded();
    passed.insert(PAGE.to_owned(), state);
    write_record(&passed)
}

/// State of the page's files, the API document and the reference messages.
fn page() -> Outcome<String> {
    states(&["web", "openapi", "tests"], |_| true)
}

/// What passed before, and in which state.
fn recorded() -> BTreeMap<String, String> {
    let record = std::fs::read_to_string(record()).unwrap_or_default();
    let of_line = |line: &str| line.split_once('\t').map(|(name, state)| (name.to_owned(), state.to_owned()));
    record.lines().filter_map(of_line).collect()
}

fn write_record(passed: &BTreeMap<String, String>) -> Outcome {
    let lines: String = passed.iter().map(|(name, state)| format!("{name}\t{state}\n")).collect();
    Ok(std::fs::write(record(), lines)?)
}

/// The package of an executable: `sheaf-vision` of `sheaf-vision::it`.
fn package_of(executable: &str) -> &str {
    executable.split_once("::").map_or(executable, |(package, _)| package)
}

/// The file with the record; deleting it by hand makes all tests run again.
pub fn record() -> PathBuf {
    target_folder().join("passed.txt")
}

/// Length and time of change of a file.
fn state(file: &Path) -> String {
    let changed = |file: &Path| {
        let metadata = std::fs::metadata(file).ok()?;
        let since = metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
        Some(format!("{}@{}", metadata.len(), since.as_nanos()))
    };
    changed(file).unwrap_or_else(|| "absent".to_owned())
}

/// The state of all files that tests may read while they run.
fn environment() -> Outcome<String> {
    let states = states(&[], |file| !file.ends_with(".rs"))?;
    Ok(format!("{states} {}", data_folder().display()))
}

/// State of the repository's files in these folders, or in all; new files that git does not ignore are included.
fn states(folders: &[&str], is_read: impl Fn(&str) -> bool) -> Outcome<String> {
    let list = ["ls-files", "-z", "--cached", "--others", "--exclude-standard", "--"];
    let output = Command::new("git").args(list).args(folders).current_dir(workspace()).output()?;
    if !output.status.success() {
        return Err("git cannot list the repository's files".into());
    }
    let files = String::from_utf8(output.stdout)?;
    let read = files.split('\0').filter(|file| !file.is_empty() && is_read(file));
    let states: String = read.map(|file| format!("{file} {}\n", state(&workspace().join(file)))).collect();
    Ok(format!("{:016x}", fnv(states.as_bytes())))
}

/// FNV-1a, sufficient to detect changes.
fn fnv(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_executable_is_named_after_its_package() {
        assert_eq!(["sheaf-vision::it", "sheaf-vision"].map(package_of), ["sheaf-vision"; 2]);
    }

    #[test]
    fn writing_a_file_changes_its_state() {
        let file = std::env::temp_dir().join(format!("sheaf-xtask-{}", std::process::id()));
        std::fs::write(&file, "one").unwrap();
        let before = state(&file);
        assert_eq!(state(&file), before);
        std::fs::write(&file, "three").unwrap();
        assert_ne!(state(&file), before);
        std::fs::remove_file(&file).unwrap();
        assert_eq!(state(&file), "absent");
    }
}
