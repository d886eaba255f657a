//! `sheaf bench cloud`: time and memory of a large scan, from peaks on disk to a cloud on disk.

mod memory;

use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use scanning::files::peaks::{PeaksFile, PeaksHeader, PeaksWriter};
use scanning::files::{CloudWriter, ContentError, write_cloud, write_cloud_in_pieces};
use scanning::synthetic::{SIZE_PX, SyntheticScan};
use scanning::{Cloud, CloudFormat, CloudPoint, ScanParams, evaluate_scan};
use serde_json::json;
use vision::LineDirection;

use crate::arguments::BenchCloudArgs;
use crate::commands::Answer;
use pipeline::Reporter;
use pipeline::{Failure, FailureKind};

/// Number of points for timing the writing: 450 MB of PLY, more than caches hold.
const WRITTEN_POINTS: usize = 10_000_000;
/// Bytes per write in the measurement of the disk alone.
const CHUNK_BYTES: usize = 1 << 20;
const MB: f64 = 1e6;

/// Runs the benchmark.
pub fn cloud(args: &BenchCloudArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    if args.frames == 0 || args.points == 0 {
        return Err(Failure::new(FailureKind::BadParameter, "--frames and --points must be at least 1")
            .remedy("give 1 or more"));
    }
    let folder = tempfile::tempdir_in(&args.folder).map_err(|cause| Failure::unwritable(&args.folder, &cause))?;
    let scan = SyntheticScan::new(args.frames, args.points);
    reporter.note(&format!("{} frames of {} points", args.frames, scan.points_per_frame()));
    let computed = computed(&scan, folder.path())?;
    let written = written(computed.n_points.clamp(1, WRITTEN_POINTS), folder.path())?;
    let bytes_per_point = computed.peak_bytes.map(|bytes| bytes as f64 / computed.n_points.max(1) as f64);
    let mut text = format!(
        "peaks on disk → cloud on disk, {} frames, {} points: {:.2} s",
        args.frames, computed.n_points, computed.seconds
    );
    match bytes_per_point {
        Some(bytes) => drop(writeln!(text, ", {bytes:.1} bytes of memory per point at peak")),
        None => text.push_str("; this system does not report the memory\n"),
    }
    let _ = writeln!(
        text,
        "PLY of {} points: {:.0} MB/s written and synced, {:.0} MB/s encoded only; the disk alone: {:.0} MB/s",
        written.n_points, written.ply_mb_s, written.encoded_mb_s, written.disk_mb_s
    );
    let json = json!({
        "subject": "cloud", "n_frames": args.frames, "n_points": computed.n_points,
        "threads": rayon::current_num_threads(), "seconds": computed.seconds,
        "peak_bytes": computed.peak_bytes, "peak_bytes_per_point": bytes_per_point,
        "ply_mb_s": written.ply_mb_s, "encoded_mb_s": written.encoded_mb_s, "disk_mb_s": written.disk_mb_s,
    });
    Ok(Answer::done(text, json))
}

struct Computed {
    n_points: usize,
    seconds: f64,
    /// Peak resident memory above that at the start; `None` where the system does not report it.
    peak_bytes: Option<u64>,
}

/// Computes the cloud as the service does: frames stay in their file, points are written as they are computed.
fn computed(scan: &SyntheticScan, folder: &Path) -> Result<Computed, Failure> {
    let path = folder.join("peaks");
    let header = PeaksHeader {
        width_px: SIZE_PX[0] as u32,
        height_px: SIZE_PX[1] as u32,
        line_direction: LineDirection::Rows,
        stage: optics::StageKind::Linear,
    };
    let mut peaks = PeaksWriter::create(&path, &header)?;
    let refused = |error: scanning::ContentError| Failure::unwritable(&path, &error);
    for idx in 0..scan.n_frames {
        peaks.add(&scan.frame(idx), None).map_err(refused)?;
    }
    peaks.finish().map_err(refused)?;
    memory::reset_peak();
    let before = memory::resident_bytes();
    let begun = Instant::now();
    let frames = PeaksFile::open(&path)?;
    let evaluation = evaluate_scan(&frames, &scan.calibration, &ScanParams::default())?;
    let n_points = evaluation.report.n_points;
    write_cloud_in_pieces(&folder.join("cloud.ply"), CloudFormat::Ply, &evaluation.comments, n_points, |add| {
        evaluation.for_each_frame(|points| -> Result<(), Failure> { add(points) })
    })?;
    let seconds = begun.elapsed().as_secs_f64();
    let peak_bytes = memory::peak_bytes().zip(before).map(|(peak, before)| peak.saturating_sub(before));
    Ok(Computed { n_points, seconds, peak_bytes })
}

struct Written {
    n_points: usize,
    ply_mb_s: f64,
    encoded_mb_s: f64,
    disk_mb_s: f64,
}

/// Writes a cloud from memory, and the same number of plain bytes.
fn written(n_points: usize, folder: &Path) -> Result<Written, Failure> {
    let points = (0..n_points).map(|idx| CloudPoint {
        x_mm: idx as f64,
        y_mm: 0.1,
        z_mm: 400.0,
        order: 0,
        frame: (idx / 5000) as u32,
        u_px: (idx % 5000) as f32,
        v_px: 512.0,
        intensity: 120.0,
        sigma_mm: 0.01,
    });
    let cloud = Cloud { points: points.collect(), comments: Vec::new() };
    let path = folder.join("written.ply");
    let ply_s = seconds(|| write_cloud(&path, CloudFormat::Ply, &cloud))?;
    let failed = |cause: &dyn std::error::Error| Failure::unwritable(&path, cause);
    let encoded_s = seconds(|| encode(&cloud)).map_err(|e| failed(&e))?;
    drop(cloud);
    let size_bytes = std::fs::metadata(&path).map_err(|cause| failed(&cause))?.len();
    let disk_s = seconds(|| fill(&folder.join("filled"), size_bytes)).map_err(|cause| failed(&cause))?;
    let mb = size_bytes as f64 / MB;
    Ok(Written { n_points, ply_mb_s: mb / ply_s, encoded_mb_s: mb / encoded_s, disk_mb_s: mb / disk_s })
}

/// Encodes a cloud and discards the bytes.
fn encode(cloud: &Cloud) -> Result<(), ContentError> {
    let mut writer = CloudWriter::begin(std::io::sink(), CloudFormat::Ply, &cloud.comments, cloud.points.len())?;
    writer.add(&cloud.points)?;
    writer.finish().map(drop)
}

fn seconds<E>(work: impl FnOnce() -> Result<(), E>) -> Result<f64, E> {
    let begun = Instant::now();
    work()?;
    Ok(begun.elapsed().as_secs_f64())
}

fn fill(path: &Path, size_bytes: u64) -> std::io::Result<()> {
    let chunk = vec![0x5a; CHUNK_BYTES];
    let mut file = File::create(path)?;
    let mut left = size_bytes;
    while left > 0 {
        let n_bytes = left.min(CHUNK_BYTES as u64);
        file.write_all(&chunk[..n_bytes as usize])?;
        left -= n_bytes;
    }
    file.sync_all()
}
