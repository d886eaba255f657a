//! Skips test executables, checks of the page and tests in a browser that passed and whose inputs have not changed: most of
//! them after a small change.
//!
//! A fresh machine has no record, so continuous integration runs all of them.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::Value;

use crate::command::{Outcome, target_folder, workspace};
use crate::linted::linted;
use crate::steps::{data_folder, debug_program};

/// Folder of the page's sources.
const WEB: &str = "web/";

/// What checks of the page and tests in a browser read: its sources, the API document and the reference messages.
const READ_BY_THE_PAGE: [&str; 3] = [WEB, "openapi/", "tests/"];

/// Packages whose tests read files of the page.
const READ_THE_PAGE: [&str; 2] = ["sheaf", "sheaf-http"];

/// The package whose tests read all of the repository, in a second: they always run.
const READS_ALL: &str = "xtask";

/// State of the inputs of each test executable, by name: the executable itself, the program if the tests run it, all files
/// of the repository except Rust code (those of the page only for packages that read it), and the folder of the reference
/// data.
///
/// Those of [`READS_ALL`] are left out. Content counts, not the time of a change: an executable that was compiled again and is
/// bit by bit the same has the same state.
pub struct Executables {
    states: BTreeMap<String, String>,
    /// When those of unit tests were compiled, by package. Documentation may have changed where code has not.
    compiled: BTreeMap<String, String>,
}

impl Executables {
    /// The executables of this build.
    pub fn built(features: &[&str]) -> Outcome<Self> {
        let list = ["nextest", "list", "--workspace", "--list-type", "binaries-only", "--message-format", "json"];
        let output = linted(&list).args(features).stderr(Stdio::null()).output()?;
        let list: Value = serde_json::from_slice(&output.stdout)?;
        let all = list["rust-binaries"].as_object().ok_or("nextest lists no executables")?;
        let path_of =
            |(name, one): (&String, &Value)| Some((name.clone(), PathBuf::from(one["binary-path"].as_str()?)));
        let of_others = all.iter().filter(|(name, _)| package_of(name) != READS_ALL);
        let (names, mut paths): (Vec<_>, Vec<_>) = of_others.filter_map(path_of).unzip();
        paths.push(debug_program());
        let mut contents = contents(&paths)?;
        let program = contents.pop().unwrap_or_default();
        let files = repository_files()?;
        let (with_page, without_page) =
            (state_of(&files, |_| true), state_of(&files, |file| !file.starts_with(WEB)));
        let state = |name: &str, own: &str| {
            let program = if package_of(name) == "sheaf" { program.as_str() } else { "" };
            let files = if READ_THE_PAGE.contains(&package_of(name)) { &with_page } else { &without_page };
            format!("{own} {program} {files} {}", data_folder().display())
        };
        let of_packages = names.iter().zip(&paths).filter(|(name, _)| !name.contains("::"));
        Ok(Self {
            compiled: of_packages.map(|(name, path)| (name.clone(), time_of_change(path))).collect(),
            states: names.iter().zip(contents).map(|(name, own)| (name.clone(), state(name, &own))).collect(),
        })
    }

    /// The names of those that passed in their current state.
    pub fn passed(&self) -> Vec<&str> {
        let passed = recorded();
        let is_unchanged = |(name, state): &(&String, &String)| passed.get(*name) == Some(*state);
        self.states.iter().filter(is_unchanged).map(|(name, _)| name.as_str()).collect()
    }

    /// The packages whose documentation passed and that have not been compiled since, nor anything they depend on.
    pub fn documented(&self) -> Vec<&str> {
        let passed = recorded();
        let is_unchanged =
            |(package, time): &(&String, &String)| passed.get(&documentation(package)) == Some(*time);
        self.compiled.iter().filter(is_unchanged).map(|(package, _)| package.as_str()).collect()
    }

    /// Records that all of them passed, except those of packages with tests that were not run (these have not passed), and
    /// the documentation of all packages.
    pub fn record_passed(&self, not_run: &BTreeSet<&str>) -> Outcome {
        let mut passed = recorded();
        passed.retain(|name, _| [Check::Page, Check::Browser].map(Check::name).contains(&name.as_str()));
        let of_tests = self.states.iter().filter(|(name, _)| !not_run.contains(package_of(name)));
        passed.extend(of_tests.map(|(name, state)| (name.clone(), state.clone())));
        passed.extend(self.compiled.iter().map(|(package, time)| (documentation(package), time.clone())));
        write_record(&passed)
    }
}

/// A check that is recorded beside the test executables.
#[derive(Clone, Copy)]
pub enum Check {
    /// Lint, types and unit tests of the page.
    Page,
    /// The tests of page and program in a browser.
    Browser,
}

