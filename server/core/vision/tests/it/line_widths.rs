//! Lines as wide as their light: from 2 to 40 px, side by side, changing along the line, steep.
//! What this does not show: light that is not a bell across the line.

use rand::{Rng as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use vision::{CentrelineParams, Centrelines, GreyImage, Pixels, find_centrelines};

const WIDTH: usize = 1024;
const HEIGHT: usize = 768;
/// Grey levels of the darkness, of a line's middle, and of the noise.
const DARK: f64 = 8.0;
const BRIGHT: f64 = 140.0;
const NOISE: f64 = 2.0;
/// Contrast of the speckle.
const SPECKLE: f64 = 0.28;

/// A line across the picture.
struct Line {
    /// Row of the middle by column, and its slope.
    row: fn(f64, f64) -> (f64, f64),
    /// What the row depends on besides.
    at: f64,
    /// Full width at half height across the line by column, px.
    fwhm: Box<dyn Fn(f64) -> f64>,
    /// Columns that it has.
    columns: std::ops::Range<usize>,
}

fn level(u: f64, at: f64) -> (f64, f64) {
    (at + 0.01 * u, 0.01)
}

fn line(at: f64, fwhm: impl Fn(f64) -> f64 + 'static) -> Line {
    Line { row: level, at, fwhm: Box::new(fwhm), columns: 0..WIDTH }
}

fn picture(lines: &[Line], seed: u64) -> GreyImage {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut grey = vec![DARK; WIDTH * HEIGHT];
    for line in lines {
        for u in line.columns.clone() {
            let (row, slope) = (line.row)(u as f64, line.at);
            let sigma = (line.fwhm)(u as f64) / 2.354_82 * (1.0 + slope * slope).sqrt();
            let from = (row - 5.0 * sigma).max(0.0) as usize;
            for v in from..((row + 5.0 * sigma).max(0.0) as usize).min(HEIGHT) {
                grey[v * WIDTH + u] += BRIGHT * (-0.5 * ((v as f64 - row) / sigma).powi(2)).exp();
            }
        }
    }
    let speckle = speckle(&mut rng);
    let pixels = grey.iter().zip(speckle).map(|(level, speckle)| {
        let level = DARK + (level - DARK) * speckle;
        let noise = normal(&mut rng);
        (level + noise * (NOISE * NOISE + 0.02 * level).sqrt()).round().clamp(0.0, 255.0) as u8
    });
    GreyImage::new(WIDTH, HEIGHT, Pixels::Eight(pixels.collect())).unwrap()
}

fn normal(rng: &mut Pcg64Mcg) -> f64 {
    (0..12).map(|_| rng.random_range(-0.5..0.5)).sum()
}

/// A factor for every pixel: mean 1, standard deviation [`SPECKLE`], shared by neighbours two pixels apart.
fn speckle(rng: &mut Pcg64Mcg) -> Vec<f64> {
    let white: Vec<f64> = (0..WIDTH * HEIGHT).map(|_| normal(rng)).collect();
    let near = |idx: usize| {
        let (u, v) = (idx % WIDTH, idx / WIDTH);
        let sum: f64 = [0, 1]
            .iter()
            .flat_map(|dv| [0, 1].map(|du| white[(v + dv).min(HEIGHT - 1) * WIDTH + (u + du).min(WIDTH - 1)]))
            .sum();
        (1.0 + SPECKLE * sum / 2.0).max(0.0)
    };
    (0..WIDTH * HEIGHT).map(near).collect()
}

/// What was found of a line.
#[derive(Debug)]
struct Found {
    /// Share of the columns with a point.
    share: f64,
    /// Columns with more than one.
    twice: usize,
    /// Root mean square of the error by σ.
    rms_sigmas: f64,
    /// Median of found by true width.
    width: f64,
}

/// Points within half a width of the line are its own.
fn found(lines: &Centrelines, line: &Line) -> Found {
    let (mut n, mut n_found, mut twice) = (0, 0, 0usize);
    let (mut sigmas, mut widths) = (0.0, Vec::new());
    for u in line.columns.clone() {
        let (row, slope) = (line.row)(u as f64, line.at);
        let (fwhm, across) = ((line.fwhm)(u as f64), 1.0 / (1.0 + slope * slope).sqrt());
        let reach = 2.0 * fwhm / across;
        if row < reach || row + reach > HEIGHT as f64 - 1.0 {
            continue;
        }
        n += 1;
        let points =
            lines.segments.iter().flat_map(|segment| &segment.points).filter(|point| {
                point.u_px == u as f64 && (point.v_px - row).abs() * across < 0.75 * fwhm.max(3.0)
            });
        let points: Vec<_> = points.collect();
        n_found += usize::from(!points.is_empty());
        twice += usize::from(points.len() > 1);
        for point in points {
            let error_px = (point.v_px - row) * across;
            sigmas += (error_px / point.sigma_px).powi(2);
            widths.push(f64::from(point.width_px) / fwhm);
        }
    }
    let n_points = widths.len().max(1) as f64;
    widths.sort_by(f64::total_cmp);
    Found {
        share: n_found as f64 / f64::max(n as f64, 1.0),
        twice,
        rms_sigmas: (sigmas / n_points).sqrt(),
        width: widths.get(widths.len() / 2).copied().unwrap_or(f64::NAN),
    }
}

fn centrelines(lines: &[Line], seed: u64) -> Centrelines {
    find_centrelines(&picture(lines, seed), &CentrelineParams::default())
}

/// Pictures of one scene, of which each has noise and speckle of its own.
const PICTURES: u64 = 4;

/// Asserts that of every line at least `share` is found, each column once, that σ is honest and that nothing else is found.
#[track_caller]
fn assert_found(name: &str, lines: &[Line], share: f64) {
    assert_found_within(name, lines, share, 0.8..1.25);
}

/// [`assert_found`] with the errors by σ that are honest.
#[track_caller]
fn assert_found_within(name: &str, lines: &[Line], share: f64, honest: std::ops::Range<f64>) {
    let (mut least, mut squares, mut n_points, mut n_own, mut n_twice) = (1.0f64, 0.0, 0, 0.0, 0);
    let mut widths = Vec::new();
    for seed in 0..PICTURES {
        let of_picture = centrelines(lines, seed);
        n_points += of_picture.segments.iter().map(|segment| segment.points.len()).sum::<usize>();
        for line in lines {
            let found = found(&of_picture, line);
            let n_columns = found.share * line.columns.len() as f64;
            least = least.min(found.share);
            squares += found.rms_sigmas.powi(2) * n_columns;
            n_own += n_columns;
            n_twice += found.twice;
            widths.push(found.width);
        }
    }
    let by_sigma = (squares / n_own).sqrt();
    widths.sort_by(f64::total_cmp);
    eprintln!(
        "{name}: {least:.3} found, {n_twice} twice, error {by_sigma:.2} σ, widths {:.2}–{:.2}, {n_points} points, {n_own} on lines",
        widths[0],
        widths[widths.len() - 1]
    );
    assert!(least >= share, "{name}: {least} of a line");
    assert_eq!(n_twice, 0, "{name}");
    assert!(honest.contains(&by_sigma), "{name}: error {by_sigma} σ");
    assert!(n_points as f64 <= n_own * 1.01 + 10.0, "{name}: {n_points} points, {n_own} on lines");
}

#[test]
fn lines_of_one_width_are_found_from_2_to_40_px() {
    for fwhm in [2.0, 3.0, 5.0, 8.0, 12.0, 16.0, 24.0, 32.0, 40.0] {
        let lines = [150.0, 380.0, 600.0].map(|at| line(at, move |_| fwhm));
        assert_found(&format!("{fwhm} px"), &lines, 0.98);
    }
}

#[test]
fn lines_of_different_widths_are_found_side_by_side() {
    let widths = [3.0, 11.0, 5.0, 34.0, 2.5, 20.0];
    let lines: Vec<Line> =
        widths.iter().enumerate().map(|(idx, &fwhm)| line(60.0 + 120.0 * idx as f64, move |_| fwhm)).collect();
    assert_found("side by side", &lines, 0.96);
}

#[test]
fn a_line_may_change_its_width() {
    let growing = [120.0, 380.0, 640.0].map(|at| line(at, |u| 3.0 + 27.0 * u / WIDTH as f64));
    assert_found("growing", &growing, 0.97);
}

#[test]
fn a_narrow_base_line_with_wide_lines_on_blocks_is_whole() {
    // As on gauge blocks: the line jumps to other rows and is three times wider there.
    let mut lines = Vec::new();
    for (idx, from) in [100, 400, 700].into_iter().enumerate() {
        lines.push(Line { columns: from..from + 160, ..line(200.0 + 60.0 * idx as f64, |_| 10.5) });
    }
    for (from, to) in [(0, 100), (260, 400), (560, 700), (860, WIDTH)] {
        lines.push(Line { columns: from..to, ..line(560.0, |_| 3.0) });
    }
    assert_found("blocks", &lines, 0.93);
}

#[test]
fn steep_lines_are_found_up_to_75_degrees() {
    for fwhm in [3.0, 4.0, 8.0, 12.0] {
        for degrees in [30.0f64, 45.0, 60.0, 70.0, 75.0] {
            let slope = degrees.to_radians().tan();
            let columns = WIDTH / 2..WIDTH / 2 + (600.0 / slope).min(500.0) as usize;
            let mut steep = line(slope, move |_| fwhm);
            steep.row = |u, slope| (80.0 + slope * (u - (WIDTH / 2) as f64), slope);
            steep.columns = columns;
            // Speckle is finer than a steep line's window along its columns: σ errs on the large side.
            assert_found_within(&format!("{fwhm} px, {degrees}°"), &[steep], 0.92, 0.7..1.25);
        }
    }
}
