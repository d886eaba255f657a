//! Figures computed from frame times and images.

use calibration::BoardGeometry;
use nalgebra::Vector2;
use statistics::median;
use vision::{BoardCorners, DarkFrameAccumulator, GreyImage};

/// Frame rate and jitter of a free run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Exposures per second, including lost ones.
    pub rate_hz: f64,
    /// Standard deviation of the frame times about a constant rate, µs.
    pub jitter_us: f64,
}

/// Frame rate and jitter from the times of frames, s, by linear regression. Frames may be missing: the distance between two
/// frames is rounded to a multiple of the median interval.
///
/// `None` with fewer than three frames, or if the median interval is not positive.
pub fn rate(times_s: &[f64]) -> Option<Rate> {
    let mut intervals: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let period = median(&mut intervals)?;
    if times_s.len() < 3 || period <= 0.0 {
        return None;
    }
    let mut number = 0.0;
    let mut numbers = vec![number];
    for pair in times_s.windows(2) {
        number += ((pair[1] - pair[0]) / period).round().max(1.0);
        numbers.push(number);
    }
    let n = times_s.len() as f64;
    let (mean_number, mean_time) = (numbers.iter().sum::<f64>() / n, times_s.iter().sum::<f64>() / n);
    let spread: f64 = numbers.iter().map(|number| (number - mean_number).powi(2)).sum();
    let points = || numbers.iter().zip(times_s);
    let slope = points().map(|(number, time)| (number - mean_number) * (time - mean_time)).sum::<f64>() / spread;
    let off = |(number, time): (&f64, &f64)| (time - mean_time - slope * (number - mean_number)).powi(2);
    // Two numbers are fitted.
    let jitter_us = (points().map(off).sum::<f64>() / (n - 2.0)).sqrt() * 1e6;
    Some(Rate { rate_hz: 1.0 / slope, jitter_us })
}

/// Mean level and temporal noise of a pixel over images of the same scene, percent of full scale; `None` with fewer than
/// two images, or if their sizes differ.
pub fn dark(images: &[&GreyImage]) -> Option<(f64, f64)> {
    let first = images.first()?;
    if images.len() < 2 || images.iter().any(|image| !same_format(image, first)) {
        return None;
    }
    let n = images.len() as f64;
    let (mut level, mut variance) = (0.0, 0.0);
    for (u, v) in pixels(first) {
        let values = images.iter().map(|image| f64::from(image.at(u, v)));
        let (sum, squares) =
            values.fold((0.0, 0.0), |(sum, squares), value| (sum + value, squares + value * value));
        level += sum / n;
        variance += (squares - sum * sum / n) / (n - 1.0);
    }
    let n_pixels = (first.width() * first.height()) as f64;
    let percent = 100.0 / f64::from(first.full_scale());
    Some((level / n_pixels * percent, (variance / n_pixels).max(0.0).sqrt() * percent))
}

/// Sensor figures from a dark frame, percent of full scale.
#[derive(Debug, Clone, Copy)]
pub struct Dark {
    /// Noise of a pixel that is not hot.
    pub noise_percent: f64,
    /// Standard deviation of the fixed pattern.
    pub pattern_percent: f64,
    /// Number of hot pixels.
    pub n_hot_pixels: usize,
    /// Fraction of hot pixels.
    pub hot_fraction: f64,
}

/// Figures of the dark frame of these images; `None` if they are too few or show light.
pub fn dark_frame(images: &[&GreyImage]) -> Option<Dark> {
    let mut frames = DarkFrameAccumulator::default();
    images.iter().try_for_each(|image| frames.add(image)).ok()?;
    let dark = frames.finish().ok()?;
    let (figures, n_hot_pixels) = (dark.statistics(), dark.hot_pixels().len());
    let percent = 100.0 / f64::from(images.first()?.full_scale());
    Some(Dark {
        noise_percent: figures.noise * percent,
        pattern_percent: figures.pattern * percent,
        n_hot_pixels,
        hot_fraction: n_hot_pixels as f64 / (dark.width() * dark.height()) as f64,
    })
}

/// Images of a scene with the laser on and off at one exposure.
#[derive(Debug)]
pub struct Pair<'p> {
    pub exposure_us: f64,
    pub lit: &'p GreyImage,
    pub dark: &'p GreyImage,
}

impl Pair<'_> {
    /// Light of the laser at a pixel, grey levels.
    fn light(&self, u: usize, v: usize) -> f64 {
        f64::from(self.lit.at(u, v)) - f64::from(self.dark.at(u, v))
    }
}

