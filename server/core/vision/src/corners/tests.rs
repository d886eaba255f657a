//! Boards with known corners: rendered here, and the rendered and photographed ones in the data folder.
//!
//! The renderer below is independent of the fitted model: it averages sharp squares numerically over the pixel and a
//! Gaussian. Not covered: lenses with skewed blur, and boards that are not flat.

use std::path::PathBuf;

use super::*;
use crate::Pixels;

/// A tilted board in front of a camera, with the camera's blur and noise.
#[derive(Clone, Copy)]
struct Scene {
    width: usize,
    height: usize,
    columns: usize,
    rows: usize,
    /// Board index (column, row) to ideal pixel, up to scale.
    homography: [[f64; 3]; 3],
    /// Relative radial shift at a distance of half the image's width.
    distortion: f64,
    blur_px: f64,
    noise_levels: f64,
    seed: u64,
}

/// 7 × 4 corners, squares of about 45 px, tilted; edges at least 4° off the pixel grid.
const SCENE: Scene = Scene {
    width: 480,
    height: 360,
    columns: 7,
    rows: 4,
    homography: [[47.0, 4.0, 82.0], [-3.5, 49.0, 118.0], [2e-3, 8e-3, 1.0]],
    distortion: -0.01,
    blur_px: 0.8,
    noise_levels: 2.0,
    seed: 1,
};

/// A board whose edges run within a degree of the pixel grid.
const ALONG_GRID: Scene = Scene {
    columns: 8,
    rows: 5,
    homography: [[44.0, -0.25, 62.0], [0.3, 45.0, 68.0], [1e-4, 2e-4, 1.0]],
    ..SCENE
};

const DARK: f64 = 40.0;
const BRIGHT: f64 = 200.0;

impl Scene {
    fn params(&self) -> CornerParams {
        CornerParams { inner_columns: self.columns, inner_rows: self.rows }
    }

    /// Ideal (undistorted) position of a pixel: the distortion is defined in this direction.
    fn ideal(&self, p: [f64; 2]) -> [f64; 2] {
        let centre = [0.5 * self.width as f64, 0.5 * self.height as f64];
        let d = [p[0] - centre[0], p[1] - centre[1]];
        let r2 = (d[0] * d[0] + d[1] * d[1]) / (centre[0] * centre[0]);
        [0, 1].map(|k| centre[k] + d[k] * (1.0 - self.distortion * r2))
    }

    fn truth(&self, column: usize, row: usize) -> [f64; 2] {
        let q = self.homography.map(|h| h[0] * column as f64 + h[1] * row as f64 + h[2]);
        let target = [q[0] / q[2], q[1] / q[2]];
        let mut p = target;
        for _ in 0..50 {
            let ideal = self.ideal(p);
            p = [0, 1].map(|k| p[k] + target[k] - ideal[k]);
        }
        p
    }

    /// Brightness of the sharp board at an image position; the square outside corner (0, 0) is dark, with a bright
    /// margin of one square around the board.
    fn light(&self, inverse: &nalgebra::Matrix3<f64>, p: [f64; 2]) -> f64 {
        let ideal = self.ideal(p);
        let q = inverse * nalgebra::Vector3::new(ideal[0], ideal[1], 1.0);
        let (c, r) = ((q.x / q.z).floor() as i64, (q.y / q.z).floor() as i64);
        let inside = |x: i64, n: usize, margin: i64| (-1 - margin..n as i64 + margin).contains(&x);
        if inside(c, self.columns, 0) && inside(r, self.rows, 0) {
            return if (c + r).rem_euclid(2) == 0 { DARK } else { BRIGHT };
        }
        if inside(c, self.columns, 1) && inside(r, self.rows, 1) { BRIGHT } else { 90.0 }
    }

