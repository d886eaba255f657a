//! `sheaf bench profiles`: time to label and triangulate a frame, compared with the extraction of its centrelines.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use nalgebra::{Vector2, Vector3};
use optics::{Hits, Triangulator};
use scanning::{Profile, label_frame};
use serde_json::json;
use statistics::median;
use vision::{CentrelineExtractor, CentrelineParams, Centrelines};

use crate::arguments::BenchProfilesArgs;
use crate::commands::Answer;
use crate::commands::bench::{MIN_TIMED_FRAMES, frames_of_one_size, median_ms, timed};
use pipeline::read_document;
use pipeline::{Failure, FailureKind};

/// Runs the benchmark on one thread.
pub fn profiles(args: &BenchProfilesArgs) -> Result<Answer, Failure> {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    let _alone = alone.map_err(|error| {
        Failure::new(FailureKind::Internal, "cannot limit the work to one thread").because(&error)
    })?;
    let frames = frames_of_one_size(&args.timed.frames)?;
    let triangulator = Triangulator::new(read_document(&args.calibration)?.calibration());
    let calibration = triangulator.calibration();
    let (camera, frame) = (&calibration.camera, &frames[0]);
    if (camera.width_px, camera.height_px) != (frame.width(), frame.height()) {
        return Err(Failure::bad_input("the frame size differs from that of the calibration")
            .in_file(&args.timed.frames[0])
            .remedy("give frames of the same camera without cropping"));
    }
    let params =
        CentrelineParams { line_direction: args.timed.line_direction.into(), ..CentrelineParams::default() };
    let n_passes = args.timed.passes.max(MIN_TIMED_FRAMES.div_ceil(frames.len()));
    let (mut extractor, mut found) = (CentrelineExtractor::default(), Centrelines::default());
    let lines_ms =
        median_ms(&timed(&frames, n_passes, |image| extractor.find(image, &params, black_box(&mut found))));
    let mut lines = vec![Centrelines::default(); frames.len()];
    for (image, lines) in frames.iter().zip(&mut lines) {
        extractor.find(image, &params, lines);
    }
    let mut profile = Profile::default();
    let label = |lines: &Centrelines| {
        black_box(&mut profile).fill(lines, &triangulator, calibration.depth_range_mm);
        profile.points.len()
    };
    let label_ms = median_ms(&timed(&lines, n_passes, label));
    let labelled = |lines: &Centrelines| label_frame(lines, &triangulator, calibration.depth_range_mm);
    let profiles: Vec<Profile> = lines.iter().map(labelled).collect();
    let n_points = profiles.iter().map(|profile| profile.points.len()).sum::<usize>();
    let (ns_per_point, largest_um) = triangulation(&profiles, &triangulator, n_passes);
    let ratio = (lines_ms + label_ms) / lines_ms;
    let mut text = String::new();
    let _ = writeln!(
        text,
        "image → centrelines {lines_ms:.3} ms, → profile {label_ms:.3} ms more: {ratio:.2} times, {} points per frame",
        n_points / frames.len()
    );
    let _ = writeln!(
        text,
        "undistortion and triangulation: {ns_per_point:.1} ns per point, within {largest_um:.4} µm of the exact solution"
    );
    let json = json!({
        "subject": "profiles", "centrelines_ms": lines_ms, "label_ms": label_ms, "ratio": ratio,
        "points_per_frame": n_points / frames.len(),
        "triangulation_ns_per_point": ns_per_point, "largest_difference_um": largest_um,
    });
    Ok(Answer::done(text, json))
}

/// Time per point in ns, and the largest distance between the intersections by tables and the exact ones, µm.
fn triangulation(profiles: &[Profile], triangulator: &Triangulator, n_passes: usize) -> (f64, f64) {
    let calibration = triangulator.calibration();
    let (mut hits, mut times, mut largest_mm) = (Hits::default(), Vec::new(), 0.0f64);
    for profile in profiles {
        for line in profile.points.chunk_by(|a, b| a.order == b.order) {
            let Some(idx) = calibration.orders.iter().position(|order| *order == line[0].order) else { continue };
            let (u_px, v_px): (Vec<f64>, Vec<f64>) =
                line.iter().map(|p| (p.centreline.u_px, p.centreline.v_px)).unzip();
            for _ in 0..n_passes {
                let begun = Instant::now();
                triangulator.triangulate_all(idx, black_box(&u_px), &v_px, black_box(&mut hits));
                times.push(begun.elapsed().as_secs_f64() * 1e9 / line.len() as f64);
            }
            for (at, point) in line.iter().enumerate() {
                let pixel = Vector2::new(point.centreline.u_px, point.centreline.v_px);
                let exact = calibration.triangulate(point.order, &pixel, None);
                let by_tables = Vector3::new(hits.x_mm[at], hits.y_mm[at], hits.z_mm[at]);
                let apart = exact.map_or(f64::INFINITY, |exact| (exact.hit_in_camera.xyz - by_tables).norm());
                largest_mm = largest_mm.max(apart);
            }
        }
    }
    (median(&mut times).unwrap_or(f64::NAN), 1e3 * largest_mm)
}