impl Check {
    /// Runs the check, unless it passed and its files are as they were then; returns whether it ran.
    pub fn unless_unchanged(self, run: impl FnOnce() -> Outcome) -> Outcome<bool> {
        // Unknown outside of a repository, where the check always runs. A file that is written while it runs counts as
        // changed the next time.
        let state = self.state().ok();
        if state.is_some() && recorded().get(self.name()) == state.as_ref() {
            return Ok(false);
        }
        run()?;
        if let Some(state) = state {
            let mut passed = recorded();
            passed.insert(self.name().to_owned(), state);
            write_record(&passed)?;
        }
        Ok(true)
    }

    /// Name in the record.
    fn name(self) -> &'static str {
        match self {
            Self::Page => "page",
            Self::Browser => "browser",
        }
    }

    /// State of the page's files, the API document and the reference messages; in a browser also of the program and the
    /// folder of the reference data.
    fn state(self) -> Outcome<String> {
        let is_read = |file: &str| READ_BY_THE_PAGE.iter().any(|folder| file.starts_with(folder));
        let files = state_of(&repository_files()?, is_read);
        match self {
            Self::Page => Ok(files),
            Self::Browser => {
                Ok(format!("{files} {} {}", contents(&[debug_program()])?.concat(), data_folder().display()))
            }
        }
    }
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

/// Name of a package's documentation in the record.
fn documentation(package: &str) -> String {
    format!("documentation of {package}")
}

/// When a file was last written, ns since 1970, or `absent`.
fn time_of_change(file: &Path) -> String {
    let since = |time: SystemTime| time.duration_since(UNIX_EPOCH).ok();
    let changed = std::fs::metadata(file).and_then(|metadata| metadata.modified()).ok().and_then(since);
    changed.map_or_else(|| "absent".to_owned(), |since| since.as_nanos().to_string())
}

/// The hash of each file's content, or `absent`.
fn contents(files: &[PathBuf]) -> Outcome<Vec<String>> {
    let hash = ["hash-object", "--no-filters", "--stdin-paths"];
    let mut git = Command::new("git").args(hash).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let present: Vec<bool> = files.iter().map(|file| file.is_file()).collect();
    let paths: Vec<String> = (files.iter().zip(&present).filter(|(_, is_present)| **is_present))
        .map(|(file, _)| format!("{}\n", file.display()))
        .collect();
    let mut input = git.stdin.take().ok_or("git has no standard input")?;
    // Beside reading what it prints: either pipe may be full.
    let writing = std::thread::spawn(move || input.write_all(paths.concat().as_bytes()));
    let output = git.wait_with_output()?;
    writing.join().map_err(|_| "the paths could not be written")??;
    let hashes = String::from_utf8(output.stdout)?;
    let mut hashes = hashes.lines();
    let of_file = |is_present| if is_present { hashes.next() } else { Some("absent") };
    let contents: Option<Vec<_>> = present.into_iter().map(of_file).map(|hash| hash.map(str::to_owned)).collect();
    contents.filter(|_| output.status.success()).ok_or_else(|| "git cannot read a file".into())
}

/// All files of the repository except Rust code, with the hashes of their contents; new files that git does not ignore are
/// included.
fn repository_files() -> Outcome<Vec<(String, String)>> {
    let list = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"];
    let output = Command::new("git").args(list).current_dir(workspace()).output()?;
    if !output.status.success() {
        return Err("git cannot list the repository's files".into());
    }
    let names = String::from_utf8(output.stdout)?;
    let names = names.split('\0').filter(|name| !name.is_empty() && !name.ends_with(".rs"));
    let (names, paths): (Vec<_>, Vec<_>) = names.map(|name| (name.to_owned(), workspace().join(name))).unzip();
    let contents = contents(&paths)?;
    Ok(names.into_iter().zip(contents).collect())
}

/// State of those files that are read.
fn state_of(files: &[(String, String)], is_read: impl Fn(&str) -> bool) -> String {
    let read = files.iter().filter(|(name, _)| is_read(name));
    let states: String = read.map(|(name, content)| format!("{name} {content}\n")).collect();
    format!("{:016x}", fnv(states.as_bytes()))
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
    fn a_file_is_known_by_its_content() {
        let folder = std::env::temp_dir().join(format!("sheaf-xtask-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let files = ["one", "none", "same", "other"].map(|name| folder.join(name));
        for (file, content) in [(&files[0], "1"), (&files[2], "1"), (&files[3], "2")] {
            std::fs::write(file, content).unwrap();
        }
        let contents = contents(&files).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(contents[0], contents[2]);
        assert_ne!(contents[0], contents[3]);
        assert_eq!(contents[1], "absent");
    }
}
