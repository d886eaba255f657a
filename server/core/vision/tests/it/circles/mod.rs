//! Centres of circle grids: within a few thousandths of a pixel of the truth, and compared with OpenCV's
//! `findCirclesGrid`.

mod rendered;

use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use rendered::{HEIGHT, View, WIDTH};
use vision::{BoardCorners, CircleParams, CornerError, GreyImage, Pixels, find_circles};

const SYMMETRIC: CircleParams = CircleParams { columns: 8, rows: 6, staggered: false };
const STAGGERED: CircleParams = CircleParams { columns: 4, rows: 11, staggered: true };

/// RMS per axis (px), the same relative to σ, and the mean shift (px).
fn errors(board: &BoardCorners, view: &View) -> (f64, f64) {
    let (mut square, mut sigmas) = (0.0, 0.0);
    for corner in &board.corners {
        let [u, v] = view.truth(corner.column, corner.row);
        for error in [corner.u_px - u, corner.v_px - v] {
            square += error * error;
            sigmas += (error / corner.sigma_px).powi(2);
        }
    }
    let n = 2.0 * board.corners.len() as f64;
    ((square / n).sqrt(), (sigmas / n).sqrt())
}

/// Asserts that the grids of random views are found within `limit_px` RMS and with a realistic σ.
fn assert_found(name: &str, views: &[View], limit_px: f64) {
    let (mut square, mut sigmas) = (0.0, 0.0);
    for view in views {
        let board = find_circles(&view.image(), &view.params).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(board.corners.len(), view.params.columns * view.params.rows);
        let (rms_px, normalised) = errors(&board, view);
        square += rms_px * rms_px / views.len() as f64;
        sigmas += normalised * normalised / views.len() as f64;
    }
    eprintln!("{name}: {:.4} px, {:.2} sigma", square.sqrt(), sigmas.sqrt());
    assert!(square.sqrt() < limit_px, "{name}: {} px RMS", square.sqrt());
    assert!((0.8..1.25).contains(&sigmas.sqrt()), "{name}: error/sigma {}", sigmas.sqrt());
}

fn views(params: &CircleParams, radius: f64, tilt_rad: f64, n: u64) -> Vec<View> {
    (0..n).map(|seed| View::random(params, radius, tilt_rad, seed)).collect()
}

#[test]
fn centres_are_found_within_their_sigma_at_any_tilt() {
    // Four times the noise limit of the smaller discs.
    for (params, radius, limit_px) in [(&SYMMETRIC, 0.3, 0.012), (&STAGGERED, 0.45, 0.012)] {
        for tilt_rad in [0.2, 0.6] {
            let name = format!("staggered {}, tilt {tilt_rad}", params.staggered);
            assert_found(&name, &views(params, radius, tilt_rad, 3), limit_px);
        }
    }
}

#[test]
fn large_discs_close_by_are_corrected_for_perspective_and_distortion() {
    // Without the correction the error is 0.1 px or more.
    let params = CircleParams { columns: 6, rows: 5, staggered: false };
    let mut views = views(&params, 0.42, 0.6, 4);
    for view in &mut views {
        view.noise_levels = 0.5;
    }
    assert_found("large", &views, 0.006);
}

#[test]
fn sigma_includes_blur_and_noise() {
    for (blur_px, noise_levels, limit_px) in [(0.4, 1.0, 0.006), (2.0, 4.0, 0.05)] {
        let mut views = views(&SYMMETRIC, 0.3, 0.4, 3);
        for view in &mut views {
            (view.blur_px, view.noise_levels) = (blur_px, noise_levels);
        }
        assert_found(&format!("blur {blur_px}, noise {noise_levels}"), &views, limit_px);
    }
}

fn changed(image: &GreyImage, change: impl Fn(usize, &[u8]) -> u8) -> GreyImage {
    let Pixels::Eight(levels) = image.pixels() else { panic!("8-bit test images only") };
    let bytes = (0..levels.len()).map(|k| change(k, levels)).collect();
    GreyImage::new(WIDTH, HEIGHT, Pixels::Eight(bytes)).unwrap()
}

#[test]
fn a_staggered_grid_of_odd_rows_upside_down_gives_the_same_physical_discs() {
    let view = View::random(&STAGGERED, 0.45, 0.3, 1);
    let image = view.image();
    let upright = find_circles(&image, &STAGGERED).unwrap();
    let turned = find_circles(&changed(&image, |k, levels| levels[levels.len() - 1 - k]), &STAGGERED).unwrap();
    for (a, b) in upright.corners.iter().zip(&turned.corners) {
        let expected = [WIDTH as f64 - 1.0 - a.u_px, HEIGHT as f64 - 1.0 - a.v_px];
        assert!((b.u_px - expected[0]).hypot(b.v_px - expected[1]) < 0.01, "{b:?} not at {expected:?}");
    }
}

