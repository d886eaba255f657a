//! The disk space of a scan is known before it is accepted.

use crate::error::ErrorKind;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::bench::{Bench, from_station};
use crate::config::limits::FREE_FLOOR_BYTES;
use crate::jobs::plan::{Pace, plan};
use crate::jobs::{JobEnd, JobInput, JobParts, Jobs, ScanMode};

/// A queue on the bench whose jobs do nothing, on a disk with the given free space.
fn queue(bench: &Bench, free_bytes: Arc<AtomicU64>) -> Jobs {
    let parts = JobParts {
        config: bench.config.clone(),
        catalogue: bench.catalogue.clone(),
        artifacts: bench.store.artifacts.clone(),
        captures: bench.captures.clone(),
        station: bench.station.clone(),
        control: crate::access::lease::ControlDesk::default(),
        live: bench.live.clone(),
        recordings: bench.recordings.clone(),
        free_bytes: Arc::new(move || free_bytes.load(Ordering::SeqCst)),
    };
    bench.runtime.block_on(Jobs::start_with(parts, Arc::new(|_, _| Err(JobEnd::Cancelled)))).unwrap()
}

#[test]
fn a_scan_that_keeps_its_images_is_refused_without_disk_space_for_them() {
    let bench = Bench::new();
    let free_bytes = Arc::new(AtomicU64::new(0));
    let jobs = queue(&bench, free_bytes.clone());
    let submit = |keep_frames: bool, free: u64| {
        free_bytes.store(free, Ordering::SeqCst);
        let mut input = from_station(-6.0, 6.0, 0.2);
        input.settings.keep_frames = keep_frames;
        bench.runtime.block_on(jobs.submit(JobInput::Scan(input), "test"))
    };
    let calibration = bench.document.calibration();
    let planned = plan(
        &from_station(-6.0, 6.0, 0.2),
        &calibration,
        &bench.station.status(),
        &Pace::unknown(ScanMode::StopAndGo),
    )
    .unwrap();
    let enough = FREE_FLOOR_BYTES + planned.disk_bytes;
    submit(false, enough).unwrap();
    assert_eq!(submit(false, enough - 1).unwrap_err().kind, ErrorKind::StorageFull);
    // Sixty-one images of one byte per pixel, as files and once more in their archive.
    let images_bytes = 2 * 61 * 640 * 512;
    assert_eq!(submit(true, enough + images_bytes - 1).unwrap_err().kind, ErrorKind::StorageFull);
    submit(true, enough + images_bytes).unwrap();
    bench.runtime.block_on(jobs.shut_down());
}