    /// Samples on a raster finer than the pixels; then blur and pixel box by summation.
    fn levels(&self) -> Vec<f64> {
        // Five by five samples, with an offset from row to row so that no edge falls between them.
        let fine_per_px = 5;
        let inverse = nalgebra::Matrix3::from_fn(|i, j| self.homography[i][j]).try_inverse().unwrap();
        let (w, h) = (self.width * fine_per_px, self.height * fine_per_px);
        let place = |k: usize, shift: f64| (k as f64 + 0.5 + shift) / fine_per_px as f64 - 0.5;
        let samples: Vec<f64> = (0..w * h)
            .map(|k| {
                let (u, v) = (k % w, k / w);
                let shift = |n: usize| ((n * 7) % 11) as f64 / 11.0 - 5.0 / 11.0;
                self.light(&inverse, [place(u, shift(v)), place(v, shift(u))])
            })
            .collect();
        let kernel = blurred_box(self.blur_px, fine_per_px);
        let rows = summed(&samples, w, h, fine_per_px, &kernel);
        let rotated: Vec<f64> = (0..self.width * h).map(|k| rows[(k % h) * self.width + k / h]).collect();
        let columns = summed(&rotated, h, self.width, fine_per_px, &kernel);
        (0..self.width * self.height).map(|k| columns[(k % self.width) * self.height + k / self.width]).collect()
    }

    fn image(&self) -> GreyImage {
        let mut noise = Noise(self.seed);
        let level = |l: &f64| (l + self.noise_levels * noise.next()).round().clamp(0.0, 255.0) as u8;
        let bytes = self.levels().iter().map(level).collect();
        GreyImage::new(self.width, self.height, Pixels::Eight(bytes)).unwrap()
    }
}

/// Weights of a pixel's box convolved with a Gaussian, on the fine raster.
fn blurred_box(blur_px: f64, fine: usize) -> Vec<f64> {
    let reach = (5.0 * blur_px * fine as f64).ceil() as i64 + fine as i64;
    let sigma = blur_px * fine as f64;
    let half = fine as i64 / 2;
    let gauss = |x: i64| (-0.5 * (x as f64 / sigma).powi(2)).exp();
    let raw: Vec<f64> = (-reach..=reach).map(|x| (-half..=half).map(|b| gauss(x - b)).sum()).collect();
    let sum: f64 = raw.iter().sum();
    raw.iter().map(|r| r / sum).collect()
}

/// Each row convolved with `kernel` and taken at every `fine`-th place.
fn summed(source: &[f64], width: usize, height: usize, fine: usize, kernel: &[f64]) -> Vec<f64> {
    let mut target = Vec::with_capacity(width / fine * height);
    for row in source.chunks_exact(width) {
        for u in 0..width / fine {
            let centre = (u * fine + fine / 2) as i64 - (kernel.len() / 2) as i64;
            let at = |k: usize| row[(centre + k as i64).clamp(0, width as i64 - 1) as usize];
            target.push(kernel.iter().enumerate().map(|(k, w)| w * at(k)).sum());
        }
    }
    target
}

/// Standard normal numbers: splitmix64, twelve uniform ones summed.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// Error per axis (RMS, px) and RMS of error over stated sigma.
fn errors(found: &[Corner], truth: impl Fn(&Corner) -> [f64; 2]) -> (f64, f64) {
    let (mut square, mut normalised) = (0.0, 0.0);
    for corner in found {
        let t = truth(corner);
        for e in [corner.u_px - t[0], corner.v_px - t[1]] {
            square += e * e;
            normalised += (e / corner.sigma_px).powi(2);
        }
    }
    let n = 2.0 * found.len() as f64;
    ((square / n).sqrt(), (normalised / n).sqrt())
}

/// The image after `turn` quarter turns clockwise.
fn rotated_image(image: &GreyImage, turn: usize) -> GreyImage {
    let (w, h) = (image.width(), image.height());
    let (tw, th) = if turn.is_multiple_of(2) { (w, h) } else { (h, w) };
    let Pixels::Eight(p) = image.pixels() else { panic!("8-bit test images only") };
    let at = |u: usize, v: usize| match turn {
        1 => p[(h - 1 - u) * w + v],
        2 => p[(h - 1 - v) * w + w - 1 - u],
        3 => p[u * w + w - 1 - v],
        _ => p[v * w + u],
    };
    let bytes = (0..tw * th).map(|k| at(k % tw, k / tw)).collect();
    GreyImage::new(tw, th, Pixels::Eight(bytes)).unwrap()
}

