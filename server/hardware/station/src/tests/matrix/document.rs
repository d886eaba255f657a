//! The tables of `server/docs/station.md` correspond to the tests of this module: every test has a cell, and every cell
//! has a test or a reason why the case cannot occur.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// The columns of every table, in order.
const COLUMNS: [&str; 7] = ["absent", "ready", "live", "scanning", "calibrating", "jogging", "homing"];

/// Path of the tests in the line before a table.
const FOLDER: &str = "server/hardware/station/src/tests/matrix/";

/// Prefix of a cell without a test.
const CANNOT_HAPPEN: &str = "cannot happen: ";

/// The cells of a document with and without a test, as `table::row::column`.
fn cells(document: &str) -> (BTreeSet<String>, BTreeSet<String>) {
    let (mut tested, mut excused) = (BTreeSet::new(), BTreeSet::new());
    let mut table = None;
    for line in document.lines() {
        if let Some(at) = line.find(FOLDER) {
            let file = &line[at + FOLDER.len()..];
            table = file.split_once(".rs`").map(|(name, _)| name.to_owned());
        }
        let Some(name) = &table else { continue };
        let Some(row) = line.strip_prefix("| `") else {
            if line.starts_with('#') {
                table = None;
            }
            continue;
        };
        let (row, rest) = row.split_once('`').expect("a row begins with the fault's name");
        let texts: Vec<&str> = rest.trim_end_matches('|').split('|').skip(1).map(str::trim).collect();
        assert_eq!(texts.len(), COLUMNS.len(), "{name}, {row}: {texts:?}");
        for (column, text) in COLUMNS.into_iter().zip(texts) {
            assert!(!text.is_empty() && text != "–", "{name}, {row}, {column}: neither a test nor a reason");
            let cell = format!("{name}::{row}::{column}");
            match text.strip_prefix(CANNOT_HAPPEN) {
                Some(reason) => assert!(reason.len() > 10 && excused.insert(cell), "{name}, {row}, {column}"),
                None => assert!(tested.insert(cell), "{name}, {row}: twice"),
            }
        }
    }
    (tested, excused)
}

/// The tests of this module that are cells.
fn tests() -> BTreeSet<String> {
    let listed = Command::new(std::env::current_exe().unwrap()).args(["--list", "matrix::"]).output().unwrap();
    let listed = String::from_utf8(listed.stdout).unwrap();
    let name = |line: &str| line.strip_suffix(": test")?.strip_prefix("tests::matrix::").map(str::to_owned);
    let is_cell = |name: &String| COLUMNS.contains(&name.rsplit("::").next().unwrap_or_default());
    listed.lines().filter_map(name).filter(is_cell).collect()
}

#[test]
fn every_cell_of_the_tables_has_its_test_or_its_reason_and_every_test_its_cell() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/station.md");
    let (tested, excused) = cells(&std::fs::read_to_string(path).unwrap());
    let tests = tests();
    let missing: Vec<_> = tested.difference(&tests).collect();
    let unlisted: Vec<_> = tests.difference(&tested).collect();
    assert!(
        missing.is_empty() && unlisted.is_empty(),
        "cells without a test: {missing:?}; tests without a cell: {unlisted:?}"
    );
    assert!(excused.is_disjoint(&tests), "{excused:?}");
    for table in ["twin", "genicam", "grbl", "zaber", "marlin", "conveyor"] {
        assert!(tested.iter().any(|cell| cell.starts_with(table)), "there is no table of {table}");
    }
}

#[test]
fn a_cell_without_reason_is_found() {
    let document = "`server/hardware/station/src/tests/matrix/twin.rs`\n| `fault` | disconnected | disconnected | – | a | a | a | a |";
    assert!(std::panic::catch_unwind(|| cells(document)).is_err());
    let (tested, excused) = cells(&document.replace('–', "cannot happen: nothing moves there"));
    assert_eq!((tested.len(), excused.len()), (6, 1));
    assert!(tested.contains("twin::fault::absent") && excused.contains("twin::fault::live"));
}
