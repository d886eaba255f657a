//! The API's document: checked in as the routes make it, and true.

use std::process::Command;

use crate::common::{out, sheaf_ok};
use crate::fresh;

#[test]
fn the_document_checked_in_is_the_one_the_routes_make() {
    let checked_in = concat!(env!("CARGO_MANIFEST_DIR"), "/../openapi/openapi.json");
    let checked_in = std::fs::read_to_string(checked_in).unwrap();
    assert!(out(&sheaf_ok(&["openapi"])) == checked_in, "run `cargo xtask openapi` and look at what changed");
}

/// Examples per operation: the fuzzer's own corner cases come on top.
const EXAMPLES: &str = "5";

/// Faults are switched on by name here and nowhere else: with them a device's 503 is the right answer, not a defect.
const FAULTS: &str = "/api/v1/simulation/faults";

#[test]
fn a_fuzzer_finds_no_server_error_and_no_undocumented_answer() {
    let Ok(python) = std::env::var("SHEAF_TEST_PYTHON") else {
        eprintln!("skipped: SHEAF_TEST_PYTHON names no Python with schemathesis (cargo xtask test sets it)");
        return;
    };
    let (_folder, server) = fresh();
    let checks = "not_a_server_error,status_code_conformance,content_type_conformance,\
                  response_schema_conformance,response_headers_conformance";
    let output = Command::new(python)
        .args(["-m", "schemathesis.cli", "run"])
        .arg(format!("{}/openapi.json", server.url))
        .args(["--checks", checks, "--max-examples", EXAMPLES, "--phases", "examples,coverage,fuzzing"])
        .args(["--exclude-path", FAULTS, "--seed", "1", "--no-color"])
        .env("SCHEMATHESIS_HOOKS", concat!(env!("CARGO_MANIFEST_DIR"), "/tests/http/uploads_hook.py"))
        .output()
        .unwrap();
    let said = out(&output);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("passed"), "{said}");
}