/// Where pixel (u, v) of the image lies after `turn` quarter turns clockwise.
fn rotated_position(image: &GreyImage, p: [f64; 2], turn: usize) -> [f64; 2] {
    let (w, h) = (image.width() as f64 - 1.0, image.height() as f64 - 1.0);
    match turn {
        1 => [h - p[1], p[0]],
        2 => [w - p[0], h - p[1]],
        3 => [p[1], w - p[0]],
        _ => p,
    }
}

#[test]
fn rendered_corners_are_found_within_their_stated_sigma() {
    // A third of the error of a saddle-point detector; four times the noise limit.
    let sharp_px = 0.012;
    for (blur_px, noise_levels, limit_px) in [(0.5, 1.0, sharp_px), (0.8, 2.0, sharp_px), (2.0, 4.0, 0.04)] {
        let scene = Scene { blur_px, noise_levels, ..SCENE };
        let board = find_corners(&scene.image(), &scene.params()).unwrap();
        assert_eq!(board.corners.len(), 28);
        let (rms_px, normalised) = errors(&board.corners, |c| scene.truth(c.column, c.row));
        eprintln!("blur {blur_px} noise {noise_levels}: {rms_px:.4} px, {normalised:.2} sigma");
        assert!(rms_px < limit_px, "blur {blur_px}: {rms_px} px RMS");
        // 56 samples: 1 ± 0.1 (one sigma) if the stated sigma is right.
        assert!((0.7..1.3).contains(&normalised), "blur {blur_px}: error/sigma {normalised}");
    }
}

/// Errors on `n` boards like `scene`, each at another position and with its own noise: RMS per axis, and relative to
/// the stated sigma.
fn errors_of_boards(scene: Scene, n: u32) -> (f64, f64) {
    let (mut square, mut normalised) = (0.0, 0.0);
    for k in 0..n {
        let mut scene = Scene { seed: 7 + u64::from(k), ..scene };
        scene.homography[0][2] += 0.37 * f64::from(k);
        scene.homography[1][2] += 0.23 * f64::from(k);
        scene.homography[1][0] *= 1.0 - 0.2 * f64::from(k);
        let board = find_corners(&scene.image(), &scene.params()).unwrap();
        let (rms_px, sigmas) = errors(&board.corners, |c| scene.truth(c.column, c.row));
        square += rms_px * rms_px / f64::from(n);
        normalised += sigmas * sigmas / f64::from(n);
    }
    (square.sqrt(), normalised.sqrt())
}

#[test]
fn edges_along_the_pixel_grid_are_as_accurate_as_others_even_if_sharper_than_a_pixel() {
    for blur_px in [0.3, 0.8] {
        let (along_px, normalised) = errors_of_boards(Scene { blur_px, ..ALONG_GRID }, 4);
        let (oblique_px, _) = errors_of_boards(Scene { blur_px, ..SCENE }, 4);
        eprintln!("blur {blur_px}: {along_px:.4} px, {normalised:.2} sigma; oblique {oblique_px:.4} px");
        assert!(along_px < 1.25 * oblique_px, "blur {blur_px}: {along_px} px, oblique {oblique_px}");
        assert!((0.8..1.25).contains(&normalised), "blur {blur_px}: error/sigma {normalised}");
    }
}

#[test]
fn a_rotated_image_gives_the_same_physical_corners() {
    let image = SCENE.image();
    let upright = find_corners(&image, &SCENE.params()).unwrap();
    for turn in 1..4 {
        let rotated = find_corners(&rotated_image(&image, turn), &SCENE.params()).unwrap();
        for (a, b) in upright.corners.iter().zip(&rotated.corners) {
            let expected = rotated_position(&image, [a.u_px, a.v_px], turn);
            // The window's pixels differ by rounding only.
            assert!(
                (b.u_px - expected[0]).hypot(b.v_px - expected[1]) < 0.01,
                "turn {turn}: {b:?} not at {expected:?}"
            );
        }
    }
}

#[test]
fn the_columns_of_an_ambiguous_board_run_to_the_right() {
    let scene = Scene { columns: 7, rows: 5, ..SCENE };
    let image = scene.image();
    for turn in [0, 2] {
        let board = find_corners(&rotated_image(&image, turn), &scene.params()).unwrap();
        assert!(board.corners[1].u_px > board.corners[0].u_px + 20.0);
        assert!(board.corners[7].v_px > board.corners[0].v_px + 20.0);
    }
}

