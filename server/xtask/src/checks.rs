//! `cargo xtask test`: all checks, in parallel where they need no common resource, and a list of what was not run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use crate::command::{Outcome, cargo, run, run_line_by_line, say, side_by_side, succeeds, target_folder};
use crate::docker_check::{docker_check, ensure_station_base};
use crate::linted::{document, in_background, linted, stand_in};
use crate::page::{check_page, ensure_browser, ensure_page, test_in_browser};
use crate::session_weight::LowWeight;
use crate::steps::{debug_program, is_root};
use crate::tools::{GENICAM, ensure_broker, ensure_genicam, ensure_node_modules, ensure_python};
use crate::unchanged::{Check, Executables, record};

/// Slots of a processor that `.config/nextest.toml` divides among tests.
const SLOTS_PER_PROCESSOR: usize = 4;

/// All checks. Steps that compile run in sequence; the page, its checks, and downloads run beside them.
pub fn test() -> Outcome {
    let started = Instant::now();
    ensure_component("fmt", "rustfmt")?;
    ensure_component("clippy", "clippy")?;
    run("format", &mut cargo(&["fmt", "--all", "--", "--check"]))?;
    let nextest = succeeds(Command::new("cargo").args(["nextest", "--version"]));
    let (mut not_run, mut installed) = (BTreeSet::new(), Vec::new());
    let features = features(&mut not_run);
    let stand_in = stand_in()?;
    let compile = || {
        let build = ["test", "--workspace", "--lib", "--bins", "--tests", "--no-run", "--quiet"];
        run("build and lints", linted(&build).args(features))
    };
    let with_root = is_root();
    let mut page_ran = true;
    let beside = || {
        ensure_page()?;
        // Without it, the tests of doors fail with a message.
        ensure_broker().unwrap_or_else(|error| say(&format!("── no MQTT broker for the tests: {error}")));
        ensure_browser()?;
        if with_root {
            ensure_station_base()?;
        }
        for (variable, path) in
            [("SHEAF_TEST_PYTHON", ensure_python()), ("SHEAF_TEST_NODE_MODULES", ensure_node_modules())]
        {
            match path {
                Ok(path) => installed.push((variable, path)),
                Err(error) => say(&format!("── no {variable} for the tests: {error}")),
            }
        }
        page_ran = Check::Page.unless_unchanged(check_page)?;
        Ok(())
    };
    side_by_side(compile, beside)?;
    if !page_ran {
        not_run.insert("checks of the page, which passed and whose files are unchanged".to_owned());
    }
    let low_weight = LowWeight::begin();
    let closing = run_tests(nextest, features, &stand_in, &installed, &mut not_run)?;
    drop(low_weight);
    if !Check::Browser.unless_unchanged(|| test_in_browser(&debug_program()))? {
        not_run.insert("tests in the browser, which passed and whose page and program are unchanged".to_owned());
    }
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
            not_run.insert(format!("everything about GenICam cameras: {error}"));
            &[]
        }
    }
}

/// Runs the tests, adds those with missing requirements to `not_run`, and returns the runner's closing lines.
///
/// What computes runs at a low priority (documentation, then tests), and beside it the tests that mostly wait, some of them
/// for promised times. Without nextest one runs after the other.
fn run_tests(
    nextest: bool,
    features: &[&str],
    stand_in: &Path,
    installed: &[(&str, PathBuf)],
    not_run: &mut BTreeSet<String>,
) -> Outcome<Vec<String>> {
    let recorded = record_file()?;
    let tests = |mut command: Command| {
        command.args(features).args(["--no-fail-fast", "--color", "never"]).env("SHEAF_TEST_NOT_RUN", &recorded);
        command.envs(installed.iter().map(|(variable, path)| (variable, path)));
        run_and_quote(command)
    };
    let executables = if nextest { Executables::built(features).ok() } else { None };
    let passed = executables.as_ref().map(Executables::passed).unwrap_or_default();
    let documented = executables.as_ref().map(Executables::documented).unwrap_or_default();
    let closing = if nextest {
        let n_processors = std::thread::available_parallelism().map_or(1, usize::from);
        let slots = (SLOTS_PER_PROCESSOR * n_processors).to_string();
        let changed: String = passed.iter().map(|name| format!(" - binary_id(={name})")).collect();
        let changed = format!("all(){changed}");
        let profile = |name| {
            let mut arguments = vec!["nextest", "run", "--workspace", "--profile", name, "--test-threads", &slots];
            arguments.extend(["--no-tests", "pass", "-E", &changed]);
            arguments
        };
        let (mut computing, mut waiting) = (Vec::new(), Vec::new());
        side_by_side(
            || {
                document(features, stand_in, &documented)?;
                computing = tests(in_background(&profile("computing")))?;
                Ok(())
            },
            || {
                waiting = tests(linted(&profile("waiting")))?;
                Ok(())
            },
        )?;
        computing.extend(waiting);
        computing
    } else {
        println!("── cargo-nextest is not installed: using cargo test");
        document(features, stand_in, &[])?;
        tests(linted(&["test", "--workspace", "--lib", "--bins", "--tests"]))?
    };
    let recorded = std::fs::read_to_string(recorded)?;
    if let Some(executables) = &executables {
        let packages = recorded.lines().filter_map(|line| line.split_once(' ')).map(|(package, _)| package);
        executables.record_passed(&packages.collect())?;
    }
    let file = record();
    if !passed.is_empty() {
        not_run.insert(format!(
            "{} test executables that passed and whose inputs are unchanged (to run them, delete {})",
            passed.len(),
            file.display()
        ));
    }
    if !documented.is_empty() {
        not_run.insert(format!(
            "documentation of {} libraries that passed and were not compiled since (to check it, delete {})",
            documented.len(),
            file.display()
        ));
    }
    not_run.extend(recorded.lines().map(str::to_owned));
    Ok(closing)
}

/// Runs tests, prints what they print, and returns the lines that say how many passed.
fn run_and_quote(command: Command) -> Outcome<Vec<String>> {
    let mut closing = Vec::new();
    run_line_by_line("tests", command, |line| {
        if line.contains("Summary") || line.contains("test result:") {
            closing.push(line.to_owned());
        }
    })?;
    Ok(closing)
}

/// The empty file in which tests without their data or their Python record their names.
fn record_file() -> Outcome<PathBuf> {
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
