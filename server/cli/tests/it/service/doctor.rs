//! `sheaf doctor`: consent, table, JSON, exit code, Ctrl-C. Its checks have unit tests.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Child, Command, Output, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

use crate::common::SHEAF;

/// A slow simulated camera, since full images are rendered by a debug build.
const RATE: [&str; 2] = ["--frame-rate-hz", "5"];

fn doctor(options: &[&str]) -> Child {
    let folder = std::env::temp_dir();
    Command::new(SHEAF)
        .arg("doctor")
        .args(RATE)
        .args(["--data", folder.join("sheaf-doctor-keeps-nothing").to_str().unwrap()])
        .args(options)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Closes standard input and waits for the result.
fn ended(mut child: Child) -> Output {
    drop(child.stdin.take());
    child.wait_with_output().unwrap()
}

#[test]
fn all_checks_are_reported_as_json_with_an_exit_code() {
    let output = ended(doctor(&["--yes", "--json"]));
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    let checks = answer["checks"].as_array().unwrap();
    assert_eq!(checks.len(), 18, "{answer:#}");
    for check in checks {
        let outcome = check["outcome"].as_str().unwrap();
        assert!(["ok", "not_ok", "not_run"].contains(&outcome), "{check}");
        assert!(outcome != "not_ok" || check["remedy"] != "", "a fault without remedy: {check}");
    }
    // A busy machine may render too slowly; the exit code must agree with the table.
    let is_ok = checks.iter().all(|check| check["outcome"] != "not_ok");
    assert_eq!(answer["ok"], is_ok);
    assert_eq!(output.status.code(), Some(if is_ok { 0 } else { 5 }));
    let shown = String::from_utf8(output.stderr).unwrap();
    for step in [
        "opening the devices",
        "running the camera with the laser off",
        "turning the laser on",
        "moving the stage",
    ] {
        assert!(shown.contains(step), "{step} is not shown: {shown}");
    }
}

#[test]
fn without_consent_motion_and_laser_stay_off() {
    let output = ended(doctor(&[]));
    let (table, shown) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(shown.contains("Continue? [y/N]"), "{shown}");
    assert!(!shown.contains("turning the laser on") && !shown.contains("moving the stage"), "{shown}");
    assert!(table.contains("laser and motion") && table.contains("no consent"), "{table}");
}

#[test]
fn ctrl_c_ends_the_doctor_at_any_step() {
    for at in ["running the camera with the laser off", "Continue? [y/N]"] {
        let mut child = doctor(&[]);
        // `wait` would close stdin, which ends the prompt just as the signal does.
        let _open = child.stdin.take();
        let (mut stderr, mut shown) = (BufReader::new(child.stderr.take().unwrap()), Vec::new());
        while !String::from_utf8_lossy(&shown).contains(at) {
            let read = stderr.fill_buf().unwrap();
            assert!(!read.is_empty(), "{at}: it ended: {}", String::from_utf8_lossy(&shown));
            let n_read = read.len();
            shown.extend_from_slice(read);
            stderr.consume(n_read);
        }
        kill(Pid::from_raw(child.id() as i32), Signal::SIGINT).unwrap();
        let status = child.wait().unwrap();
        stderr.read_to_end(&mut shown).unwrap();
        let shown = String::from_utf8_lossy(&shown);
        assert_eq!(status.code(), Some(1), "{at}: {shown}");
        assert!(shown.contains("cancelled") && shown.contains("the laser is off"), "{at}: {shown}");
    }
}