#[test]
fn sixteen_bit_grey_levels_give_the_same_corners() {
    let image = SCENE.image();
    let Pixels::Eight(p) = image.pixels() else { unreachable!() };
    // A 12-bit camera in 16-bit words.
    let words = p.iter().map(|&l| u16::from(l) * 16).collect();
    let deep = GreyImage::new(image.width(), image.height(), Pixels::Sixteen(words)).unwrap();
    let (a, b) = (find_corners(&image, &SCENE.params()).unwrap(), find_corners(&deep, &SCENE.params()).unwrap());
    for (a, b) in a.corners.iter().zip(&b.corners) {
        // The fit ends within its step tolerance, a tenth of sigma.
        assert!((a.u_px - b.u_px).hypot(a.v_px - b.v_px) < 0.001);
    }
}

#[test]
fn a_board_of_another_size_is_refused_with_its_size() {
    let refused = find_corners(&SCENE.image(), &CornerParams { inner_columns: 6, inner_rows: 4 });
    assert_eq!(
        refused,
        Err(CornerError::WrongSize { inner_columns: 6, inner_rows: 4, found_columns: 7, found_rows: 4 })
    );
}

/// The image with a grey square of `side` px around the corner at (column, row).
fn covered(scene: &Scene, column: usize, row: usize, side: usize) -> GreyImage {
    let image = scene.image();
    let Pixels::Eight(p) = image.pixels() else { unreachable!() };
    let mut bytes = p.clone();
    let centre = scene.truth(column, row).map(|x| x as usize);
    for v in centre[1].saturating_sub(side / 2)..(centre[1] + side / 2).min(image.height()) {
        let first = v * image.width() + centre[0].saturating_sub(side / 2);
        bytes[first..first + side].fill(120);
    }
    GreyImage::new(image.width(), image.height(), Pixels::Eight(bytes)).unwrap()
}

/// Asserts that every corner found is at the position of its index.
fn assert_numbered(scene: &Scene, board: &BoardCorners) {
    for c in &board.corners {
        let t = scene.truth(c.column, c.row);
        assert!((c.u_px - t[0]).hypot(c.v_px - t[1]) < 0.1, "{c:?} is not at {t:?}");
    }
}

#[test]
fn a_covered_board_gives_its_visible_corners() {
    for (column, row, side, least) in [(3, 2, 28, 27), (1, 1, 80, 18), (0, 3, 40, 25)] {
        let board = find_corners(&covered(&SCENE, column, row, side), &SCENE.params()).unwrap();
        assert!((least..28).contains(&board.corners.len()), "{} corners", board.corners.len());
        assert_numbered(&SCENE, &board);
    }
}

#[test]
fn a_board_partly_outside_the_image_gives_its_visible_corners() {
    // Cut off at the right, below, at the left and above, and at two sides.
    for (shift, size, least) in [
        ([0.0, 0.0], (300, 360), 16),
        ([0.0, 0.0], (480, 240), 14),
        ([-150.0, 0.0], (480, 360), 16),
        ([0.0, -130.0], (480, 360), 14),
        ([-110.0, 0.0], (480, 260), 12),
    ] {
        let mut scene = Scene { width: size.0, height: size.1, distortion: 0.0, ..SCENE };
        for column in 0..3 {
            for (axis, shift_px) in shift.iter().enumerate() {
                scene.homography[axis][column] += shift_px * scene.homography[2][column];
            }
        }
        let board =
            find_corners(&scene.image(), &scene.params()).unwrap_or_else(|e| panic!("{shift:?} {size:?}: {e}"));
        assert!((least..28).contains(&board.corners.len()), "{shift:?} {size:?}: {}", board.corners.len());
        assert_numbered(&scene, &board);
    }
}

