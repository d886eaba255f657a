//! Cameras from real photographs, compared with OpenCV's results for the same ones.

use std::path::PathBuf;

use calibration::{
    BoardGeometry, BoardPattern, CalibrationInput, CalibrationOptions, NominalProjector, PoseInput, calibrate,
};
use nalgebra::Vector2;
use rayon::prelude::*;
use vision::{CornerParams, find_corners};

/// The photographs of a set, in order of name, or `None` where they are absent.
fn photographs(folder: &str, prefix: &str) -> Option<Vec<PathBuf>> {
    let folder = reference::data(&format!("real/{folder}"))?;
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(prefix))
        .filter(|path| path.extension().is_some_and(|e| e == "jpg"))
        .collect();
    paths.sort();
    Some(paths)
}

fn camera_rms_px(paths: &[PathBuf], board: BoardGeometry, estimate_k3: Option<bool>) -> f64 {
    let params = CornerParams { inner_columns: board.inner_columns, inner_rows: board.inner_rows };
    let images: Vec<_> = paths.par_iter().map(|path| capture::read_grey_image(path).unwrap()).collect();
    let poses: Vec<PoseInput> = images
        .par_iter()
        .zip(paths)
        .map(|(image, path)| PoseInput {
            name: path.display().to_string(),
            corners: find_corners(image, &params).unwrap(),
            centrelines: None,
            single_line_images: Vec::new(),
        })
        .collect();
    let input = CalibrationInput {
        width_px: images[0].width(),
        height_px: images[0].height(),
        board,
        projector: NominalProjector { grating: None, orders: vec![0] },
        poses,
        stage_views: Vec::new(),
        angle_sigma_deg: None,
    };
    let options = CalibrationOptions { estimate_k3, ..CalibrationOptions::default() };
    let result = calibrate(&input, &options, &mut |_, _| calibration::ProgressControl::Continue).unwrap();
    println!("{:?} {}", result.calibration.camera, result.report.camera.k3_reason);
    result.report.camera.rms_px
}

#[test]
fn opencvs_left_camera_fits_as_well_as_with_opencv() {
    let Some(paths) = photographs("opencv-board", "left") else { return };
    assert_eq!(paths.len(), 13);
    let board = BoardGeometry {
        inner_columns: 9,
        inner_rows: 6,
        square_mm: Vector2::repeat(25.0),
        pattern: BoardPattern::Squares,
    };
    // OpenCV with cornerSubPix: 0.178 px with k3 = 0.
    let rms_px = camera_rms_px(&paths, board, Some(false));
    println!("{rms_px}");
    assert!(rms_px <= 0.180, "{rms_px}");
}

#[test]
fn the_ciclop_camera_fits_as_well_as_published() {
    let Some(paths) = photographs("ciclop/camera", "frame") else { return };
    assert_eq!(paths.len(), 16);
    let board = BoardGeometry {
        inner_columns: 11,
        inner_rows: 6,
        square_mm: Vector2::repeat(13.0),
        pattern: BoardPattern::Squares,
    };
    // Published, and OpenCV's: 0.2415 px with five distortion parameters.
    let rms_px = camera_rms_px(&paths, board, None);
    println!("{rms_px}");
    assert!(rms_px <= 0.2420, "{rms_px}");
}
