//! A scan read from a file piece by piece, on any number of threads, gives the same result as the scan in memory. The
//! correctness of labels and points is tested elsewhere.

use std::io::Cursor;
use std::path::Path;

use optics::{StageKind, StagePosition};
use scanning::files::peaks::{PeaksFile, PeaksHeader, PeaksWriter, read_one_frame, read_positions};
use scanning::files::{CloudWriter, write_cloud_in_pieces, write_cloud_to};
use scanning::scan::evaluate_keeping;
use scanning::synthetic::{SIZE_PX, SyntheticScan};
use scanning::{
    Cloud, CloudFormat, DropReason, FileError, Frames, ScanError, ScanFrame, ScanParams, ScanReport, scan_cloud,
};
use vision::{LineDirection, Segment};

/// Enough frames for several windows and batches.
const N_FRAMES: usize = 90;

/// A scan with a stationary reflection, so that points are dropped for every reason that involves other frames.
fn frames(scan: &SyntheticScan) -> Vec<ScanFrame> {
    let ghost = |mut frame: ScanFrame| {
        let line = &frame.centrelines.segments[2].points;
        let mut points = line[line.len() / 8..line.len() * 7 / 8].to_vec();
        points.iter_mut().for_each(|point| point.v_px += 70.0);
        frame.centrelines.segments.push(Segment { points });
        frame
    };
    (0..N_FRAMES).map(|idx| ghost(scan.frame(idx))).collect()
}

fn written(frames: &[ScanFrame], folder: &Path) -> PeaksFile {
    let path = folder.join("peaks");
    let header = PeaksHeader {
        width_px: SIZE_PX[0] as u32,
        height_px: SIZE_PX[1] as u32,
        line_direction: LineDirection::Rows,
        stage: StageKind::Linear,
    };
    let mut writer = PeaksWriter::create(&path, &header).unwrap();
    frames.iter().for_each(|frame| writer.add(frame, None).unwrap());
    writer.finish().unwrap();
    PeaksFile::open(&path).unwrap()
}

fn evaluated(frames: &dyn Frames, scan: &SyntheticScan, keep_points: usize) -> (Cloud, ScanReport) {
    let evaluation = evaluate_keeping(frames, &scan.calibration, &ScanParams::default(), keep_points).unwrap();
    let mut points = Vec::new();
    let result = evaluation.for_each_frame(|of_frame| -> Result<(), ScanError> {
        points.extend_from_slice(of_frame);
        Ok(())
    });
    result.unwrap();
    (Cloud { points, comments: evaluation.comments }, evaluation.report)
}

#[test]
fn a_scan_from_a_file_equals_the_scan_in_memory_for_any_cache_and_number_of_threads() {
    let scan = SyntheticScan::new(N_FRAMES, 600);
    let frames = frames(&scan);
    let folder = tempfile::tempdir().unwrap();
    let file = written(&frames, folder.path());
    let whole = scan_cloud(&frames, &scan.calibration, &ScanParams::default()).unwrap();
    assert!(whole.report.n_points > 40_000, "{:?}", whole.report.dropped);
    assert!(whole.report.dropped.n_points(DropReason::Contradicted) > 0, "{:?}", whole.report.dropped);
    for (threads, keep_points) in [(1, 0), (2, 20_000), (3, 0), (3, usize::MAX)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (cloud, report) = pool.install(|| evaluated(&file, &scan, keep_points));
        assert_eq!(report, whole.report, "{threads} threads, {keep_points} kept");
        assert!(cloud == whole.cloud, "{threads} threads, {keep_points} kept");
    }
}

#[test]
fn points_written_in_pieces_give_the_bytes_of_the_whole_cloud() {
    let scan = SyntheticScan::new(N_FRAMES, 300);
    let cloud = scan_cloud(&frames(&scan), &scan.calibration, &ScanParams::default()).unwrap().cloud;
    for format in [CloudFormat::Ply, CloudFormat::Csv, CloudFormat::Pcd] {
        let mut whole = std::io::Cursor::new(Vec::new());
        write_cloud_to(&mut whole, format, &cloud).unwrap();
        let mut writer = CloudWriter::begin(Vec::new(), format, &cloud.comments, cloud.points.len()).unwrap();
        cloud.points.chunks(997).for_each(|points| writer.add(points).unwrap());
        assert!(writer.finish().unwrap() == whole.into_inner(), "{format:?}");
    }
}

#[test]
fn a_file_with_too_few_points_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud.ply");
    let short = write_cloud_in_pieces(&path, CloudFormat::Ply, &[], 2, |_| Ok::<(), FileError>(())).unwrap_err();
    assert!(matches!(short, FileError::Malformed { .. }), "{short}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_truncated_or_damaged_peaks_file_is_not_opened() {
    let scan = SyntheticScan::new(3, 50);
    let folder = tempfile::tempdir().unwrap();
    let file = written(&frames(&scan)[..3], folder.path());
    assert_eq!(file.frame(1).unwrap(), frames(&scan)[1]);
    let path = folder.path().join("peaks");
    let whole = std::fs::read(&path).unwrap();
    for keep in [0, 39, 41, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..keep]).unwrap();
        assert!(matches!(PeaksFile::open(&path), Err(FileError::Malformed { .. })), "cut at {keep}");
    }
    for at in (0..whole.len()).step_by(101) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x41;
        std::fs::write(&path, damaged).unwrap();
        assert!(PeaksFile::open(&path).is_err(), "byte {at}");
    }
}

#[test]
fn single_frames_are_found_without_reading_the_others() {
    let scan = SyntheticScan::new(4, 50);
    let folder = tempfile::tempdir().unwrap();
    let frames = &frames(&scan)[..4];
    written(frames, folder.path());
    let bytes = std::fs::read(folder.path().join("peaks")).unwrap();
    let positions: Vec<StagePosition> = frames.iter().map(|frame| frame.position).collect();
    assert_eq!(read_positions(Cursor::new(&bytes)).unwrap(), positions);
    let one = |frame| read_one_frame(Cursor::new(&bytes), frame).unwrap();
    assert_eq!(one(2).unwrap().0, frames[2]);
    assert_eq!(one(4).unwrap_err(), 4);
    // Damage in one frame matters only when that frame is read.
    let mut damaged = bytes.clone();
    damaged[150] ^= 0x41;
    assert!(read_one_frame(Cursor::new(&damaged), 0).is_err());
    assert_eq!(read_one_frame(Cursor::new(&damaged), 3).unwrap().unwrap().0, frames[3]);
}
