//! Extraction of synthetic lines with known centres. Optics (curved, steep lines through a lens) and real sensors are
//! not covered here.

use super::*;

/// A small seeded generator, so that the images are reproducible.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Unit Gaussian (sum of twelve).
    fn gauss(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A synthetic image: light as a function of column and row, plus camera noise.
struct Scene<'a> {
    size: (usize, usize),
    light: &'a dyn Fn(f64, f64) -> f64,
    noise: f64,
}

impl Scene<'_> {
    fn levels(&self, full_scale: f64) -> Vec<f64> {
        let mut noise = Noise(11);
        let (width, height) = self.size;
        let pixels = (0..width * height).map(|i| ((i % width) as f64, (i / width) as f64));
        pixels
            .map(|(u, v)| (self.light)(u, v) + self.noise * noise.gauss())
            .map(|level| (level * full_scale / 255.0).round().clamp(0.0, full_scale))
            .collect()
    }

    fn eight(&self) -> GreyImage {
        let pixels = self.levels(255.0).into_iter().map(|l| l as u8).collect();
        GreyImage::new(self.size.0, self.size.1, Pixels::Eight(pixels)).unwrap()
    }
}

const SIZE: (usize, usize) = (256, 128);

/// Gaussian profile of standard deviation 2 px across a line through row `v0` with `slope`.
fn bell(u: f64, v: f64, v0: f64, slope: f64) -> f64 {
    let d = (v - v0 - slope * u) / slope.hypot(1.0);
    (-0.5 * d * d / 4.0).exp()
}

fn steger(image: &GreyImage) -> Centrelines {
    find_centrelines(image, &CentrelineParams::default())
}

fn points(centrelines: &Centrelines) -> Vec<CentrelinePoint> {
    centrelines.segments.iter().flat_map(|s| s.points.iter().copied()).collect()
}

/// Root mean square distance (px) of the points to a straight line, across it.
fn rms_to(points: &[CentrelinePoint], v0: f64, slope: f64) -> f64 {
    let square = |p: &CentrelinePoint| ((p.v_px - v0 - slope * p.u_px) / slope.hypot(1.0)).powi(2);
    (points.iter().map(square).sum::<f64>() / points.len() as f64).sqrt()
}

/// One line, every column, within `tolerance_px`.
fn check(
    light: &dyn Fn(f64, f64) -> f64,
    noise: f64,
    (v0, slope): (f64, f64),
    tolerance_px: f64,
) -> Vec<CentrelinePoint> {
    let found = steger(&Scene { size: SIZE, light, noise }.eight());
    assert_eq!(found.segments.len(), 1, "one line");
    let points = points(&found);
    assert!(points.len() >= SIZE.0 - 4, "{} columns", points.len());
    let rms = rms_to(&points, v0, slope);
    assert!(rms <= tolerance_px, "{rms} px");
    points
}

#[test]
fn a_line_is_found_within_a_hundredth_of_a_pixel_with_its_width_and_intensity() {
    // One grey level of noise on 200, width 4.7 px, 20 columns averaged: 0.004 px expected.
    let points = check(&|u, v| 5.0 + 200.0 * bell(u, v, 60.3, 0.1), 1.0, (60.3, 0.1), 0.01);
    let middle = points[128];
    assert!((middle.width_px - 4.71).abs() < 0.5, "width {}", middle.width_px);
    assert!((middle.intensity - 190.0).abs() < 15.0, "intensity {}", middle.intensity);
    assert!(!middle.saturated);
    assert!((middle.normal[0] / middle.normal[1] + 0.1).abs() < 0.01);
}

#[test]
fn a_line_ten_grey_levels_over_noise_is_followed() {
    // Noise 1.2 on 10 levels is 0.25 px in a column, 0.09 px averaged.
    let points = check(&|u, v| 4.0 + 10.0 * bell(u, v, 60.3, 0.05), 1.2, (60.3, 0.05), 0.13);
    let predicted = points.iter().map(|p| p.sigma_px).sum::<f64>() / points.len() as f64;
    assert!((0.05..0.15).contains(&predicted), "sigma {predicted}");
}

