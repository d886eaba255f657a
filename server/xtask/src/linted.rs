//! Compiling, lints and documentation in one pass.
//!
//! `cargo clippy` and `cargo doc` each read metadata of all dependencies that only `cargo check` makes, so every
//! library would be compiled twice, which is a third of a cold run. Clippy is a compiler, though: as the workspace's
//! wrapper it builds what it reads. And `cargo test --doc` calls rustdoc with the libraries that were built, for one
//! library after the other; here each call starts a process of its own, so that all processors are used.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Duration;

use crate::command::{Outcome, cargo, run_line_by_line, target_folder, without_own_package, workspace};

/// Names the folder of the documentation to this program when cargo calls it in rustdoc's place.
const DOCUMENTED_INTO: &str = "SHEAF_DOCUMENTED_INTO";

/// Names the packages, separated by spaces, that this program must not document then. Cargo is asked for all of them: it would
/// build the others with other features.
const UNCHANGED: &str = "SHEAF_DOCUMENTED_BEFORE";

/// Set for the processes that [`as_rustdoc`] starts.
const BESIDE_OTHERS: &str = "SHEAF_DOCUMENTED_BESIDE_OTHERS";

/// What is printed of a library when its documentation is requested, and when that and its examples have succeeded.
const WORDS: [&str; 2] = ["── to be documented: ", "── documented: "];

/// What an example begins with, in Markdown fenced or indented, or what may bring one from elsewhere.
const EXAMPLES: [&str; 6] = ["```", "~~~", "///     ", "//!     ", "#[doc =", "#![doc ="];

/// Between two attempts to be the next to document a library.
const NEXT_TRY: Duration = Duration::from_millis(20);

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

/// The same at a low priority, for what computes while something else has promised times.
pub fn in_background(arguments: &[&str]) -> Command {
    let mut nice = Command::new("nice");
    nice.args(["-n", "10", "cargo"]).args(arguments);
    as_linted(nice)
}

/// The same for a command that calls cargo.
fn as_linted(mut command: Command) -> Command {
    command.current_dir(workspace());
    without_own_package(&mut command);
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

/// Documents libraries, where a broken link is an error, and runs the examples in them: all but those of the `documented`
/// packages, which passed and have not been compiled since.
pub fn document(features: &[&str], stand_in: &Path, documented: &[&str]) -> Outcome {
    let mut command = in_background(&["test", "--workspace", "--doc", "--quiet"]);
    command.env(UNCHANGED, documented.join(" "));
    command.args(features).env("RUSTDOC", stand_in).env(DOCUMENTED_INTO, target_folder().join("doc"));
    let mut lines = Vec::new();
    run_line_by_line("documentation", command, |line| lines.push(line.to_owned()))?;
    let missing = undocumented(&lines);
    if missing.is_empty() { Ok(()) } else { Err(format!("documentation failed: {}", missing.join(", ")).into()) }
}

/// The libraries whose documentation was requested and that did not report its success: also those whose process was
/// killed.
fn undocumented(lines: &[String]) -> Vec<&str> {
    let [requested, documented] = WORDS.map(|words| {
        let libraries = lines.iter().filter_map(|line| Some(line.split_once(words)?.1));
        libraries.collect::<BTreeSet<&str>>()
    });
    requested.difference(&documented).copied().collect()
}

/// Acts for rustdoc when [`document`] calls: documents the crate, then runs its examples, in a process of its own.
/// `None` otherwise.
pub fn as_rustdoc() -> Option<ExitCode> {
    let documentation = PathBuf::from(std::env::var_os(DOCUMENTED_INTO)?);
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let library = library(&arguments);
    // In a common folder each library would rewrite the search index of all.
    let folder = documentation.join(&library);
    let [requested, documented] = WORDS.map(|words| format!("{words}{library}"));
    let succeeded = if !arguments.iter().any(|argument| argument == "--test") {
        rustdoc(&arguments)
    } else if is_unchanged() {
        true
    } else if std::env::var_os(BESIDE_OTHERS).is_none() {
        println!("{requested}");
        started_beside_others(&arguments)
    } else {
        let turn = turn();
        let succeeded = turn.is_ok()
            && rustdoc(&documenting(&arguments, &folder))
            && (!has_examples(&arguments) || rustdoc(&arguments));
        if succeeded {
            println!("{documented}");
        }
        succeeded
    };
    Some(if succeeded { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Whether the package of the library that rustdoc is called for is among the unchanged ones.
fn is_unchanged() -> bool {
    let unchanged = std::env::var(UNCHANGED).unwrap_or_default();
    let package = std::env::var("CARGO_PKG_NAME").unwrap_or_default();
    unchanged.split_whitespace().any(|name| name == package)
}

/// The name of the library that rustdoc is called for.
fn library(arguments: &[OsString]) -> String {
    let name = arguments.iter().skip_while(|argument| *argument != "--crate-name").nth(1);
    name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Whether a file of the library contains an example; rustdoc would analyse all of the library to find that none does.
fn has_examples(arguments: &[OsString]) -> bool {
    let root =
        arguments.iter().map(Path::new).find(|path| path.extension().is_some_and(|extension| extension == "rs"));
    // What cannot be read is rustdoc's to report.
    root.and_then(Path::parent).is_none_or(|folder| holds_example(folder).unwrap_or(true))
}

fn holds_example(path: &Path) -> std::io::Result<bool> {
    if !path.is_dir() {
        let is_code = path.extension().is_some_and(|extension| extension == "rs");
        let text = if is_code { std::fs::read_to_string(path)? } else { String::new() };
        return Ok(EXAMPLES.iter().any(|mark| text.contains(mark)));
    }
    for entry in std::fs::read_dir(path)? {
        if holds_example(&entry?.path())? {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Starts this program again with the same arguments; returns whether it could be started. It is not waited for: `document`
/// reads its output to the end.
fn started_beside_others(arguments: &[OsString]) -> bool {
    let started =
        std::env::current_exe().and_then(|own| Command::new(own).args(arguments).env(BESIDE_OTHERS, "1").spawn());
    started.is_ok()
}

/// Waits until fewer libraries are being documented than there are processors; the file is held meanwhile.
fn turn() -> std::io::Result<File> {
    let n_processors = std::thread::available_parallelism().map_or(1, usize::from);
    loop {
        for idx in 0..n_processors {
            let file = File::create(target_folder().join(format!("documenting-{idx}")))?;
            if file.try_lock().is_ok() {
                return Ok(file);
            }
        }
        std::thread::sleep(NEXT_TRY);
    }
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
    fn a_library_that_does_not_report_success_is_named() {
        let lines =
            ["to be documented: stl", "to be documented: app", "error: unresolved link", "documented: app"];
        let lines: Vec<String> = lines.iter().map(|line| format!("── {line}")).collect();
        assert_eq!(undocumented(&lines), ["stl"]);
        assert_eq!(undocumented(&lines[1..]), [""; 0]);
    }

    #[test]
    fn only_a_library_with_an_example_has_one() {
        let folder = std::env::temp_dir().join(format!("sheaf-xtask-examples-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("inner")).unwrap();
        let arguments =
            ["--crate-name", "optics", folder.join("lib.rs").to_str().unwrap(), "--test"].map(OsString::from);
        std::fs::write(folder.join("lib.rs"), "//! Words.").unwrap();
        assert!(!has_examples(&arguments));
        for example in ["//! ```\n//! assert!(true);\n//! ```", "/// Words.\n///\n///     assert!(true);"] {
            std::fs::write(folder.join("inner/mod.rs"), example).unwrap();
            assert!(has_examples(&arguments), "{example}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

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