#[test]
fn a_part_with_several_possible_positions_is_refused() {
    // Cut off on both sides, and a part of a board that looks the same after a rotation by 180°.
    let both =
        Scene { width: 200, homography: [[47.0, 4.0, -40.0], SCENE.homography[1], [2e-4, 8e-4, 1.0]], ..SCENE };
    let refused = find_corners(&both.image(), &both.params()).unwrap_err();
    assert!(matches!(refused, CornerError::Ambiguous { inner_columns: 7, inner_rows: 4, .. }), "{refused}");
    let symmetric = Scene { columns: 7, rows: 5, width: 300, ..SCENE };
    let refused = find_corners(&symmetric.image(), &symmetric.params()).unwrap_err();
    assert!(matches!(refused, CornerError::Ambiguous { inner_columns: 7, inner_rows: 5, .. }), "{refused}");
}

#[test]
fn an_image_without_a_board_is_refused() {
    let mut noise = Noise(5);
    let bytes = (0..320 * 240).map(|_| (128.0 + 40.0 * noise.next()).clamp(0.0, 255.0) as u8).collect();
    let noisy = GreyImage::new(320, 240, Pixels::Eight(bytes)).unwrap();
    let flat = GreyImage::new(320, 240, Pixels::Eight(vec![7; 320 * 240])).unwrap();
    let tiny = GreyImage::new(1, 1, Pixels::Sixteen(vec![9])).unwrap();
    for image in [noisy, flat, tiny] {
        let refused = find_corners(&image, &SCENE.params());
        assert_eq!(refused, Err(CornerError::NotFound { inner_columns: 7, inner_rows: 4 }));
    }
}

fn load(path: &std::path::Path) -> GreyImage {
    let grey = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).to_luma8();
    GreyImage::new(grey.width() as usize, grey.height() as usize, Pixels::Eight(grey.into_raw())).unwrap()
}

#[test]
fn every_photographed_board_is_found_whole() {
    let Some(real) = ::reference::data("real") else { return };
    let check = |path: PathBuf, inner_columns, inner_rows| {
        let board = find_corners(&load(&path), &CornerParams { inner_columns, inner_rows });
        let board = board.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        // On a flat board a corner is within a tenth of a square of the mean of its neighbours; a false or swapped
        // corner is not.
        for row in 0..inner_rows {
            for column in 1..inner_columns - 1 {
                let [a, b, c] = [column - 1, column, column + 1].map(|k| board.corners[row * inner_columns + k]);
                let off = (0.5 * (a.u_px + c.u_px) - b.u_px).hypot(0.5 * (a.v_px + c.v_px) - b.v_px);
                let step = (c.u_px - a.u_px).hypot(c.v_px - a.v_px) / 2.0;
                assert!(off < 0.1 * step, "{}: corner {row},{column} off by {off} px", path.display());
            }
        }
    };
    for n in (1..=14).filter(|n| *n != 10) {
        check(real.join(format!("opencv-board/left{n:02}.jpg")), 9, 6);
        check(real.join(format!("opencv-board/right{n:02}.jpg")), 9, 6);
    }
    for n in 0..16 {
        check(real.join(format!("ciclop/camera/frame{n}.jpg")), 11, 6);
    }
}

