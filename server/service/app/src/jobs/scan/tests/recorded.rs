//! A recorded scan, and one whose recording ends early. Not tested here: a recording that is replayed by a
//! station (`tests/it/http/recordings.rs` of the program).

use std::sync::atomic::Ordering;
use std::time::Duration;

use recording::{RecordingFile, export};
use store::{Page, RecordingRecord, RecordingState, ScanRecord, ScanState};
use twin::TwinFault;

use super::bench::{Bench, from_station, run};
use crate::config::limits::FREE_FLOOR_BYTES;
use crate::jobs::{JobEnd, ScanInput, ScanMode, ScanSource};
use crate::recordings::RecordingOf;
use crate::recordings::figures::{Ended, RecordingFigures};
use crate::resources::captures::CaptureOrigin;
use crate::resources::scan_run::ScanSettings;

fn recorded(mut input: ScanInput) -> ScanInput {
    (input.settings.record, input.name) = (true, Some("ball".to_owned()));
    input
}

fn recordings(bench: &Bench) -> Vec<RecordingRecord> {
    let page = Page { before: None, limit: 100 };
    bench.runtime.block_on(bench.catalogue.read().recordings(&page)).unwrap().records
}

/// The only recording, its figures and its file.
fn only_recording(bench: &Bench) -> (RecordingRecord, RecordingFigures, RecordingFile) {
    let [record] = &recordings(bench)[..] else { panic!("{:?}", recordings(bench)) };
    let path = bench.folder.path().join("recording.mcap");
    std::fs::write(&path, bench.bytes(record.file.as_ref().expect("a file"))).unwrap();
    let figures = serde_json::from_value(record.summary.clone()).unwrap();
    (record.clone(), figures, RecordingFile::open(&path).unwrap())
}

/// The cloud of a scan that is computed from the recording.
fn cloud_of_recording(bench: &Bench, file: &RecordingFile) -> Vec<u8> {
    let folder = bench.folder.path().join("exported");
    export(file, &folder, |_, _| {}).unwrap();
    let (record, change) = bench.captures.take_in_folder(&folder, CaptureOrigin::Upload, "exported").unwrap();
    bench.runtime.block_on(bench.catalogue.commit(vec![change])).unwrap();
    let source = ScanSource::Capture { capture_id: record.id, scan: None };
    let input = ScanInput { source, settings: ScanSettings::default(), ..from_station(0.0, 0.0, 1.0) };
    bench.cloud(&bench.scan(input))
}

fn check_same_cloud(bench: &Bench, scan: &ScanRecord) {
    assert_eq!(scan.state, ScanState::Complete, "{}", scan.report);
    let (record, figures, file) = only_recording(bench);
    assert_eq!((record.state, figures.ended), (RecordingState::Complete, Some(Ended::ScanEnded)));
    assert_eq!((record.scan_id.as_deref(), record.origin.as_str()), (Some(scan.id.as_str()), "scan"));
    assert_eq!(figures.n_rows, scan.report["n_frames"].as_u64().unwrap());
    assert!(!file.is_lossy() && file.is_complete, "{:?}", file.summary());
    let document = file.calibration.clone().unwrap();
    assert_eq!(document, bench.document.to_json().as_bytes());
    let cloud = bench.cloud(scan);
    assert!(cloud.len() > 1000 * 45, "{} bytes", cloud.len());
    assert!(cloud_of_recording(bench, &file) == cloud, "the clouds differ");
}

#[test]
fn a_recorded_stop_and_go_scan_is_recomputed_bit_by_bit() {
    let bench = Bench::new();
    let scan = bench.scan(recorded(from_station(-3.0, 3.0, 1.5)));
    check_same_cloud(&bench, &scan);
}

#[test]
fn a_recorded_continuous_scan_is_recomputed_bit_by_bit_and_also_has_its_run_up_frames() {
    let bench = Bench::new();
    let mut input = recorded(from_station(-2.0, 2.0, 0.4));
    (input.settings.mode, input.settings.speed_mm_s) = (Some(ScanMode::Continuous), Some(2.0));
    let scan = bench.scan(input);
    check_same_cloud(&bench, &scan);
    let (_, figures, file) = only_recording(&bench);
    assert!(figures.n_frames > figures.n_rows, "{figures:?}");
    let positions: Vec<f64> = file.frames.iter().filter_map(|frame| frame.note.position.position_mm).collect();
    assert!(positions.iter().any(|position_mm| *position_mm < -2.0), "{positions:?}");
}

