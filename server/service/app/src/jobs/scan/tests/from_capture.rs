//! The same frames give the same bytes: from the station, from its images, from its peaks, on any number of threads.

use std::io::Cursor;

use scanning::files::peaks::read_peaks;
use scanning::files::write_cloud_to;
use scanning::{CloudFormat, MeshFormat};
use store::{ScanRecord, ScanState};

use super::bench::{Bench, from_station, run, true_document};
use crate::jobs::export::{ExportFormat, bytes_to_artifact};
use crate::jobs::progress::Silent;
use crate::jobs::scan::recompute;
use crate::jobs::{ExportInput, RecomputeInput, ScanInput, ScanSource, export};
use crate::resources::scan_run::ScanSettings;
use pipeline::{open_capture, scan_capture};

fn from_capture(capture_id: &str, scan: Option<&str>) -> ScanInput {
    let source = ScanSource::Capture { capture_id: capture_id.to_owned(), scan: scan.map(str::to_owned) };
    ScanInput { source, settings: ScanSettings::default(), ..from_station(0.0, 0.0, 1.0) }
}

/// A scan with kept images.
fn with_pictures(bench: &Bench) -> (ScanRecord, String) {
    let mut input = from_station(-3.0, 3.0, 1.5);
    (input.settings.keep_frames, input.name) = (true, Some("ball".to_owned()));
    let scan = bench.scan(input);
    let capture_id = scan.capture_id.clone().expect("the images are kept");
    (scan, capture_id)
}

#[test]
fn the_images_of_a_scan_give_its_cloud_again_on_any_number_of_threads() {
    let bench = Bench::new();
    let (scan, capture_id) = with_pictures(&bench);
    let cloud = bench.cloud(&scan);
    assert!(cloud.len() > 1000 * 45, "{} bytes", cloud.len());
    for n_threads in [1, 2] {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        let again = threads.install(|| bench.scan(from_capture(&capture_id, None)));
        assert_eq!(again.state, ScanState::Complete);
        assert_eq!(bench.cloud(&again), cloud, "{n_threads} threads");
        let peaks = |record: &ScanRecord| read_peaks(Cursor::new(bench.bytes(&record.peaks))).unwrap().frames;
        assert_eq!(peaks(&again), peaks(&scan));
    }
    // What `sheaf scan` writes for the same folder.
    let folder = bench.captures.check_out(&capture_id).unwrap();
    let reporter = Silent;
    let capture = open_capture(&folder.folder, &reporter).unwrap();
    let result = scan_capture(&capture, &bench.document, "ball", &reporter).unwrap();
    let mut bytes = Vec::new();
    write_cloud_to(Cursor::new(&mut bytes), CloudFormat::Ply, &result.cloud).unwrap();
    assert_eq!(bytes, cloud);
}

#[test]
fn a_recomputed_scan_is_identical_with_the_same_calibration_and_a_new_record_with_another() {
    let bench = Bench::new();
    let scan = bench.scan(from_station(-3.0, 3.0, 1.5));
    let again = |calibration_id: Option<&str>| {
        let input = RecomputeInput { scan_id: scan.id.clone(), calibration_id: calibration_id.map(str::to_owned) };
        let id = bench.finish(recompute::run(input, &bench.job().ctx));
        bench.record(&id)
    };
    let same = again(None);
    assert_eq!(bench.cloud(&same), bench.cloud(&scan));
    assert_eq!((same.recomputed_from.as_deref(), &same.peaks), (Some(scan.id.as_str()), &scan.peaks));
    assert_ne!(same.id, scan.id);
    let mut model = (*bench.operator.model()).clone();
    model.camera.fx_px *= 1.001;
    bench.add_calibration(&true_document(&model, "other000"), false);
    let other = again(Some("other000"));
    assert_eq!(other.calibration_id, "other000");
    assert_ne!(bench.cloud(&other), bench.cloud(&scan));
    assert_eq!(bench.record(&scan.id), scan, "the original is not changed");
}

#[test]
fn the_only_scan_of_a_capture_needs_no_name_and_several_are_listed() {
    let bench = Bench::new();
    let (scan, capture_id) = with_pictures(&bench);
    assert_eq!(bench.scan(from_capture(&capture_id, Some("ball"))).name, "ball");
    let refused = |input: ScanInput| match run(input, &bench.job().ctx) {
        Err(crate::jobs::JobEnd::Failed(problem)) => problem,
        other => panic!("{:?}", other.map(|done| done.message)),
    };
    let unknown = refused(from_capture(&capture_id, Some("cube")));
    assert!(unknown.detail.contains("cube") && format!("{unknown:?}").contains("ball"), "{unknown:?}");
    let mut with_range = from_capture(&capture_id, None);
    with_range.settings.step_mm = Some(0.1);
    assert_eq!(refused(with_range).pointer.as_deref(), Some("/step_mm"));
    // A capture with two scans: the same images under two names.
    let folder = bench.captures.check_out(&capture_id).unwrap();
    let copy = bench.folder.path().join("two");
    std::fs::create_dir_all(copy.join("scan")).unwrap();
    for row in 0..5 {
        let name = format!("scan/{row:05}.png");
        std::fs::copy(folder.folder.join(&name), copy.join(&name)).unwrap();
    }
    let mut manifest = capture::Capture::open(&folder.folder).unwrap().manifest;
    let mut second = manifest.scans[0].clone();
    second.name = "cup".to_owned();
    manifest.scans.push(second);
    capture::write_manifest(&copy, &manifest).unwrap();
    let origin = crate::resources::captures::CaptureOrigin::Scan;
    let (record, change) = bench.captures.take_in_folder(&copy, origin, "two").unwrap();
    bench.runtime.block_on(bench.catalogue.commit(vec![change])).unwrap();
    let several = refused(from_capture(&record.id, None));
    assert!(several.detail.contains("2 scans: ball, cup"), "{several:?}");
    assert_eq!(several.pointer.as_deref(), Some("/source/scan"));
    assert_eq!(scan.state, ScanState::Complete);
}

#[test]
fn an_export_is_computed_once_and_reads_back_as_the_cloud() {
    let bench = Bench::new();
    let scan = bench.scan(from_station(-3.0, 3.0, 1.5));
    let export_of =
        |format| bench.runtime.block_on(bytes_to_artifact(&bench.store.artifacts, &scan, format)).unwrap();
    assert_eq!(Some(export_of(ExportFormat::Cloud(CloudFormat::Ply))), scan.cloud);
    let read = |format, id: &store::ArtifactId| {
        scanning::files::read_cloud_from(&mut Cursor::new(bench.bytes(id)), format).unwrap()
    };
    let cloud = read(CloudFormat::Ply, scan.cloud.as_ref().unwrap());
    for format in [CloudFormat::Csv, CloudFormat::Pcd] {
        let id = export_of(ExportFormat::Cloud(format));
        assert_eq!(read(format, &id).points, cloud.points, "{format:?}");
        assert_eq!(export_of(ExportFormat::Cloud(format)), id);
    }
    let stl = export_of(ExportFormat::Mesh(MeshFormat::Stl));
    assert!(bench.bytes(&stl).len() > 84 + 50 * 100, "a mesh of more than a hundred triangles");
    let input = ExportInput { scan_id: scan.id.clone(), what: "mesh".into(), format: "stl".into() };
    let id = bench.finish(export::run(input, &bench.job().ctx));
    assert_eq!(id, format!("{}/mesh.stl", scan.id));
    assert!(ExportFormat::parse("mesh", "e57").unwrap_err().remedy.unwrap().contains("stl, glb, ply"));
}
