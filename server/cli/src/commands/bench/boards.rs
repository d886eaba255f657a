//! `sheaf bench corners` and `sheaf bench camera`: times of corner detection and camera calibration on one thread.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use calibration::camera_fit::{fit_camera, fit_camera_plain};
use calibration::observation::{CornerObservation, CornerView};
use capture::read_grey_image;
use nalgebra::{Vector2, Vector3};
use optics::Camera;
use serde_json::{Value, json};
use vision::{BoardCorners, CornerParams, GreyImage, find_corners};

use crate::arguments::BenchBoardsArgs;
use crate::commands::Answer;
use crate::commands::bench::median_ms;
use pipeline::{Failure, FailureKind};

/// Times corner detection per image.
pub fn corners(args: &BenchBoardsArgs) -> Result<Answer, Failure> {
    let images = images(args)?;
    let params = params(args);
    on_one_thread(|| {
        let boards = boards(args, &images)?;
        let rotation = (0..args.passes.max(1)).flat_map(|_| &images);
        let times: Vec<Duration> =
            rotation.map(|image| timed(|| find_corners(black_box(image), &params))).collect();
        let median_ms = median_ms(&times);
        let n_corners: usize = boards.iter().map(|board| board.corners.len()).sum();
        let (width, height) = (images[0].width(), images[0].height());
        let text = format!(
            "image → corners, {width}×{height}, 1 thread: {median_ms:.3} ms per board, {n_corners} corners on {} boards\n",
            boards.len()
        );
        let json = json!({
            "subject": "corners", "width_px": width, "height_px": height, "threads": 1, "median_ms": median_ms,
            "n_boards": boards.len(), "n_corners": n_corners,
        });
        Ok(Answer::done(text, json))
    })
}

/// Times the camera fits on the corners of all images; the square size is 1 mm, on which the camera does not depend.
pub fn camera(args: &BenchBoardsArgs) -> Result<Answer, Failure> {
    let images = images(args)?;
    on_one_thread(|| {
        let views = views(&boards(args, &images)?);
        let (width, height) = (images[0].width(), images[0].height());
        let refused = |error: &dyn std::fmt::Display| Failure::bad_input(format!("no camera: {error}"));
        let plain = fit_camera_plain(width, height, views.clone()).map_err(|error| refused(&error))?;
        let robust = fit_camera(width, height, views.clone(), None).map_err(|error| refused(&error))?;
        let passes = 0..args.passes.max(1);
        let plain_ms = median_of(passes.clone(), || fit_camera_plain(width, height, black_box(views.clone())));
        let robust_ms = median_of(passes, || fit_camera(width, height, black_box(views.clone()), None));
        let mut text = String::new();
        let n_views = views.len();
        let (plain_rms_px, robust_rms_px) = (plain.rms_px, robust.rms_px);
        let _ = writeln!(
            text,
            "corners of {n_views} boards → camera by plain least squares, 1 thread: {plain_ms:.3} ms, {plain_rms_px:.9} px RMS"
        );
        let _ = writeln!(text, "the same as in `sheaf calibrate`: {robust_ms:.3} ms, {robust_rms_px:.9} px RMS");
        let json = json!({
            "subject": "camera", "n_views": n_views, "threads": 1,
            "plain": { "median_ms": plain_ms, "rms_px": plain_rms_px, "camera": camera_json(&plain.station.camera) },
            "robust": { "median_ms": robust_ms, "rms_px": robust_rms_px, "camera": camera_json(&robust.station.camera) },
        });
        Ok(Answer::done(text, json))
    })
}

/// Matrix and coefficients in OpenCV's order.
fn camera_json(camera: &Camera) -> Value {
    json!({ "matrix": camera.opencv_matrix(), "distortion": camera.opencv_distortion() })
}

fn images(args: &BenchBoardsArgs) -> Result<Vec<GreyImage>, Failure> {
    let read = |path| read_grey_image(path).map_err(|error| Failure::from(error).in_file(path));
    args.images.iter().map(|path| read(path)).collect()
}

fn params(args: &BenchBoardsArgs) -> CornerParams {
    CornerParams { inner_columns: args.columns, inner_rows: args.rows }
}

fn boards(args: &BenchBoardsArgs, images: &[GreyImage]) -> Result<Vec<BoardCorners>, Failure> {
    let find = |(path, image): (&PathBuf, &GreyImage)| {
        find_corners(image, &params(args)).map_err(|error| Failure::bad_input(error.to_string()).in_file(path))
    };
    args.images.iter().zip(images).map(find).collect()
}

fn views(boards: &[BoardCorners]) -> Vec<CornerView> {
    let observation = |corner: &vision::Corner| CornerObservation {
        board_mm: Vector3::new(corner.column as f64, corner.row as f64, 0.0),
        pixel: Vector2::new(corner.u_px, corner.v_px),
        sigma_px: corner.sigma_px,
    };
    let view = |(block, board): (usize, &BoardCorners)| CornerView {
        block,
        travel_mm: 0.0,
        corners: board.corners.iter().map(observation).collect(),
    };
    boards.iter().enumerate().map(view).collect()
}

fn timed<R>(work: impl FnOnce() -> R) -> Duration {
    let begun = Instant::now();
    let result = black_box(work());
    let took = begun.elapsed();
    drop(result);
    took
}

fn median_of<R>(passes: std::ops::Range<usize>, work: impl Fn() -> R) -> f64 {
    median_ms(&passes.map(|_| timed(&work)).collect::<Vec<Duration>>())
}

fn on_one_thread<R: Send>(work: impl FnOnce() -> Result<R, Failure> + Send) -> Result<R, Failure> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(|error| Failure::new(FailureKind::Internal, "cannot start the thread").because(&error))?;
    pool.install(work)
}