/// Truth of one view of `rig-a`: board rotation (3 × 3) and centre in the camera frame (mm), pinhole with
/// Brown–Conrady distortion (k1 k2 p1 p2 k3).
fn projected(truth: &serde_json::Value, view: &str, column: usize, row: usize) -> [f64; 2] {
    let numbers = |v: &serde_json::Value| -> Vec<f64> {
        v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let (k, dist) = (numbers(&truth["K"]), numbers(&truth["dist"]));
    let centre = numbers(&truth[format!("{view}_c")]);
    let board = [12.0 * (column as f64 - 5.0), 12.0 * (row as f64 - 3.5)];
    let p: Vec<f64> = (0..3)
        .map(|i| {
            let r = numbers(&truth[format!("{view}_R")][i]);
            centre[i] + r[0] * board[0] + r[1] * board[1]
        })
        .collect();
    let (x, y) = (p[0] / p[2], p[1] / p[2]);
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (dist[0] + r2 * (dist[1] + r2 * dist[4]));
    let (p1, p2) = (dist[2], dist[3]);
    let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    [k[0] * xd + k[2], k[1] * yd + k[3]]
}

#[test]
fn the_corners_of_the_rendered_station_are_within_about_a_hundredth_of_a_pixel() {
    let Some(rig) = ::reference::data("rig-a") else { return };
    let truth: serde_json::Value =
        serde_json::from_slice(&std::fs::read(rig.join("truth.json")).unwrap()).unwrap();
    let params = CornerParams { inner_columns: 11, inner_rows: 8 };
    let (mut square, mut normalised) = (0.0, 0.0);
    for n in 0..12 {
        let board = find_corners(&load(&rig.join(format!("board/{n:03}.png"))), &params).unwrap();
        let view = format!("pose{n}");
        let (rms_px, sigmas) = errors(&board.corners, |c| projected(&truth, &view, c.column, c.row));
        square += rms_px * rms_px / 12.0;
        normalised += sigmas * sigmas / 12.0;
    }
    for n in 0..5 {
        find_corners(&load(&rig.join(format!("stage/{n:03}.png"))), &params).unwrap();
    }
    eprintln!("{:.4} px, {:.2} sigma", square.sqrt(), normalised.sqrt());
    // The promised accuracy; a saddle-point detector reaches 0.022.
    assert!(square.sqrt() < 0.012, "{} px RMS per axis", square.sqrt());
    // Stated sigmas within a quarter of the errors.
    assert!((0.8..1.25).contains(&normalised.sqrt()), "error/sigma {}", normalised.sqrt());
}

#[test]
fn strongly_bent_edges_do_not_move_the_corners() {
    let homography = [[33.0, 3.0, 70.0], [-3.0, 33.0, 78.0], [1e-3, -2e-3, 1.0]];
    let scene = Scene { columns: 9, rows: 6, distortion: -0.12, homography, noise_levels: 1.0, ..SCENE };
    let board = find_corners(&scene.image(), &scene.params()).unwrap();
    let (rms_px, _) = errors(&board.corners, |c| scene.truth(c.column, c.row));
    eprintln!("bent {rms_px:.5} px");
    // Measured 0.0036; with straight edges in the model 0.0080.
    assert!(rms_px < 0.006, "{rms_px} px RMS");
}

#[test]
fn the_fast_search_finds_every_corner_of_a_clear_board() {
    let seed = finding::fast::fast_seed(&SCENE.image());
    assert_eq!(seed.len(), 28);
    for place in seed.values() {
        let corners = (0..28).map(|k| SCENE.truth(k % 7, k / 7));
        let nearest = corners.map(|t| (place[0] - t[0]).hypot(place[1] - t[1])).fold(f64::INFINITY, f64::min);
        // Half a pixel of the half-size image.
        assert!(nearest < 1.0, "{place:?} is {nearest} px from every corner");
    }
}

#[test]
fn the_exhaustive_search_finds_the_same_board() {
    let image = SCENE.image();
    let exhaustive = finding::detect::exhaustive_search(&image, |seed| {
        board_from_lattice(&Lattice::from_seed(&image, seed)?, &SCENE.params()).ok()
    });
    let numbered = exhaustive.unwrap().into_iter().enumerate().map(|(k, fit)| ([k % 7, k / 7], fit)).collect();
    let exhaustive = refined(&image, numbered, &SCENE.params());
    let fast = find_corners(&image, &SCENE.params()).unwrap();
    for (a, b) in exhaustive.corners.iter().zip(&fast.corners) {
        assert_eq!((a.row, a.column), (b.row, b.column));
        // The windows follow the first fits, which agree within 0.02 px: some pixels at their edges differ.
        assert!((a.u_px - b.u_px).hypot(a.v_px - b.v_px) < 0.5 * a.sigma_px, "{a:?} {b:?}");
    }
}

#[test]
fn a_window_contains_each_pixel_of_its_parallelogram_once() {
    let image = SCENE.image();
    let reach = fitting::window::Reach { squares: 0.4, max_px: 9.0 };
    for square_px in [[[30.0, 0.0], [0.0, 25.0]], [[20.0, 9.0], [-7.0, 31.0]], [[3.0, -28.0], [24.0, 4.0]]] {
        let centre = [200.3, 150.8];
        let window = fitting::window::window_around(&image, centre, square_px, reach, None);
        let [c, r]: [[f64; 2]; 2] = square_px;
        let share = [c, r].map(|s| 9.0f64.min(0.4 * s[0].hypot(s[1])) / s[0].hypot(s[1]));
        let mut expected = Vec::new();
        for v in 100..200 {
            for u in 150..250 {
                let q = [f64::from(u) - centre[0], f64::from(v) - centre[1]];
                let determinant = c[0] * r[1] - c[1] * r[0];
                let columns = (q[0] * r[1] - q[1] * r[0]) / determinant;
                let rows = (c[0] * q[1] - c[1] * q[0]) / determinant;
                if columns.abs() <= share[0] && rows.abs() <= share[1] {
                    expected.push([(u - 200) as f32, (v - 151) as f32, image.at(u as usize, v as usize)]);
                }
            }
        }
        let found: Vec<[f32; 3]> =
            (0..window.n_pixels()).map(|k| [window.x[k], window.y[k], window.level[k]]).collect();
        assert_eq!(found, expected);
    }
}

/// A tilted board of 7 × 4 corners in integer arithmetic: the image does not depend on any library's `exp` or `sin`. A
/// pixel is the mean over a box of two pixels, sampled in eighths of a pixel.
fn integer_board() -> GreyImage {
    const SIDES: (i64, i64) = (420, 300);
    const PER_PX: i64 = 8;
    /// Board columns and rows grow by this many units per eighth of a pixel along u and v, starting from these values …
    const STEPS: [[i64; 2]; 2] = [[21, 2], [-3, 22]];
    const START_PX: [i64; 2] = [72, 78];
    /// … and a square is this many units long, which makes it 43 pixels wide.
    const PARTS: i64 = 21 * 43 * PER_PX;
    let light = |u: i64, v: i64| {
        let place = [0, 1].map(|axis: usize| {
            let parts = STEPS[axis][0] * u + STEPS[axis][1] * v - 21 * PER_PX * START_PX[axis];
            parts.div_euclid(PARTS)
        });
        let inside = |margin: i64| {
            (-1 - margin..7 + margin).contains(&place[0]) && (-1 - margin..4 + margin).contains(&place[1])
        };
        match (inside(0), inside(1)) {
            (true, _) if (place[0] + place[1]).rem_euclid(2) == 0 => 40,
            (true, _) | (_, true) => 200,
            _ => 90,
        }
    };
    let level = |idx: i64| {
        let (u, v) = (idx % SIDES.0 * PER_PX, idx / SIDES.0 * PER_PX);
        let sum: i64 = (v - PER_PX..v + PER_PX)
            .flat_map(|v| (u - PER_PX..u + PER_PX).map(move |u| (u, v)))
            .map(|(u, v)| light(u, v))
            .sum();
        // A pattern of a few levels instead of noise.
        (sum / (4 * PER_PX * PER_PX) + idx * 7919 % 13 % 4) as u8
    };
    let pixels = (0..SIDES.0 * SIDES.1).map(level).collect();
    GreyImage::new(SIDES.0 as usize, SIDES.1 as usize, Pixels::Eight(pixels)).unwrap()
}

#[test]
fn every_architecture_finds_the_stored_corners() {
    /// Guaranteed for every instruction set; differences between the systems' trigonometric and logarithm functions are
    /// within it.
    const AGREEMENT_PX: f64 = 1e-6;
    /// The first and last corner of the first and last row. A deliberate change of the fit updates them.
    const EXPECTED: [(usize, [f64; 2]); 4] = [
        (0, [64.139_053_472, 83.253_990_010]),
        (6, [318.824_074_829, 117.982_576_207]),
        (21, [52.556_337_790, 204.806_792_647]),
        (27, [307.256_534_743, 239.538_721_825]),
    ];
    let board = find_corners(&integer_board(), &CornerParams { inner_columns: 7, inner_rows: 4 }).unwrap();
    let found = EXPECTED.map(|(idx, _)| (idx, [board.corners[idx].u_px, board.corners[idx].v_px]));
    for ((_, [u, v]), (_, expected)) in found.iter().zip(EXPECTED) {
        let apart_px = (u - expected[0]).hypot(v - expected[1]);
        assert!(apart_px < AGREEMENT_PX, "{apart_px} px; found {found:?}");
    }
}
