//! A recorded capture folder is complete, valid and repeatable, and recognisable when incomplete.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use capture::{Capture, sha256_of};
use tempfile::TempDir;
use twin::{
    CaptureRequest, Progress, ScanRequest, SceneKind, StationModel, StationShape, TwinCaptureError, capture_folder,
};
use vision::LineDirection;

fn model() -> StationModel {
    let line_direction = LineDirection::Columns;
    let shape = StationShape { width_px: 192, height_px: 160, line_direction, ..StationShape::default() };
    StationModel::seeded(2, &shape).unwrap()
}

fn request() -> CaptureRequest {
    let part = SceneKind::Gauge { height_mm: 8.9 };
    let scan = ScanRequest { name: "gauge".to_owned(), part, n_frames: 5, step: 0.8 };
    CaptureRequest { n_poses: 2, stage_positions: vec![-5.0, 5.0], scans: vec![scan] }
}

fn record(folder: &Path, threads: usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| capture_folder(&model(), &request(), folder, &|_| ControlFlow::Continue(()))).unwrap();
}

#[test]
fn a_recording_opens_fits_the_schema_and_holds_its_truth() {
    let folder = TempDir::new().unwrap();
    record(folder.path(), 2);
    let capture = Capture::open(folder.path()).unwrap();
    assert_eq!(capture.warnings, Vec::<String>::new());
    assert_eq!(capture.files().len(), 2 * 2 + 2 + 5);
    assert_eq!(capture.manifest.projector.direction_of(0), LineDirection::Columns);
    for named in capture.files() {
        capture.image(&named.entry, &named.path).unwrap();
    }
    let schema = include_str!("../../../../docs/schemas/capture.schema.json");
    let schema = jsonschema::validator_for(&serde_json::from_str(schema).unwrap()).unwrap();
    let text = std::fs::read_to_string(capture.manifest_path()).unwrap();
    assert!(schema.is_valid(&serde_json::from_str(&text).unwrap()));
    let truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("truth.json")).unwrap()).unwrap();
    for key in ["pose0_R", "pose1_c", "gauge_scene", "K", "dist", "stage", "S", "axis", "fan", "normal", "groove"]
    {
        assert!(truth[key].is_array() || truth[key].is_object(), "{key}");
    }
    assert_eq!(truth["wavelength_over_period"], model().grating.wavelength_over_period);
    let table = std::fs::read_to_string(folder.path().join("truth-gauge.csv")).unwrap();
    let frames: std::collections::BTreeSet<&str> =
        table.lines().skip(1).filter_map(|row| row.split(',').next()).collect();
    assert_eq!(frames.into_iter().collect::<Vec<_>>(), ["0", "4"]);
}

#[test]
fn a_recording_repeats_byte_by_byte_with_any_number_of_threads() {
    let (a, b) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    record(a.path(), 1);
    record(b.path(), 3);
    let files = Capture::open(a.path()).unwrap().files();
    let names = files.iter().map(|named| named.path.clone());
    for name in names.chain(["capture.json", "truth.json", "truth-gauge.csv"].map(Into::into)) {
        let of = |folder: &TempDir| sha256_of(&folder.path().join(&name)).unwrap();
        assert_eq!(of(&a), of(&b), "{}", name.display());
    }
}

#[test]
fn progress_counts_every_image_and_can_end_the_recording() {
    let folder = TempDir::new().unwrap();
    let calls = AtomicUsize::new(0);
    let on_progress = |progress: Progress| {
        assert_eq!((progress.done, progress.total), (calls.fetch_add(1, Ordering::SeqCst) + 1, 11));
        if progress.done == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let outcome = pool.install(|| capture_folder(&model(), &request(), folder.path(), &on_progress));
    assert!(matches!(outcome, Err(TwinCaptureError::Cancelled { done: 3, total: 11 })), "{outcome:?}");
    Capture::open(folder.path()).unwrap_err();
}

#[test]
fn nothing_is_overwritten_and_names_cannot_leave_the_folder() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    let outcome = capture_folder(&model(), &request(), folder.path(), &|_| ControlFlow::Continue(()));
    assert!(matches!(outcome, Err(TwinCaptureError::FolderNotEmpty { .. })));
    let mut outside = request();
    outside.scans[0].name = "../x".to_owned();
    let outcome = capture_folder(&model(), &outside, folder.path(), &|_| ControlFlow::Continue(()));
    assert!(matches!(outcome, Err(TwinCaptureError::ScanName { .. })));
}