/// The unsaturated pixels whose laser light at this exposure lies between two limits, percent of full scale.
pub fn responding(pair: &Pair, (least, most): (f64, f64)) -> Vec<(usize, usize)> {
    let full = f64::from(pair.lit.full_scale());
    let responds = |&(u, v): &(usize, usize)| {
        let percent = 100.0 * pair.light(u, v) / full;
        (least..=most).contains(&percent) && 100.0 * f64::from(pair.lit.at(u, v)) <= most * full
    };
    pixels(pair.lit).filter(responds).collect()
}

/// Deviation of the light at the exposure of `other` from proportionality to that of `full`, percent, summed over pixels;
/// `None` without light.
pub fn nonlinearity_percent(full: &Pair, other: &Pair, pixels: &[(usize, usize)]) -> Option<f64> {
    let light = |pair: &Pair| pixels.iter().map(|&(u, v)| pair.light(u, v)).sum::<f64>();
    let expected = light(full) * other.exposure_us / full.exposure_us;
    (expected > 0.0).then(|| 100.0 * (light(other) / expected - 1.0))
}

/// Laser light that remains in `after`, percent of that in `pair`, summed over pixels; `None` without light.
pub fn light_left_percent(pair: &Pair, after: &GreyImage, pixels: &[(usize, usize)]) -> Option<f64> {
    let light = pixels.iter().map(|&(u, v)| pair.light(u, v)).sum::<f64>();
    let left = Pair { lit: after, ..*pair };
    let left = pixels.iter().map(|&(u, v)| left.light(u, v)).sum::<f64>();
    (light > 0.0).then(|| 100.0 * left / light)
}

/// Displacement of a board between two images, in its own plane, mm: mean over its corners, and their scatter.
///
/// The homography from the first image maps the corners of the second to the board. Motion out of the plane of the board is
/// not measured, and lens distortion is neglected. `None` with fewer than eight corners in either image, or if the
/// homography is degenerate.
pub fn board_displacement(
    before: &BoardCorners,
    after: &BoardCorners,
    geometry: &BoardGeometry,
) -> Option<(f64, f64)> {
    const FEWEST: usize = 8;
    let corners = |board: &BoardCorners| -> (Vec<Vector2<f64>>, Vec<Vector2<f64>>) {
        let corner = |corner: &vision::Corner| {
            (geometry.corner_mm(corner.column, corner.row).xy(), Vector2::new(corner.u_px, corner.v_px))
        };
        board.corners.iter().map(corner).unzip()
    };
    let (board_before, pixels_before) = corners(before);
    let (board_after, pixels_after) = corners(after);
    if board_before.len() < FEWEST || board_after.len() < FEWEST {
        return None;
    }
    let board_from_pixel = calibration::homography_from_points(&board_before, &pixels_before)?.try_inverse()?;
    let displacements: Vec<Vector2<f64>> = board_after
        .iter()
        .zip(&pixels_after)
        .map(|(board, pixel)| {
            let seen = board_from_pixel * pixel.push(1.0);
            seen.xy() / seen.z - board
        })
        .collect();
    let mean = displacements.iter().sum::<Vector2<f64>>() / displacements.len() as f64;
    let variance = displacements.iter().map(|displacement| (displacement - mean).norm_squared()).sum::<f64>()
        / displacements.len() as f64;
    Some((mean.norm(), variance.sqrt()))
}

fn pixels(image: &GreyImage) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (width, height) = (image.width(), image.height());
    (0..height).flat_map(move |v| (0..width).map(move |u| (u, v)))
}

/// Whether two images have the same size and bit depth.
pub fn same_format(a: &GreyImage, b: &GreyImage) -> bool {
    (a.width(), a.height(), a.bit_depth()) == (b.width(), b.height(), b.bit_depth())
}

#[cfg(test)]
mod tests {
    use vision::{Corner, Pixels};

    use super::*;

    fn image(pixel: impl Fn(usize) -> u8) -> GreyImage {
        GreyImage::new(20, 20, Pixels::Eight((0..400).map(pixel).collect())).unwrap()
    }

    #[test]
    fn the_rate_of_a_steady_camera_does_not_depend_on_missing_frames() {
        let all: Vec<f64> = (0..60).map(|n| 5.0 + f64::from(n) * 0.04).collect();
        let some: Vec<f64> = all.iter().enumerate().filter(|(n, _)| n % 7 != 3).map(|(_, time)| *time).collect();
        for times in [all, some] {
            let found = rate(&times).unwrap();
            assert!((found.rate_hz - 25.0).abs() < 1e-6 && found.jitter_us < 1e-3, "{found:?}");
        }
        assert_eq!(rate(&[1.0, 2.0]), None);
        assert_eq!(rate(&[1.0, 1.0, 1.0]), None);
    }