#[test]
fn a_saturated_line_is_not_displaced_and_is_flagged() {
    let points = check(&|u, v| 5.0 + 900.0 * bell(u, v, 60.3, 0.1), 1.0, (60.3, 0.1), 0.02);
    assert!(points.iter().all(|p| p.saturated));
}

#[test]
fn a_line_at_forty_five_degrees_is_found() {
    let light = |u: f64, v: f64| 5.0 + 200.0 * bell(u, v, -50.0, 1.0);
    let found = points(&steger(&Scene { size: SIZE, light: &light, noise: 1.0 }.eight()));
    // It crosses the upper and lower border, where one line width (6.7 columns here) is left out.
    assert!(found.len() > 108, "{} of 128 columns", found.len());
    assert!(rms_to(&found, -50.0, 1.0) < 0.02, "{}", rms_to(&found, -50.0, 1.0));
}

#[test]
fn a_change_of_intensity_along_a_sloping_line_does_not_move_it() {
    let squares = |u: f64| if (u / 32.0) as i32 % 2 == 0 { 200.0 } else { 20.0 };
    let points = check(&|u, v| 5.0 + squares(u) * bell(u, v, 30.3, 0.3), 1.0, (30.3, 0.3), 0.08);
    let near_edges: Vec<_> = points
        .iter()
        .copied()
        .filter(|p| (p.u_px + 3.0) % 32.0 < 6.0 && p.u_px > 10.0 && p.u_px < 245.0)
        .collect();
    // Smoothing along the line alone would displace these by up to 0.25 px.
    assert!(rms_to(&near_edges, 30.3, 0.3) < 0.08, "{}", rms_to(&near_edges, 30.3, 0.3));
}

#[test]
fn ambient_light_and_bright_edges_neither_hide_nor_move_a_line() {
    let ambient = |u: f64, v: f64| 10.0 + 0.3 * v + 0.1 * u + if v > 100.0 { 60.0 } else { 0.0 };
    // The gradient of 0.3 levels per row would shift the ridge by 0.07 px if it were not subtracted.
    check(&|u, v| ambient(u, v) + 60.0 * bell(u, v, 60.3, 0.05), 1.0, (60.3, 0.05), 0.04);
}

#[test]
fn an_image_without_light_gives_no_segment() {
    for (noise, seed_light) in [(0.0, 0.0), (1.0, 4.0), (5.0, 100.0)] {
        let image = Scene { size: (640, 512), light: &|_, _| seed_light, noise }.eight();
        assert!(steger(&image).segments.is_empty(), "noise {noise}");
    }
}

#[test]
fn images_smaller_than_a_line_are_not_an_error() {
    for size in [(1, 1), (3, 2), (2, 40), (40, 2)] {
        steger(&Scene { size, light: &|_, v| 100.0 * v, noise: 0.0 }.eight());
    }
}

#[test]
fn a_line_in_a_small_image_is_located_accurately() {
    for size in [(300, 40), (50, 200), (40, 40)] {
        let (middle, slope) = (0.4 * size.1 as f64, 0.05);
        let image = Scene { size, light: &|u, v| 5.0 + 150.0 * bell(u, v, middle, slope), noise: 1.5 }.eight();
        let found = steger(&image);
        assert_eq!(found.segments.len(), 1, "{size:?}");
        let points = points(&found);
        assert!(points.len() + 4 >= size.0, "{size:?}: {} columns", points.len());
        assert!(points.iter().all(|point| point.u_px < size.0 as f64), "{size:?}");
        assert!(rms_to(&points, middle, slope) < 0.03, "{size:?}: {}", rms_to(&points, middle, slope));
    }
}

#[test]
fn images_with_too_long_a_side_are_refused() {
    let long = GreyImage::new(1, 16_385, Pixels::Eight(vec![0; 16_385]));
    assert!(long.unwrap_err().to_string().contains("more than 16384"), "the limit is named");
}

