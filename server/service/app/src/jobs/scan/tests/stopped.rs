//! Scans that are stopped and resumed: captured rows are kept, and the result is identical to the last bit.

use crate::error::ErrorKind;
use std::io::Cursor;

use scanning::files::peaks::{Peaks, read_peaks};
use store::{ScanRecord, ScanState};
use twin::TwinFault;

use super::super::work::{Work, WorkNote, recover};
use super::bench::{Bench, from_station, resumed, run};
use crate::jobs::{JobEnd, ScanInput};

fn peaks(bench: &Bench, record: &ScanRecord) -> Peaks {
    read_peaks(Cursor::new(bench.bytes(&record.peaks))).unwrap()
}

fn cancelled(bench: &Bench, input: ScanInput, at: &'static str) {
    let job = bench.job_cancelled_at(move |words| words.contains(at));
    let end = run(input, &job.ctx);
    assert!(matches!(end, Err(JobEnd::Cancelled)), "at {at}: {:?}", end.map(|done| done.message));
}

#[test]
fn a_scan_cancelled_at_any_step_turns_the_laser_off_and_keeps_its_rows() {
    let bench = Bench::new();
    for (at, rows) in
        [("row 1 of", 1), ("row 3 of", 3), ("row 5 of 5", 5), ("computing the cloud", 5), ("storing the cloud", 5)]
    {
        cancelled(&bench, from_station(-2.0, 2.0, 1.0), at);
        let scan = bench.scans().remove(0);
        assert_eq!((scan.state, scan.cloud.clone()), (ScanState::Partial, None), "at {at}");
        let n_frames = peaks(&bench, &scan).frames.len();
        assert_eq!((n_frames, scan.report["n_frames"].as_u64()), (rows, Some(rows as u64)), "at {at}");
        assert_eq!(bench.operator.laser_power(), 0.0, "at {at}");
    }
    assert_eq!(bench.scans().len(), 5);
    let job = bench.job();
    job.ctx.cancel.cancel();
    assert!(matches!(run(from_station(-2.0, 2.0, 1.0), &job.ctx), Err(JobEnd::Cancelled)));
    assert_eq!(bench.scans().len(), 5, "nothing was captured, nothing is kept");
}

#[test]
fn a_resumed_scan_equals_an_uninterrupted_one_bit_by_bit() {
    let whole = Bench::new();
    let mut input = from_station(-3.0, 3.0, 1.0);
    input.settings.keep_frames = true;
    let expected = whole.scan(input.clone());
    let bench = Bench::new();
    cancelled(&bench, input, "row 3 of");
    let partial = bench.scans().remove(0);
    let done = bench.scan(resumed(&partial.id));
    assert_eq!((done.id.as_str(), done.state), (partial.id.as_str(), ScanState::Complete));
    assert_eq!(bench.scans().len(), 1, "the complete scan replaces the partial one");
    assert_eq!(peaks(&bench, &done).frames, peaks(&whole, &expected).frames);
    assert_eq!(bench.cloud(&done), whole.cloud(&expected));
    let images = |bench: &Bench, scan: &ScanRecord| {
        let folder = bench.captures.check_out(scan.capture_id.as_ref().unwrap()).unwrap();
        let manifest = std::fs::read(folder.folder.join("capture.json")).unwrap();
        let image = |row: usize| std::fs::read(folder.folder.join(format!("scan/{row:05}.png"))).unwrap();
        (manifest, (0..7).map(image).collect::<Vec<_>>())
    };
    assert!(images(&bench, &done) == images(&whole, &expected), "other images");
}

