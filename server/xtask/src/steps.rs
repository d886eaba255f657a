//! The steps behind the commands: each is one child process whose failure ends the run.

use std::path::PathBuf;
use std::process::Command;

use crate::command::{Outcome, cargo, run, workspace};
use crate::page::{ensure_page, write_schema};

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

/// The tests of labelling on scores of random scenes, each against the rate of wrong labels stated beside it, and a
/// thousand serial faults for each controller.
pub fn campaign() -> Outcome {
    let filter = ["--", "campaign", "--ignored", "--nocapture", "--test-threads", "1"];
    run("serial faults", cargo(&["test", "--package", "sheaf-devices", "--lib"]).args(filter))?;
    run("campaign", cargo(&["test", "--package", "sheaf-scanning", "--test", "it"]).args(filter))
}

/// Whether steps may do what only root may.
pub fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout == b"0\n")
}

/// Where the reference data are, if they are anywhere.
pub fn data_folder() -> PathBuf {
    std::env::var_os("SHEAF_DATA").map_or_else(|| workspace().join("../shared/data"), PathBuf::from)
}