#[test]
fn sixteen_bit_images_give_the_same_points_as_eight_bit_images() {
    let eight = Scene { size: SIZE, light: &|u, v| 5.0 + 150.0 * bell(u, v, 60.3, 0.1), noise: 1.5 }.eight();
    let Pixels::Eight(levels) = eight.pixels() else { unreachable!() };
    let sixteen = Pixels::Sixteen(levels.iter().map(|&l| u16::from(l) * 257).collect());
    let sixteen = GreyImage::new(SIZE.0, SIZE.1, sixteen).unwrap();
    let (a, b) = (points(&steger(&eight)), points(&steger(&sixteen)));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        // Single-precision sums of levels 257 times larger.
        assert!((a.v_px - b.v_px).abs() < 1e-3 && (a.sigma_px - b.sigma_px).abs() < 1e-3);
    }
}

#[test]
fn lines_along_columns_are_lines_along_rows_transposed() {
    let image = Scene { size: SIZE, light: &|u, v| 5.0 + 150.0 * bell(u, v, 60.3, 0.1), noise: 1.5 }.eight();
    for method in [CentrelineMethod::Steger, CentrelineMethod::CentreOfGravity] {
        let rows = CentrelineParams { method, line_direction: LineDirection::Rows };
        let columns = CentrelineParams { method, line_direction: LineDirection::Columns };
        let (a, b) = (find_centrelines(&image, &rows), find_centrelines(&image.transposed(), &columns));
        for (a, b) in points(&a).iter().zip(&points(&b)) {
            assert_eq!((a.u_px, a.v_px, a.normal), (b.v_px, b.u_px, [b.normal[1], b.normal[0]]));
        }
    }
}

#[test]
fn the_centre_of_gravity_finds_the_same_line() {
    let image = Scene { size: SIZE, light: &|u, v| 5.0 + 200.0 * bell(u, v, 60.3, 0.1), noise: 1.0 }.eight();
    let method = CentrelineMethod::CentreOfGravity;
    let found = points(&find_centrelines(&image, &CentrelineParams { method, ..Default::default() }));
    assert!(found.len() > 250);
    // One column alone: noise 1 in 11 rows over a sum of 1000.
    assert!(rms_to(&found, 60.3, 0.1) < 0.05, "{}", rms_to(&found, 60.3, 0.1));
}

#[test]
fn a_step_breaks_the_line_and_its_edge_stays_within_a_column() {
    let row = |u: f64| if (100.0..108.0).contains(&u) { 40.3 } else { 60.3 };
    let image = Scene { size: SIZE, light: &|u, v| 5.0 + 200.0 * bell(u, v, row(u), 0.0), noise: 1.0 }.eight();
    let found = steger(&image);
    assert_eq!(found.segments.len(), 3);
    let mut spans: Vec<_> =
        found.segments.iter().map(|s| (s.points[0].u_px, s.points[s.points.len() - 1].u_px)).collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(spans, [(0.0, 99.0), (100.0, 107.0), (108.0, 255.0)]);
    for p in points(&found) {
        // Five predicted standard deviations: the last columns of a line are less certain.
        assert!((p.v_px - row(p.u_px)).abs() < 5.0 * p.sigma_px + 0.02, "{} {}", p.u_px, p.v_px);
    }
}

#[test]
fn a_slot_of_six_columns_one_pixel_deep_keeps_its_place_and_most_of_its_depth() {
    let row = |u: f64| if (100.0..106.0).contains(&u) { 61.5 } else { 60.3 };
    let image = Scene { size: SIZE, light: &|u, v| 5.0 + 200.0 * bell(u, v, row(u), 0.0), noise: 1.0 }.eight();
    let found = points(&steger(&image));
    let lowered = |p: &&CentrelinePoint| p.v_px > 60.9;
    let columns: Vec<f64> = found.iter().filter(lowered).map(|p| p.u_px).collect();
    assert_eq!(columns, [100.0, 101.0, 102.0, 103.0, 104.0, 105.0]);
    // Smoothing by one column and the shortest parabola leave the floor within a quarter of the depth.
    let floor = found[102].v_px.max(found[103].v_px);
    assert!((floor - 61.5).abs() < 0.3, "floor {floor}");
    // Beyond one line width the surroundings are unaffected.
    assert!(found.iter().filter(|p| (p.u_px - 102.5).abs() > 8.0).all(|p| (p.v_px - 60.3).abs() < 0.05));
}