#[test]
fn a_scan_is_resumed_only_with_its_own_settings() {
    let bench = Bench::new();
    cancelled(&bench, from_station(-2.0, 2.0, 1.0), "row 2 of");
    let partial = bench.scans().remove(0);
    let refused = |change: &dyn Fn(&mut ScanInput)| {
        let mut input = resumed(&partial.id);
        change(&mut input);
        match run(input, &bench.job().ctx) {
            Err(JobEnd::Failed(problem)) => (problem.kind, problem.detail),
            other => panic!("{:?}", other.map(|done| done.message)),
        }
    };
    let (kind, detail) = refused(&|input| input.settings.step_mm = Some(0.5));
    assert_eq!(kind, ErrorKind::Conflict);
    assert!(detail.contains("step_mm 0.5 instead of 1"), "{detail}");
    let (kind, detail) = refused(&|input| input.calibration_id = Some("other000".into()));
    assert!(kind == ErrorKind::Conflict && detail.contains("true0000"), "{detail}");
    let done = bench.scan(resumed(&partial.id));
    let (kind, _) = refused(&|_| {});
    assert_eq!((done.state, kind), (ScanState::Complete, ErrorKind::Conflict), "a complete scan is not resumed");
}

#[test]
fn a_fault_leaves_a_partial_scan_and_says_how_to_resume_it() {
    let bench = Bench::new();
    bench.operator.set_fault(TwinFault::StageStall { at_mm: 0.5 });
    let Err(JobEnd::Failed(problem)) = run(from_station(-2.0, 2.0, 1.0), &bench.job().ctx) else {
        panic!("passed the obstacle")
    };
    let partial = bench.scans().remove(0);
    assert_eq!((partial.state, partial.report["n_frames"].as_u64()), (ScanState::Partial, Some(3)));
    assert!(problem.remedy.as_ref().unwrap().contains(&format!("resume scan {}", partial.id)), "{problem:?}");
    assert_eq!(bench.operator.laser_power(), 0.0);
}

#[test]
fn a_crash_leaves_a_partial_scan_that_resumes_to_the_same_result() {
    let bench = Bench::new();
    let expected = bench.scan(from_station(-2.0, 2.0, 1.0));
    let all = peaks(&bench, &expected);
    // The folder of a process that crashed while writing the third row.
    let note = WorkNote {
        scan_id: crate::resources::stored_scan::new_id(),
        name: expected.name.clone(),
        plan: expected.plan.clone(),
        calibration_id: expected.calibration_id.clone(),
        job_id: "dead".into(),
        replaces: false,
        losses: Vec::new(),
    };
    let (work, mut file) = Work::begin(&*bench.store.artifacts, note.clone(), &all.header, None, false).unwrap();
    for frame in &all.frames[..3] {
        file.add(frame, None).unwrap();
    }
    file.flush().unwrap();
    drop(file);
    let torn = std::fs::metadata(work.peaks()).unwrap().len() - 100;
    std::fs::File::options().write(true).open(work.peaks()).unwrap().set_len(torn).unwrap();
    bench.runtime.block_on(recover(&bench.catalogue, &*bench.store.artifacts));
    let partial = bench.record(&note.scan_id);
    assert_eq!((partial.state, partial.report["n_frames"].as_u64()), (ScanState::Partial, Some(2)));
    assert_eq!(peaks(&bench, &partial).frames, all.frames[..2]);
    let done = bench.scan(resumed(&partial.id));
    assert_eq!(bench.cloud(&done), bench.cloud(&expected));
    bench.runtime.block_on(recover(&bench.catalogue, &*bench.store.artifacts));
    assert_eq!(bench.scans().len(), 2, "nothing is left to recover");
}

#[test]
fn a_work_folder_without_frames_is_removed() {
    let bench = Bench::new();
    let folder = bench.folder.path().join("data/work/01890000-0000-7000-8000-000000000000");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("scan.json"), "{").unwrap();
    bench.runtime.block_on(recover(&bench.catalogue, &*bench.store.artifacts));
    std::fs::write(folder.join("peaks"), b"").unwrap();
    std::fs::remove_file(folder.join("scan.json")).unwrap();
    bench.runtime.block_on(recover(&bench.catalogue, &*bench.store.artifacts));
    assert!(!folder.exists());
    assert_eq!(bench.scans(), []);
}