#[test]
fn a_disk_near_its_floor_ends_the_recording_and_not_the_scan() {
    let bench = Bench::new();
    let free_bytes = bench.free_bytes.clone();
    let job = bench.job_cancelled_at(move |words| {
        if words == "row 3 of 9" {
            free_bytes.store(FREE_FLOOR_BYTES - 1, Ordering::Relaxed);
            // Longer than until the next check of the disk.
            std::thread::sleep(Duration::from_millis(900));
        }
        false
    });
    let id = bench.finish(run(recorded(from_station(-2.0, 2.0, 0.5)), &job.ctx));
    let scan = bench.record(&id);
    assert_eq!((scan.state, &scan.report["n_frames"]), (ScanState::Complete, &9.into()), "{}", scan.report);
    let (record, figures, file) = only_recording(&bench);
    assert_eq!((record.state, figures.ended), (RecordingState::Complete, Some(Ended::DiskFloor)));
    assert_eq!((figures.n_rows, file.frames.len(), file.is_complete), (3, 3, true), "{figures:?}");
    assert_eq!(file.end.as_ref().unwrap().reason, "free disk space reached its lower limit");
    let events = bench.runtime.block_on(bench.catalogue.read().events_after(0, 100)).unwrap().records;
    let ended = events.iter().find(|event| event.kind == "recording.ended").unwrap();
    assert_eq!((&ended.body["ended"], &ended.body["n_frames"]), (&"disk_floor".into(), &3.into()));
    // Without free space the scan is refused before anything moves.
    match run(recorded(from_station(-2.0, 2.0, 0.5)), &bench.job().ctx) {
        Err(JobEnd::Failed(problem)) => assert_eq!(problem.kind, crate::error::ErrorKind::StorageFull),
        other => panic!("{:?}", other.map(|done| done.message)),
    }
    assert_eq!(recordings(&bench).len(), 1);
}

#[test]
fn lost_exposures_are_counted_in_the_recording() {
    let bench = Bench::new();
    bench.operator.set_fault(TwinFault::LostFrames { every: 4 });
    let before = bench.station.status();
    let scan = bench.scan(recorded(from_station(-3.0, 3.0, 0.5)));
    assert_eq!(scan.state, ScanState::Invalid);
    let (_, figures, file) = only_recording(&bench);
    let after = bench.station.status();
    let of = |status: &station::StationStatus, reason: &str| {
        status.frames_dropped.iter().find(|(name, _)| *name == reason).map_or(0, |(_, count)| *count)
    };
    assert_eq!(figures.n_frames, after.frames_arrived - before.frames_arrived);
    let lost: Vec<_> = figures.lost.by_reason().into_iter().collect();
    let expected: Vec<_> =
        lost.iter().map(|(reason, _)| (*reason, of(&after, reason) - of(&before, reason))).collect();
    assert_eq!(lost, expected, "by reason, exactly");
    assert!(figures.lost.camera > 0 && file.is_lossy(), "{figures:?}");
    assert_eq!(file.summary().lost, figures.lost);
    assert_eq!(figures.n_rows, 13, "all rows are present");
}

#[test]
fn a_recording_of_a_crashed_process_is_repaired_at_the_next_start() {
    let bench = Bench::new();
    let nothing = |_: &RecordingRecord| Ok::<_, crate::error::AppError>(Vec::new());
    let of = RecordingOf::Scan { scan_id: "s".into(), calibration_id: "true0000".into(), needed_bytes: 0 };
    let begun = bench.runtime.block_on(bench.recordings.begin("half", of, None, nothing)).unwrap();
    let path = bench.folder.path().join(format!("data/recordings/{}.mcap", begun.id));
    let lease = bench.job().ctx.take_station("test").unwrap_or_else(|_| panic!("the station is free"));
    for _ in 0..5 {
        lease.grab(&station::cancel::CancelFlag::default()).unwrap();
    }
    // What is on disk a second later is what a killed process leaves.
    std::thread::sleep(Duration::from_secs(1));
    let left = std::fs::read(&path).unwrap();
    drop(lease);
    bench.runtime.block_on(bench.recordings.end(None, Ended::Stopped)).unwrap();
    let whole = only_recording(&bench);
    assert_eq!((whole.1.n_frames, whole.1.ended), (5, Some(Ended::Stopped)));

    // As a crashed process leaves it: the record in progress, the file without its end, and an unreferenced file.
    std::fs::write(&path, &left[..left.len() - 7]).unwrap();
    let nameless = path.with_file_name("nameless.mcap");
    std::fs::write(&nameless, b"nothing").unwrap();
    bench.runtime.block_on(bench.catalogue.commit(vec![store::Change::UpdateRecording(begun.clone())])).unwrap();
    bench.runtime.block_on(bench.recordings.recover());
    let begun_at = std::time::Instant::now();
    while recordings(&bench)[0].file.is_none() {
        assert!(begun_at.elapsed() < Duration::from_secs(20), "{:?}", recordings(&bench));
        std::thread::sleep(Duration::from_millis(20));
    }
    let (record, figures, file) = only_recording(&bench);
    assert_eq!((record.state, figures.ended), (RecordingState::Interrupted, Some(Ended::Crashed)));
    assert!(file.is_complete && file.frames.len() >= 4, "{figures:?}");
    assert!(!path.exists() && !nameless.exists());
}
