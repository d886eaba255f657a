//! Compiling, lints and documentation in one pass.
//!
//! `cargo clippy` and `cargo doc` each read metadata of all dependencies that only `cargo check` makes, so every
//! library would be compiled twice, which is a third of a cold run. Clippy is a compiler, though: as the workspace's
//! wrapper it builds what it reads. And `cargo test --doc` calls rustdoc with the libraries that were built.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::command::{Outcome, cargo, run, target_folder, workspace};

/// Names the folder of the documentation to this program when cargo calls it in rustdoc's place.
const DOCUMENTED_INTO: &str = "SHEAF_DOCUMENTED_INTO";

/// Arguments of `rustdoc --test` that have no meaning without it, with the number of values after them.
const OF_TESTS: [(&str, usize); 6] = [
    ("--test", 0),
    ("--test-args", 1),
    ("--test-run-directory", 1),
    ("--test-runtool", 1),
    ("--test-runtool-arg", 1),
    ("--no-run", 0),
];

/// Cargo with Clippy as the compiler of the workspace's crates; a warning is an error.
pub fn linted(arguments: &[&str]) -> Command {
    as_linted(cargo(arguments))
}

/// The same for a command that calls cargo.
pub fn as_linted(mut command: Command) -> Command {
    command.current_dir(workspace());
    // How `cargo clippy` passes arguments to the driver.
    command.env("CLIPPY_ARGS", "-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__");
    command.env("RUSTC_WORKSPACE_WRAPPER", "clippy-driver");
    command
}

/// A copy of this program to stand in for rustdoc: the build replaces the program's own file while it runs.
pub fn stand_in() -> Outcome<PathBuf> {
    let copy = target_folder().join("rustdoc-of-the-checks");
    std::fs::copy(std::env::current_exe()?, &copy)?;
    Ok(copy)
}

/// Documents all libraries, where a broken link is an error, and runs the examples in them.
pub fn document(features: &[&str], stand_in: &Path) -> Outcome {
    let mut command = linted(&["test", "--workspace", "--doc", "--quiet"]);
    command.args(features).env("RUSTDOC", stand_in);
    run("documentation", command.env(DOCUMENTED_INTO, target_folder().join("doc")))
}

/// Acts for rustdoc when [`document`] calls: documents the crate, then runs its examples. `None` otherwise.
pub fn as_rustdoc() -> Option<ExitCode> {
    let folder = PathBuf::from(std::env::var_os(DOCUMENTED_INTO)?);
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let is_test = arguments.iter().any(|argument| argument == "--test");
    let succeeded = (!is_test || rustdoc(&documenting(&arguments, &folder))) && rustdoc(&arguments);
    Some(if succeeded { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn rustdoc(arguments: &[OsString]) -> bool {
    Command::new("rustdoc").args(arguments).status().is_ok_and(|status| status.success())
}

/// The arguments of a run of examples, changed to those of documentation.
fn documenting(arguments: &[OsString], folder: &Path) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let name = argument.to_string_lossy();
        let (name, has_value) = name.split_once('=').map_or((&*name, false), |(name, _)| (name, true));
        match OF_TESTS.iter().find(|(known, _)| *known == name) {
            Some((_, n_values)) if !has_value => rest.by_ref().take(*n_values).for_each(drop),
            Some(_) => {}
            None => kept.push(argument.clone()),
        }
    }
    kept.extend(["-D", "warnings", "--document-private-items", "--out-dir"].map(OsString::from));
    kept.push(folder.into());
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn test_only_arguments_are_removed() {
        let line =
            "--crate-name optics --test src/lib.rs --test-run-directory /here --extern a=b --test-args=--quiet";
        let arguments: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let expected =
            "--crate-name optics src/lib.rs --extern a=b -D warnings --document-private-items --out-dir doc";
        let expected: Vec<OsString> = expected.split(' ').map(OsString::from).collect();
        assert_eq!(documenting(&arguments, Path::new("doc")), expected);
    }
}
