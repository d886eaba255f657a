//! A PLC of another author: pymodbus, see `tests/plc.py`.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::registers::result_block::result_seq;
use crate::tests::plant::Plant;

/// Parts that the PLC triggers.
const N_PARTS: usize = 10_000;

/// Results between two crashes of the server.
const CRASH_EVERY: usize = 997;

/// Numbers of results pass their end on the way.
const BEFORE_FIRST: i64 = 60_000;

/// Runs the PLC; the server crashes now and then, also between an acknowledgement and its storage. The PLC notes every
/// result that is ahead of the one before; its block acknowledges most repetitions before it reads them.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn ten_thousand_parts_arrive_once_and_in_order_although_the_server_crashes() {
    let Some(python) = reference::python() else { return };
    let mut plant = Plant::new(BEFORE_FIRST);
    plant.start();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/plc.py");
    let mut command = Command::new(python);
    command.arg(script).args([plant.address.port().to_string(), N_PARTS.to_string()]).stdout(Stdio::piped());
    let mut plc = tokio::task::spawn_blocking(move || command.spawn().unwrap().wait_with_output().unwrap());

    let mut inspected = plant.line.inspected.subscribe();
    let (mut next_crash, mut n_crashes) = (CRASH_EVERY, 0);
    let output = loop {
        tokio::select! {
            output = &mut plc => break output.unwrap(),
            _ = inspected.changed() => {}
        }
        if inspected.borrow_and_update().len() >= next_crash {
            (next_crash, n_crashes) = (next_crash + CRASH_EVERY, n_crashes + 1);
            if n_crashes % 2 == 0 {
                plant.kill_before_storing().await;
            } else {
                // Somewhere between trigger, result and acknowledgement.
                tokio::time::sleep(Duration::from_micros(400 * n_crashes)).await;
                plant.kill().await;
            }
            plant.start();
        }
    };
    assert!(output.status.success(), "the PLC says on stderr why");
    assert!(n_crashes >= 10, "{n_crashes}");

    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let serials = inspected.borrow().clone();
    let expected: Vec<Value> = (BEFORE_FIRST + 1..)
        .zip(&serials)
        .map(|(seq, serial)| serde_json::json!([result_seq(seq), serial]))
        .collect();
    assert_eq!(report["results"].as_array().unwrap(), &expected);
    let mut parts = serials;
    parts.dedup();
    assert_eq!(parts.len(), N_PARTS);
    plant.stored(expected.len()).await;
    eprintln!("{n_crashes} crashes, {} results, {} again", expected.len(), report["repeated"]);
}
