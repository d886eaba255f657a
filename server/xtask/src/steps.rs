//! The steps behind the commands: each is one child process whose failure ends the run.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use crate::command::{Outcome, cargo, run, succeeds, target_folder, title, workspace};
use crate::docker_check::docker_check;
use crate::page::{check_page, ensure_page, write_schema};
use crate::tools::ensure_python;

/// Lines of the test runner repeated at the very end, where a person looks first.
const CLOSING_LINES: usize = 3;

/// Builds with optimisation and runs a command of the product.
pub fn run_sheaf(command: &str, arguments: &[String]) -> Outcome {
    ensure_page()?;
    let mut process = cargo(&["run", "--release", "--package", "sheaf", "--", command]);
    process.args(arguments).env("SHEAF_DATA", data_folder());
    run(command, &mut process)
}

/// Writes the API document of this version to `openapi/openapi.json`, and the page's types from it.
pub fn write_openapi() -> Outcome {
    let output = cargo(&["run", "--quiet", "--package", "sheaf", "--", "openapi"]).output()?;
    if !output.status.success() {
        return Err(format!("sheaf openapi failed: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    std::fs::write(workspace().join("openapi/openapi.json"), output.stdout)?;
    let events = cargo(&["run", "--quiet", "--package", "sheaf", "--", "openapi", "--events"]).output()?;
    std::fs::write(workspace().join("openapi/events.md"), events.stdout)?;
    write_schema()
}

/// Builds the page and the debug program, and tries both in a browser.
pub fn test_in_browser() -> Outcome {
    ensure_page()?;
    run("program", &mut cargo(&["build", "--package", "sheaf"]))?;
    crate::page::test_in_browser()
}

/// Every check, cheapest first.
pub fn test() -> Outcome {
    let started = Instant::now();
    ensure_component("fmt", "rustfmt")?;
    ensure_component("clippy", "clippy")?;
    tell_about_data();
    run("format", &mut cargo(&["fmt", "--all", "--", "--check"]))?;
    ensure_page()?;
    check_page()?;
    run("clippy", &mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    let python = ensure_python()?;
    let closing = run_tests(&python)?;
    crate::page::test_in_browser()?;
    run("doc tests", &mut cargo(&["test", "--workspace", "--doc", "--quiet"]))?;
    let mut doc = cargo(&["doc", "--workspace", "--no-deps", "--quiet"]);
    run("documentation", doc.env("RUSTDOCFLAGS", "-D warnings"))?;
    if is_root() {
        docker_check(Some(&target_folder().join("debug/sheaf")))?;
    } else {
        println!("── NOT CHECKED: docker/Dockerfile is replayed by chroot, which needs root");
    }
    println!("\n── all checks passed in {} s; the test runner said:", started.elapsed().as_secs());
    for line in closing {
        println!("{line}");
    }
    Ok(())
}

/// Runs the tests (with nextest where it is installed) and returns the runner's closing lines.
fn run_tests(python: &Path) -> Outcome<Vec<String>> {
    let nextest = succeeds(Command::new("cargo").args(["nextest", "--version"]));
    let mut command = if nextest {
        cargo(&["nextest", "run", "--workspace", "--no-fail-fast", "--color", "never"])
    } else {
        println!("── cargo-nextest is not installed: using cargo test");
        cargo(&["test", "--workspace", "--lib", "--bins", "--tests", "--no-fail-fast", "--color", "never"])
    };
    command.env("SHEAF_TEST_PYTHON", python);
    title("tests", &command);
    // Both runners are read on one pipe, so that their lines stay in order.
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
    let first = if nextest { closing.len().saturating_sub(CLOSING_LINES) } else { 0 };
    Ok(closing.split_off(first))
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout == b"0\n")
}

/// Installs a toolchain component if the machine lacks it, and says so.
fn ensure_component(subcommand: &str, component: &str) -> Outcome {
    if succeeds(Command::new("cargo").args([subcommand, "--version"])) {
        return Ok(());
    }
    println!("── installing the toolchain component {component}");
    run("component", Command::new("rustup").args(["component", "add", component]))
}

/// Some tests need data that is not part of the repository; their silence must not pass for success.
fn tell_about_data() {
    let folder = data_folder();
    if folder.join("rig-a/capture.json").is_file() {
        println!("── reference data: {}", folder.display());
    } else {
        println!(
            "── NO REFERENCE DATA at {}: the tests on rig-a and on real photographs will check nothing.\n   \
             Set SHEAF_DATA to the folder that holds rig-a/ and real/.",
            folder.display()
        );
    }
}

/// Where the reference data are, if they are anywhere.
fn data_folder() -> PathBuf {
    std::env::var_os("SHEAF_DATA").map_or_else(|| workspace().join("../shared/data"), PathBuf::from)
}