/// Lines with the speckle of `contrast`, blurred as by a lens.
fn speckled(size: (usize, usize), contrast: f64, lines: &dyn Fn(f64, f64) -> f64) -> GreyImage {
    let mut grains = Noise(5);
    let white: Vec<f64> = (0..size.0 * size.1).map(|_| grains.gauss()).collect();
    let grain = |u: usize, v: usize| {
        let at = |du: usize, dv: usize| white[(v + dv).min(size.1 - 1) * size.0 + (u + du).min(size.0 - 1)];
        0.5 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
    };
    let light =
        |u: f64, v: f64| 4.0 + 180.0 * lines(u, v) * (1.0 + contrast * grain(u as usize, v as usize)).max(0.0);
    Scene { size, light: &light, noise: 1.0 }.eight()
}

#[test]
fn edges_on_a_speckled_line_stay_in_their_column() {
    // Every 64 columns a step, four pixels high; noise after averaging is 0.15 px.
    let size = (1200, 128);
    let row = |u: f64| if (u / 64.0) as usize % 2 == 1 { 64.3 } else { 60.3 };
    let found = points(&steger(&speckled(size, 0.28, &|u, v| bell(u, v, row(u), 0.0))));
    let n_raised = |columns: std::ops::Range<f64>| {
        let within = |p: &&CentrelinePoint| columns.contains(&(p.u_px % 128.0)) && p.u_px < 1152.0;
        let heights: Vec<bool> = found.iter().filter(within).map(|p| p.v_px > 62.3).collect();
        (heights.iter().filter(|raised| **raised).count(), heights.len())
    };
    // The last column before an edge is low, the first after it high, at nearly all of nine edges.
    for (columns, is_raised) in [(63.0..64.0, false), (64.0..65.0, true), (126.0..127.5, true), (0.0..1.0, false)]
    {
        let (raised, n) = n_raised(columns.clone());
        let right = if is_raised { raised } else { n - raised };
        assert!(n >= 6 && right + 1 >= n, "{columns:?}: {right} of {n}");
    }
}

#[test]
fn predicted_sigma_holds_for_weak_and_strong_speckle() {
    for contrast in [0.05, 0.15, 0.3] {
        let mut grains = Noise(5);
        let (width, height) = (600, 160);
        let white: Vec<f64> = (0..width * height).map(|_| grains.gauss()).collect();
        // Box of two by two pixels, unit variance: speckle as a lens blurs it.
        let grain = |u: usize, v: usize| {
            let at = |du: usize, dv: usize| white[(v + dv).min(height - 1) * width + (u + du).min(width - 1)];
            0.5 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
        };
        let light = |u: f64, v: f64| {
            let lines = bell(u, v, 30.3, 0.02) + bell(u, v, 80.7, -0.03) + 0.3 * bell(u, v, 120.2, 0.02);
            4.0 + 180.0 * lines * (1.0 + contrast * grain(u as usize, v as usize)).max(0.0)
        };
        let found = steger(&Scene { size: (width, height), light: &light, noise: 1.0 }.eight());
        let truths = [(30.3, 0.02), (80.7, -0.03), (120.2, 0.02)];
        let mut square = 0.0;
        let points = points(&found);
        for p in &points {
            let miss = truths.map(|(v0, slope)| (p.v_px - v0 - slope * p.u_px) * p.normal[1]);
            let nearest = miss.iter().copied().min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
            square += (nearest / p.sigma_px).powi(2);
        }
        let rms = (square / points.len() as f64).sqrt();
        assert!(points.len() > 3 * width - 20, "contrast {contrast}: {} points", points.len());
        // 1800 points in stretches of a dozen sharing their noise: 150 independent ones know the RMS to 6 %.
        assert!((0.8..1.25).contains(&rms), "contrast {contrast}: RMS of error over sigma {rms}");
    }
}