#[test]
fn bright_discs_on_dark_are_found() {
    let view = View::random(&SYMMETRIC, 0.3, 0.3, 2);
    let board = find_circles(&changed(&view.image(), |k, levels| 255 - levels[k]), &SYMMETRIC).unwrap();
    assert!(errors(&board, &view).0 < 0.012);
}

#[test]
fn a_covered_disc_and_an_empty_image_are_refused_with_the_number_found() {
    let view = View::random(&SYMMETRIC, 0.3, 0.2, 3);
    let [u, v] = view.truth(3, 2).map(|x| x as usize);
    let covered = changed(&view.image(), |k, levels| {
        if (k % WIDTH).abs_diff(u) < 12 && (k / WIDTH).abs_diff(v) < 12 { 200 } else { levels[k] }
    });
    let refused = find_circles(&covered, &SYMMETRIC);
    assert_eq!(refused, Err(CornerError::NoCircles { columns: 8, rows: 6, found: 47 }));
    let empty = changed(&covered, |k, _| 128 + (k % 3) as u8);
    assert_eq!(find_circles(&empty, &SYMMETRIC), Err(CornerError::NoCircles { columns: 8, rows: 6, found: 0 }));
}

/// Centres found by OpenCV: one line per image, empty where it finds no grid.
const OPENCV: &str = "
import sys, cv2
flags = cv2.CALIB_CB_ASYMMETRIC_GRID if sys.argv[3] == 'true' else cv2.CALIB_CB_SYMMETRIC_GRID
for name in sys.argv[4:]:
    found, centres = cv2.findCirclesGrid(cv2.imread(name, 0), (int(sys.argv[1]), int(sys.argv[2])), flags=flags)
    print(' '.join(f'{x:.5f}' for x in centres.ravel()) if found else '')
";

fn opencv(python: &Path, params: &CircleParams, images: &[GreyImage]) -> Vec<Vec<[f64; 2]>> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("circles-{}", params.staggered));
    std::fs::create_dir_all(&folder).unwrap();
    let mut command = Command::new(python);
    command.args(["-c", OPENCV, &params.columns.to_string(), &params.rows.to_string()]);
    command.arg(params.staggered.to_string());
    for (k, image) in images.iter().enumerate() {
        // Portable grey maps can be written without a library.
        let file = folder.join(format!("{k}.pgm"));
        let Pixels::Eight(levels) = image.pixels() else { panic!("8-bit test images only") };
        let mut bytes = Vec::new();
        writeln!(bytes, "P5 {WIDTH} {HEIGHT} 255").unwrap();
        bytes.extend(levels);
        std::fs::write(&file, bytes).unwrap();
        command.arg(file);
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let numbers = |line: &str| line.split_whitespace().map(|x| x.parse().unwrap()).collect::<Vec<f64>>();
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| numbers(line).chunks_exact(2).map(|c| [c[0], c[1]]).collect()).collect()
}

#[test]
fn at_least_as_many_grids_as_opencv_are_found_with_more_accurate_centres() {
    let Some(python) = reference::python() else { return };
    for (params, radius) in [(&SYMMETRIC, 0.3), (&STAGGERED, 0.45)] {
        let views = views(params, radius, 0.7, 5);
        let images: Vec<GreyImage> = views.iter().map(View::image).collect();
        let theirs = opencv(&python, params, &images);
        let (mut n_ours, mut n_theirs, mut ours, mut opencv, mut n_both) = (0, 0, 0.0, 0.0, 0.0);
        for ((view, image), theirs) in views.iter().zip(&images).zip(&theirs) {
            let board = find_circles(image, params);
            n_ours += usize::from(board.is_ok());
            n_theirs += usize::from(!theirs.is_empty());
            let (Ok(board), false) = (board, theirs.is_empty()) else { continue };
            n_both += 1.0;
            ours += errors(&board, view).0.powi(2);
            // Independent of OpenCV's order of the centres: each is compared with the nearest true centre.
            let truths: Vec<[f64; 2]> = board.corners.iter().map(|c| view.truth(c.column, c.row)).collect();
            let square = |at: &[f64; 2]| {
                let distances = truths.iter().map(|t| (t[0] - at[0]).powi(2) + (t[1] - at[1]).powi(2));
                distances.fold(f64::INFINITY, f64::min)
            };
            opencv += theirs.iter().map(square).sum::<f64>() / (2 * theirs.len()) as f64;
        }
        let (ours_px, opencv_px) = (f64::sqrt(ours / n_both), f64::sqrt(opencv / n_both));
        eprintln!(
            "staggered {}: {n_ours} at {ours_px:.4} px, OpenCV {n_theirs} at {opencv_px:.4} px",
            params.staggered
        );
        assert!(n_ours >= n_theirs, "{n_ours} grids, OpenCV {n_theirs}");
        assert!(ours_px < 0.5 * opencv_px, "{ours_px} px, OpenCV {opencv_px} px");
    }
}
