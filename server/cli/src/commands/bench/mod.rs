//! `sheaf bench`: processing times per frame on this machine, compared with the time to read the frame from memory.

mod boards;
mod cloud;
mod profiles;
mod server;
mod stream;

use parking_lot::Mutex;
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use capture::read_grey_image;
use rayon::prelude::*;
use serde_json::json;
use statistics::median;
use vision::{CentrelineExtractor, CentrelineParams, Centrelines, GreyImage, Pixels, find_centrelines};

use crate::answer::output::{create_folder, file_names_after, write_file};
use crate::arguments::{BenchArgs, BenchCentrelinesArgs, BenchSubject};
use crate::commands::Answer;
use pipeline::Reporter;
use pipeline::{Failure, FailureKind};

/// Minimum number of timed frames, for a median accurate to a few percent.
pub const MIN_TIMED_FRAMES: usize = 21;

/// Runs a benchmark.
pub fn run(args: &BenchArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    match &args.subject {
        BenchSubject::Centrelines(args) => centrelines(args, reporter),
        BenchSubject::Profiles(args) => profiles::profiles(args),
        BenchSubject::Corners(args) => boards::corners(args),
        BenchSubject::Camera(args) => boards::camera(args),
        BenchSubject::Cloud(args) => cloud::cloud(args, reporter),
        BenchSubject::Server(args) => server::server(args, reporter),
        BenchSubject::Stream(args) => stream::stream(args, reporter),
    }
}

fn centrelines(args: &BenchCentrelinesArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let frames = frames_of_one_size(&args.timed.frames)?;
    let params =
        CentrelineParams { line_direction: args.timed.line_direction.into(), ..CentrelineParams::default() };
    let n_passes = args.timed.passes.max(MIN_TIMED_FRAMES.div_ceil(frames.len()));
    reporter.note(&format!("{} frames in memory, {n_passes} rotations", frames.len()));
    let finder = || {
        let (mut extractor, mut found) = (CentrelineExtractor::default(), Centrelines::default());
        let params = &params;
        move |image: &GreyImage| extractor.find(image, params, black_box(&mut found))
    };
    let read_ms = median_ms(&timed(&frames, n_passes, sum_of_levels));
    let median_ms = match args.threads {
        0 => {
            return Err(
                Failure::new(FailureKind::BadParameter, "--threads must be at least 1").remedy("give 1 or more")
            );
        }
        1 => median_ms(&timed(&frames, n_passes, finder())),
        n => median_ms(&timed_rotations(&frames, n_passes, n, finder)?),
    };
    let found: Vec<Centrelines> = frames.iter().map(|image| find_centrelines(image, &params)).collect();
    if let Some(folder) = &args.points {
        write_points(folder, args, &found)?;
    }
    let n_points = found.iter().flat_map(|lines| &lines.segments).map(|s| s.points.len()).sum::<usize>();
    let points_per_frame = n_points / frames.len();
    let (width, height) = (frames[0].width(), frames[0].height());
    let bandwidth_gb_s = size_bytes(&frames[0]) as f64 / read_ms / 1e6;
    let mut text = String::new();
    let _ = writeln!(
        text,
        "image → centrelines, {width}×{height}, {} thread(s): {median_ms:.3} ms per frame, {points_per_frame} points",
        args.threads
    );
    let _ = writeln!(
        text,
        "reading the same frames: {read_ms:.3} ms ({bandwidth_gb_s:.1} GB/s); ratio {:.1}",
        median_ms / read_ms
    );
    let json = json!({
        "subject": "centrelines", "width_px": width, "height_px": height, "threads": args.threads,
        "median_ms": median_ms, "read_ms": read_ms, "read_gb_s": bandwidth_gb_s,
        "points_per_frame": points_per_frame,
    });
    Ok(Answer::done(text, json))
}

