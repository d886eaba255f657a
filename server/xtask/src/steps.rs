//! The steps of the commands: each is one child process whose failure ends the run.

use std::path::PathBuf;
use std::process::Command;

use crate::command::{Outcome, cargo, run, target_folder, workspace};
use crate::linted::linted;
use crate::page::{ensure_browser, ensure_page, write_schema};
use crate::tools::{GENICAM, has_aravis};

/// Builds and runs a command of the product.
///
/// A development build, in which what computes is optimised too (`profile.dev.package`): a release build is faster, but takes
/// half as long again to compile (ADR 46).
pub fn run_sheaf(command: &str, arguments: &[String]) -> Outcome {
    ensure_page()?;
    let mut process = cargo(&["run", "--package", "sheaf", "--", command]);
    process.args(arguments).env("SHEAF_DATA", data_folder());
    run(command, &mut process)
}

/// Writes the documents of this version's interfaces to `openapi/`, and the page's types from the API document.
pub fn write_openapi() -> Outcome {
    let program = build_program()?;
    let documents: [(&[&str], &str); 4] = [
        (&["openapi"], "openapi.json"),
        (&["openapi", "--events"], "events.md"),
        (&["openapi", "--registers", "markdown"], "modbus.md"),
        (&["openapi", "--registers", "csv"], "modbus.csv"),
    ];
    for (arguments, file) in documents {
        let output = Command::new(&program).args(arguments).output()?;
        if !output.status.success() {
            return Err(format!("sheaf openapi failed: {}", String::from_utf8_lossy(&output.stderr)).into());
        }
        std::fs::write(workspace().join("openapi").join(file), output.stdout)?;
    }
    write_schema()
}

/// Builds the page and the debug program, and tests both in a browser.
pub fn test_in_browser() -> Outcome {
    ensure_page()?;
    ensure_browser()?;
    crate::page::test_in_browser(&build_program()?)
}

/// Builds the debug program with the libraries that the tests are linked with, and returns its path.
///
/// Cargo chooses the features of all libraries by the requested packages and kinds of targets. With `--workspace` and
/// `--examples` they are those of `cargo test --workspace`, so nothing is compiled twice.
fn build_program() -> Outcome<PathBuf> {
    let mut build = linted(&["build", "--quiet", "--workspace", "--bin", "sheaf", "--examples"]);
    run("program", build.args(if has_aravis() { GENICAM } else { &[] }))?;
    Ok(debug_program())
}

/// The program built by tests and build.
pub fn debug_program() -> PathBuf {
    target_folder().join("debug/sheaf")
}

/// Runs the labelling tests on dozens of random scenes, each against its stated rate of wrong labels, stations of all
/// sizes from images to a measured ball, all characteristics of plans on twenty seeds and on rendered images of sixty
/// stations, a thousand serial faults for each controller, 500 camera faults, bits that flip in the database, thirty kills
/// of the server and a hundred of one that records, and fifty parts at all doors.
pub fn campaign() -> Outcome {
    let filter = ["--", "campaign", "--ignored", "--nocapture", "--test-threads", "1"];
    run("serial faults", cargo(&["test", "--package", "sheaf-devices", "--lib"]).args(filter))?;
    let mut cameras = cargo(&["test", "--package", "sheaf-station", "--package", "sheaf-genicam", "--lib"]);
    let features: &[&str] = if has_aravis() { &["--features", "sheaf-genicam/aravis"] } else { &[] };
    cameras.args(features);
    run("camera faults", cameras.args(filter))?;
    run("characteristics of plans", cargo(&["test", "--package", "sheaf-metrology", "--lib"]).args(filter))?;
    run("flipped bits", cargo(&["test", "--package", "sheaf-store", "--test", "it"]).args(filter))?;
    run("kills and doors", cargo(&["test", "--package", "sheaf", "--test", "it"]).args(filter))?;
    run(
        "stations of all sizes and parts on sixty stations",
        cargo(&["test", "--package", "sheaf-pipeline", "--test", "it"]).args(filter),
    )?;
    run("campaign", cargo(&["test", "--package", "sheaf-scanning", "--test", "it"]).args(filter))
}

/// Whether steps may use root privileges.
pub fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout == b"0\n")
}

/// Folder of the reference data, if any.
pub fn data_folder() -> PathBuf {
    std::env::var_os("SHEAF_DATA").map_or_else(|| workspace().join("../shared/data"), PathBuf::from)
}
