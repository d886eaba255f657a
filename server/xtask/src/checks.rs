//! `cargo xtask test`: all checks, in parallel where they need no common resource, and a list of what was not run.

use std::collections::BTreeSet;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use crate::command::{Outcome, cargo, run, say, side_by_side, succeeds, target_folder, title};
use crate::docker_check::{docker_check, ensure_station_base};
use crate::page::{check_page, ensure_browser, ensure_page, test_in_browser};
use crate::steps::{debug_program, is_root};
use crate::tools::{GENICAM, ensure_genicam, ensure_python};

/// Lines of the test runner repeated at the end, where a reader looks first.
const CLOSING_LINES: usize = 3;

/// Slots of a processor that `.config/nextest.toml` divides among tests.
const SLOTS_PER_PROCESSOR: usize = 4;

/// All checks. Steps that need cargo's build folder run in sequence; the page, its checks, and downloads run beside
/// them. Tests run alone, since some of them check promised times.
pub fn test() -> Outcome {
    let started = Instant::now();
    ensure_component("fmt", "rustfmt")?;
    ensure_component("clippy", "clippy")?;
    run("format", &mut cargo(&["fmt", "--all", "--", "--check"]))?;
    let nextest = succeeds(Command::new("cargo").args(["nextest", "--version"]));
    let (mut not_run, mut python) = (BTreeSet::new(), None);
    let features = features(&mut not_run);
    let compile = || {
        let lints = ["clippy", "--workspace", "--all-targets"];
        run("clippy", cargo(&lints).args(features).args(["--", "-D", "warnings"]))?;
        let build = ["test", "--workspace", "--lib", "--bins", "--tests", "--no-run", "--quiet"];
        run("build", cargo(&build).args(features))?;
        run("doc tests", cargo(&["test", "--workspace", "--doc", "--quiet"]).args(features))?;
        // There are no examples; requesting them makes cargo choose the libraries' features as for clippy.
        let mut doc = cargo(&["doc", "--workspace", "--lib", "--bins", "--examples", "--no-deps", "--quiet"]);
        run("documentation", doc.args(features).env("RUSTDOCFLAGS", "-D warnings"))
    };
    let with_root = is_root();
    let beside = || {
        ensure_page()?;
        ensure_browser()?;
        if with_root {
            ensure_station_base()?;
        }
        python = ensure_python().inspect_err(|error| say(&format!("── no Python for the tests: {error}"))).ok();
        check_page()
    };
    side_by_side(compile, beside)?;
    let closing = run_tests(nextest, features, python.as_deref(), &mut not_run)?;
    test_in_browser(&debug_program())?;
    if with_root {
        docker_check(Some(&debug_program()))?;
    } else {
        not_run.insert("docker/Dockerfile: its folders are entered by chroot, which needs root".to_owned());
    }
    println!("\n── all checks passed in {} s; the test runner's summary:", started.elapsed().as_secs());
    closing.iter().for_each(|line| println!("{line}"));
    println!("── {} not run", not_run.len());
    not_run.iter().for_each(|line| println!("   {line}"));
    Ok(())
}

/// Features of the program that need Debian packages: all of them, unless these are unavailable.
fn features(not_run: &mut BTreeSet<String>) -> &'static [&'static str] {
    match ensure_genicam() {
        Ok(()) => GENICAM,
        Err(error) => {
            not_run.insert(format!("everything of GenICam cameras: {error}"));
            &[]
        }
    }
}

/// Runs the tests (with nextest where it is installed), adds those with missing requirements to `not_run`, and returns
/// the runner's closing lines.
fn run_tests(
    nextest: bool,
    features: &[&str],
    python: Option<&Path>,
    not_run: &mut BTreeSet<String>,
) -> Outcome<Vec<String>> {
    let mut command = if nextest {
        let mut command = cargo(&["nextest", "run", "--workspace", "--no-fail-fast", "--color", "never"]);
        let n_processors = std::thread::available_parallelism().map_or(1, usize::from);
        command.arg("--test-threads").arg((SLOTS_PER_PROCESSOR * n_processors).to_string());
        command
    } else {
        println!("── cargo-nextest is not installed: using cargo test");
        cargo(&["test", "--workspace", "--lib", "--bins", "--tests", "--no-fail-fast", "--color", "never"])
    };
    command.args(features);
    let noted = noted_file()?;
    command.env("SHEAF_TEST_NOT_RUN", &noted);
    if let Some(python) = python {
        command.env("SHEAF_TEST_PYTHON", python);
    }
    title("tests", &command);
    // Both output streams share one pipe, so that their lines stay in order.
    let (reader, writer) = std::io::pipe()?;
    command.stdout(writer.try_clone()?).stderr(writer);
    let mut child = command.spawn()?;
    drop(command);
    let mut closing: Vec<String> = Vec::new();
    for line in BufReader::new(reader).lines() {
        let line = line?;
        println!("{line}");
        if line.contains("Summary") || line.contains("test result:") || line.contains(" tests run:") {
            closing.push(line);
        }
    }
    let status = child.wait()?;
    if !status.success() {
        return Err(format!("tests failed: {status}").into());
    }
    not_run.extend(std::fs::read_to_string(noted)?.lines().map(str::to_owned));
    let first = if nextest { closing.len().saturating_sub(CLOSING_LINES) } else { 0 };
    Ok(closing.split_off(first))
}

/// The empty file in which tests without their data or their Python record their names.
fn noted_file() -> Outcome<PathBuf> {
    let file = target_folder().join("not-run.txt");
    std::fs::create_dir_all(target_folder())?;
    std::fs::write(&file, "")?;
    Ok(file.canonicalize()?)
}

/// Installs a missing toolchain component, with a message.
fn ensure_component(subcommand: &str, component: &str) -> Outcome {
    if succeeds(Command::new("cargo").args([subcommand, "--version"])) {
        return Ok(());
    }
    println!("── installing the toolchain component {component}");
    run("component", Command::new("rustup").args(["component", "add", component]))
}
