//! Every exposure arrives or is counted as lost, exactly.

use std::sync::atomic::Ordering;

use twin::TwinFault;

use super::bench::{Bench, bench_of, never_cancelled, small_devices};
use super::spy_camera::{Spy, spied};
use crate::StationRefusal;
use crate::params::FRAME_BUFFERS;

fn spied_bench() -> (Bench, std::sync::Arc<Spy>) {
    let (devices, spy) = spied(small_devices());
    let bench = bench_of(devices);
    bench.wait_for("ready", |status| status.activity == "ready");
    (bench, spy)
}

/// Checks arrived and lost frames in the status, once their sum equals the number of exposures.
fn check(bench: &Bench, spy: &Spy) {
    let exposed = spy.triggers.load(Ordering::SeqCst);
    let lost = |status: &crate::StationStatus| -> u64 {
        status.frames_dropped.iter().filter(|(reason, _)| *reason != "recorder").map(|(_, count)| count).sum()
    };
    bench.wait_for(&format!("accounting for {exposed} exposures"), |status| {
        status.frames_arrived + lost(status) == exposed
    });
}

#[test]
fn exposures_lost_on_the_cable_are_repeated_and_counted_once() {
    let (bench, spy) = spied_bench();
    bench.control.set_fault(TwinFault::LostFrames { every: 3 });
    let lease = bench.lease();
    for _ in 0..5 {
        lease.grab(&never_cancelled()).unwrap();
    }
    assert!(spy.triggers.load(Ordering::SeqCst) > 5, "some were repeated");
    check(&bench, &spy);
    assert!(bench.station.status().faults.is_empty(), "a lost frame is counted, not a fault");
}

#[test]
fn frames_without_a_free_buffer_are_counted() {
    let (bench, spy) = spied_bench();
    let lease = bench.lease();
    let mut kept = Vec::new();
    let refusal = loop {
        match lease.grab(&never_cancelled()) {
            Ok(frame) => kept.push(frame),
            Err(refusal) => break refusal,
        }
    };
    assert!(matches!(refusal, StationRefusal::NoFrame { .. }), "{refusal}");
    assert_eq!(kept.len(), FRAME_BUFFERS, "all buffers were used");
    bench.wait_for("counted", |status| status.frames_dropped.contains(&("no_buffer", 2)));
    check(&bench, &spy);
}

#[test]
fn buffers_are_reused_and_not_reallocated() {
    let (bench, _spy) = spied_bench();
    let lease = bench.lease();
    let place = |frame: &crate::SharedFrame| match frame.image.pixels() {
        vision::Pixels::Eight(pixels) => pixels.as_ptr() as usize,
        vision::Pixels::Sixteen(pixels) => pixels.as_ptr() as usize,
    };
    let places: std::collections::BTreeSet<usize> =
        (0..50).map(|_| place(&lease.grab(&never_cancelled()).unwrap())).collect();
    // The newest frame, the one being replaced, the driver's, and one being returned.
    assert!(places.len() <= 4, "{} buffers for one frame at a time", places.len());
}