    #[test]
    fn jitter_is_the_standard_deviation_of_the_frame_times() {
        // Every other frame 0.3 ms late: ±0.15 ms about a steady rate.
        let times: Vec<f64> =
            (0..200).map(|n| f64::from(n) * 0.02 + if n % 2 == 0 { 3e-4 } else { 0.0 }).collect();
        let found = rate(&times).unwrap();
        // Two fitted parameters out of two hundred samples: half a percent.
        assert!((found.jitter_us - 150.0).abs() < 2.0 && (found.rate_hz - 50.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn noise_is_the_variation_between_images() {
        // A constant pattern, and a change of 4 levels: σ of two values four apart is √8 levels.
        let (a, b) = (image(|at| 20 + (at % 50) as u8), image(|at| 24 + (at % 50) as u8));
        let (level, noise) = dark(&[&a, &b]).unwrap();
        assert!((noise - 8.0_f64.sqrt() / 2.55).abs() < 1e-9, "{noise}");
        assert!((level - (22.0 + 24.5) / 2.55).abs() < 1e-9, "{level}");
        assert_eq!(dark(&[&a]), None);
    }

    /// A scene of many brightnesses, imaged with a response curve.
    fn scene(exposure: f64, response: impl Fn(f64) -> f64) -> GreyImage {
        image(|at| (255.0 * response(at as f64 / 400.0 * exposure)).round() as u8)
    }

    #[test]
    fn a_proportional_response_is_linear_and_a_gamma_curve_is_not() {
        let dark = image(|_| 0);
        for (gamma, expected) in [(1.0, 0.0), (2.2, 100.0 * (0.25_f64.powf(1.0 / 2.2) / 0.25 - 1.0))] {
            let image = |exposure| scene(exposure, |light| light.powf(1.0 / gamma));
            let (long, short) = (image(1.0), image(0.25));
            let full = Pair { exposure_us: 1000.0, lit: &long, dark: &dark };
            let other = Pair { exposure_us: 250.0, lit: &short, dark: &dark };
            let pixels = responding(&full, (15.0, 85.0));
            assert!(pixels.len() > 100);
            let found = nonlinearity_percent(&full, &other, &pixels).unwrap();
            // Rounding to whole levels.
            assert!((found - expected).abs() < 0.5, "γ {gamma}: {found} %, expected {expected} %");
        }
    }

    #[test]
    fn remaining_light_is_relative_to_the_light_before() {
        let (dark, lit, after) = (image(|_| 10), image(|_| 110), image(|_| 30));
        let pair = Pair { exposure_us: 1000.0, lit: &lit, dark: &dark };
        let pixels = responding(&pair, (15.0, 85.0));
        assert_eq!(light_left_percent(&pair, &after, &pixels), Some(20.0));
        assert_eq!(light_left_percent(&pair, &after, &[]), None);
    }

    /// Corners of a board in an oblique view, displaced by `shift_mm` in its plane.
    fn corners_at(shift_mm: Vector2<f64>) -> BoardCorners {
        let corner = |row: usize, column: usize| {
            let at = Vector2::new(column as f64, row as f64) * 12.0 + shift_mm;
            let depth = 1.0 + 0.002 * at.x - 0.001 * at.y;
            Corner {
                row,
                column,
                u_px: (100.0 + 5.0 * at.x + at.y) / depth,
                v_px: (80.0 + 6.0 * at.y) / depth,
                sigma_px: 0.01,
            }
        };
        let corners = (0..5).flat_map(|row| (0..8).map(move |column| corner(row, column))).collect();
        BoardCorners { inner_columns: 8, inner_rows: 5, corners }
    }

    const BOARD: BoardGeometry = BoardGeometry {
        inner_columns: 8,
        inner_rows: 5,
        square_mm: Vector2::new(12.0, 12.0),
        pattern: calibration::BoardPattern::Squares,
    };

    #[test]
    fn the_displacement_of_a_board_is_measured_in_its_plane_in_an_oblique_view() {
        let shift = Vector2::new(9.0, -4.0);
        let (length, scatter) =
            board_displacement(&corners_at(Vector2::zeros()), &corners_at(shift), &BOARD).unwrap();
        assert!((length - shift.norm()).abs() < 1e-6 && scatter < 1e-6, "{length} {scatter}");
        let few = BoardCorners { corners: corners_at(shift).corners[..7].to_vec(), ..corners_at(shift) };
        assert_eq!(board_displacement(&few, &corners_at(shift), &BOARD), None);
    }
}