/// The frames, all of the size of the first.
pub fn frames_of_one_size(paths: &[PathBuf]) -> Result<Vec<GreyImage>, Failure> {
    let mut frames: Vec<GreyImage> = Vec::with_capacity(paths.len());
    for path in paths {
        let frame = read_grey_image(path).map_err(|error| Failure::from(error).in_file(path))?;
        let same = |first: &GreyImage| (first.width(), first.height()) == (frame.width(), frame.height());
        if !frames.first().is_none_or(same) {
            return Err(Failure::bad_input("the frames differ in size")
                .in_file(path)
                .remedy("measure each size separately"));
        }
        frames.push(frame);
    }
    Ok(frames)
}

/// Time of every frame, in rotation, after one rotation to warm up.
pub fn timed<F, R>(frames: &[F], n_passes: usize, mut work: impl FnMut(&F) -> R) -> Vec<Duration> {
    frames.iter().for_each(|frame| drop(black_box(work(frame))));
    let rotation = (0..n_passes).flat_map(|_| frames);
    rotation
        .map(|frame| {
            let begun = Instant::now();
            let result = black_box(work(black_box(frame)));
            let took = begun.elapsed();
            drop(result);
            took
        })
        .collect()
}

/// Repetitions when threads share the frames.
const REPETITIONS: usize = 5;
/// Minimum number of frames per repetition: in the first milliseconds, systems keep several threads on one processor.
const MIN_SHARED_FRAMES: usize = 1000;

/// Times per frame of several repetitions, each of at least `n_passes` rotations shared by `n_threads` with a worker each.
/// Single rotations would include the time to wake sleeping threads.
fn timed_rotations<W: FnMut(&GreyImage) + Send>(
    frames: &[GreyImage],
    n_passes: usize,
    n_threads: usize,
    worker: impl Fn() -> W,
) -> Result<Vec<Duration>, Failure> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .map_err(|error| Failure::new(FailureKind::Internal, "cannot start the threads").because(&error))?;
    let n_frames = (n_passes * frames.len()).max(MIN_SHARED_FRAMES);
    let workers: Vec<Mutex<W>> = (0..n_threads).map(|_| Mutex::new(worker())).collect();
    let rotations = || {
        (0..n_frames).into_par_iter().with_max_len(1).for_each(|idx| {
            let mine = &workers[rayon::current_thread_index().unwrap_or(0)];
            mine.lock()(black_box(&frames[idx % frames.len()]));
        });
    };
    pool.install(rotations);
    Ok((0..REPETITIONS)
        .map(|_| {
            let begun = Instant::now();
            pool.install(rotations);
            begun.elapsed().div_f64(n_frames as f64)
        })
        .collect())
}

/// Median in milliseconds.
pub fn median_ms(times: &[Duration]) -> f64 {
    let mut times_ms: Vec<f64> = times.iter().map(|time| time.as_secs_f64() * 1e3).collect();
    median(&mut times_ms).unwrap_or(f64::NAN)
}

/// Reads every byte of a frame, eight at a time.
fn sum_of_levels(frame: &GreyImage) -> u64 {
    match frame.pixels() {
        Pixels::Eight(levels) => {
            let words = levels
                .chunks_exact(8)
                .map(|w| u64::from_ne_bytes([w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7]]));
            words.fold(0, u64::wrapping_add)
        }
        Pixels::Sixteen(levels) => levels.iter().map(|&level| u64::from(level)).sum(),
    }
}

fn size_bytes(frame: &GreyImage) -> usize {
    frame.width() * frame.height() * (frame.bit_depth() / 8) as usize
}

fn write_points(folder: &Path, args: &BenchCentrelinesArgs, found: &[Centrelines]) -> Result<(), Failure> {
    create_folder(folder)?;
    for (name, lines) in file_names_after(&args.timed.frames, "csv").iter().zip(found) {
        let mut csv = "u_px,v_px\n".to_owned();
        for point in lines.segments.iter().flat_map(|segment| &segment.points) {
            let _ = writeln!(csv, "{:.5},{:.5}", point.u_px, point.v_px);
        }
        write_file(&folder.join(name), csv.as_bytes())?;
    }
    Ok(())
}
