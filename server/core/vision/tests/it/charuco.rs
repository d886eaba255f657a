//! ChArUco boards drawn through a homography, with blur and noise: which corners are found, how accurately, and whether
//! σ is realistic.
//!
//! Not covered: lens distortion and print; the drawing has straight edges.

use nalgebra::{Matrix3, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use vision::{CharucoParams, CornerError, GreyImage, Pixels, find_charuco};

const WIDTH_PX: usize = 960;
const HEIGHT_PX: usize = 720;
/// Grey levels of black and white, and the noise's σ.
const LEVELS: [f64; 2] = [40.0, 190.0];
const NOISE_LEVELS: f64 = 2.0;
/// Sample positions of a pixel along each axis, in σ of the blur: the middles of eight equal parts of a Gaussian. Edges
/// along the pixel grid would show the steps between them, so boards are rotated.
const SAMPLES: [f64; 8] = [-1.534, -0.887, -0.489, -0.157, 0.157, 0.489, 0.887, 1.534];
/// Blur, σ in px.
const BLUR_PX: f64 = 0.8;
/// RMS error per axis: 2 % noise in windows of a tenth of a square.
const ERROR_PX: f64 = 0.012;

fn board() -> CharucoParams {
    CharucoParams { columns: 10, rows: 7, marker_ratio: 0.7, dictionary: "DICT_5X5_100".to_owned() }
}

/// Which square is at the top left.
#[derive(Clone, Copy, PartialEq)]
enum First {
    /// As OpenCV prints it.
    Black,
    /// As OpenCV before 4.6 printed boards with an even number of rows.
    White,
}

/// Whether the board is black at (x, y) in squares from its top left; white outside.
fn is_black(params: &CharucoParams, first: First, markers: &[Vec<Vec<bool>>], x: f64, y: f64) -> bool {
    let (column, row) = (x.floor(), y.floor());
    let inside = column >= 0.0 && row >= 0.0 && column < params.columns as f64 && row < params.rows as f64;
    if !inside {
        return false;
    }
    let (column, row) = (column as usize, row as usize);
    let is_white = |column: usize, row: usize| (column + row).is_multiple_of(2) == (first == First::White);
    if !is_white(column, row) {
        return true;
    }
    let white_before =
        (0..row * params.columns + column).filter(|at| is_white(at % params.columns, at / params.columns)).count();
    let cells = &markers[white_before];
    let rim = 0.5 * (1.0 - params.marker_ratio);
    let cell = |at: f64| ((at.fract() - rim) / params.marker_ratio * cells.len() as f64).floor();
    let (cx, cy) = (cell(x), cell(y));
    let on_marker = |at: f64| at >= 0.0 && at < cells.len() as f64;
    on_marker(cx) && on_marker(cy) && cells[cy as usize][cx as usize]
}

/// The board as imaged through `pixel_from_board` (squares to pixels).
fn drawn(params: &CharucoParams, first: First, pixel_from_board: &Matrix3<f64>, seed: u64) -> GreyImage {
    let markers: Vec<_> =
        (0..params.columns * params.rows / 2).map(|id| params.marker_cells(id).unwrap()).collect();
    let board_from_pixel = pixel_from_board.try_inverse().unwrap();
    let mut random = Pcg64::seed_from_u64(seed);
    let mut pixels = Vec::with_capacity(WIDTH_PX * HEIGHT_PX);
    for v in 0..HEIGHT_PX {
        for u in 0..WIDTH_PX {
            let mut white = 0.0;
            for across in SAMPLES {
                for down in SAMPLES {
                    let place = [u as f64 + BLUR_PX * across, v as f64 + BLUR_PX * down];
                    let board = board_from_pixel * Vector3::new(place[0], place[1], 1.0);
                    white += f64::from(!is_black(params, first, &markers, board.x / board.z, board.y / board.z));
                }
            }
            let level = LEVELS[0] + (LEVELS[1] - LEVELS[0]) * white / (SAMPLES.len() * SAMPLES.len()) as f64;
            let noise: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            pixels.push((level + NOISE_LEVELS * noise).round().clamp(0.0, 255.0) as u8);
        }
    }
    GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Eight(pixels)).unwrap()
}

/// Squares of 66 px, rotated by `turn_rad` and slightly tilted, with corner (0, 0) of the board at (`u_px`, `v_px`).
fn view(turn_rad: f64, u_px: f64, v_px: f64) -> Matrix3<f64> {
    let (sin, cos) = turn_rad.sin_cos();
    Matrix3::new(66.0 * cos, -66.0 * sin, u_px, 66.0 * sin, 66.0 * cos, v_px, 0.004, -0.006, 1.0)
}

/// Finds the corners and compares them with the drawing; returns how many there are.
fn check(name: &str, params: &CharucoParams, first: First, pixel_from_board: &Matrix3<f64>) -> usize {
    let found = find_charuco(&drawn(params, first, pixel_from_board, 3), params).unwrap();
    let (mut squares, mut normalised) = (0.0, 0.0);
    for corner in &found.corners {
        let at = pixel_from_board * Vector3::new(corner.column as f64 + 1.0, corner.row as f64 + 1.0, 1.0);
        let error = [corner.u_px - at.x / at.z, corner.v_px - at.y / at.z];
        let square = error[0] * error[0] + error[1] * error[1];
        assert!(square < 0.01, "{name}: corner {}, {} is off by {error:?}", corner.column, corner.row);
        squares += square;
        normalised += square / corner.sigma_px.powi(2);
    }
    let n = 2.0 * found.corners.len() as f64;
    let (rms_px, normalised) = ((squares / n).sqrt(), (normalised / n).sqrt());
    println!("{name}: {} corners, RMS {rms_px:.4} px, over σ {normalised:.2}", found.corners.len());
    assert!(rms_px < ERROR_PX, "{name}: {rms_px}");
    assert!((0.4..1.6).contains(&normalised), "{name}: {normalised}");
    found.corners.len()
}

#[test]
fn a_whole_board_gives_all_its_corners() {
    assert_eq!(check("whole", &board(), First::Black, &view(0.2, 200.0, 60.0)), 54);
}

#[test]
fn a_board_partly_outside_the_image_gives_its_visible_corners() {
    let n = check("partial", &board(), First::Black, &view(0.2, 620.0, 200.0));
    assert!((20..50).contains(&n), "{n}");
}

/// Even numbers of rows, with both parities of the columns; whole, and partly outside the image.
#[test]
fn boards_of_both_patterns_are_found_without_being_told_which() {
    for columns in [9, 10] {
        let params = CharucoParams { columns, rows: 6, ..board() };
        for first in [First::Black, First::White] {
            assert_eq!(check("whole", &params, first, &view(0.2, 200.0, 60.0)), 5 * (columns - 1));
            // Its last column is in view: without that, boards with an odd number of columns would be ambiguous.
            let n = check("partial", &params, first, &view(0.2, -40.0, 60.0));
            assert!((12..5 * (columns - 1)).contains(&n), "{n}");
        }
    }
}

#[test]
fn an_image_without_markers_has_no_board() {
    let params = board();
    let plain = GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Eight(vec![128; WIDTH_PX * HEIGHT_PX])).unwrap();
    assert_eq!(find_charuco(&plain, &params), Err(CornerError::NotFound { inner_columns: 9, inner_rows: 6 }));
}
