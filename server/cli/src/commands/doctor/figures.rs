//! Figures of frames and pictures: functions of what was seen.

use calibration::BoardGeometry;
use nalgebra::Vector2;
use vision::{BoardCorners, DarkFrameAccumulator, GreyImage};

/// Rate and steadiness of a free run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Exposures per second; those that were lost count.
    pub rate_hz: f64,
    /// Standard deviation of the frames' times about that rate, µs.
    pub jitter_us: f64,
}

/// Rate and steadiness from the times of frames, s. Frames may be missing: each is numbered by the nearest multiple of the
/// median interval after the one before it.
///
/// `None` with fewer than three frames, or without time between them.
pub fn rate(times_s: &[f64]) -> Option<Rate> {
    let mut intervals: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_by(f64::total_cmp);
    let period = *intervals.get(intervals.len() / 2)?;
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

/// Mean level and noise of a pixel over pictures of the same scene, percent of full scale; `None` with fewer than two, or
/// of different sizes.
pub fn dark(pictures: &[&GreyImage]) -> Option<(f64, f64)> {
    let first = pictures.first()?;
    if pictures.len() < 2 || pictures.iter().any(|picture| !is_alike(picture, first)) {
        return None;
    }
    let n = pictures.len() as f64;
    let (mut level, mut variance) = (0.0, 0.0);
    for (u, v) in pixels(first) {
        let values = pictures.iter().map(|picture| f64::from(picture.at(u, v)));
        let (sum, squares) =
            values.fold((0.0, 0.0), |(sum, squares), value| (sum + value, squares + value * value));
        level += sum / n;
        variance += (squares - sum * sum / n) / (n - 1.0);
    }
    let n_pixels = (first.width() * first.height()) as f64;
    let percent = 100.0 / f64::from(first.full_scale());
    Some((level / n_pixels * percent, (variance / n_pixels).max(0.0).sqrt() * percent))
}

/// What a dark frame of some pictures says about the sensor, percent of full scale.
#[derive(Debug, Clone, Copy)]
pub struct Dark {
    /// Noise of a pixel that is not hot.
    pub noise_percent: f64,
    /// Standard deviation of the fixed pattern.
    pub pattern_percent: f64,
    pub n_hot_pixels: usize,
    /// Hot pixels, share of all.
    pub hot_share: f64,
}

/// The dark frame of pictures; `None` if they are too few or show light.
pub fn dark_frame(pictures: &[&GreyImage]) -> Option<Dark> {
    let mut frames = DarkFrameAccumulator::default();
    pictures.iter().try_for_each(|picture| frames.add(picture)).ok()?;
    let dark = frames.finish().ok()?;
    let (figures, n_hot_pixels) = (dark.statistics(), dark.hot_pixels().len());
    let percent = 100.0 / f64::from(pictures.first()?.full_scale());
    Some(Dark {
        noise_percent: figures.noise * percent,
        pattern_percent: figures.pattern * percent,
        n_hot_pixels,
        hot_share: n_hot_pixels as f64 / (dark.width() * dark.height()) as f64,
    })
}

/// A scene with the laser on and off at one exposure.
#[derive(Debug)]
pub struct Pair<'p> {
    pub exposure_us: f64,
    pub lit: &'p GreyImage,
    pub dark: &'p GreyImage,
}

impl Pair<'_> {
    /// What the laser adds to a pixel.
    fn light(&self, u: usize, v: usize) -> f64 {
        f64::from(self.lit.at(u, v)) - f64::from(self.dark.at(u, v))
    }
}

/// The pixels whose light at this exposure lies between two shares of full scale, percent; none saturated.
pub fn responding(pair: &Pair, (least, most): (f64, f64)) -> Vec<(usize, usize)> {
    let full = f64::from(pair.lit.full_scale());
    let responds = |&(u, v): &(usize, usize)| {
        let share = 100.0 * pair.light(u, v) / full;
        (least..=most).contains(&share) && 100.0 * f64::from(pair.lit.at(u, v)) <= most * full
    };
    pixels(pair.lit).filter(responds).collect()
}

/// By how much the light at the exposure of `other` deviates from that of `full` in proportion to time, percent, summed over
/// pixels; `None` without light.
pub fn nonlinearity_percent(full: &Pair, other: &Pair, pixels: &[(usize, usize)]) -> Option<f64> {
    let light = |pair: &Pair| pixels.iter().map(|&(u, v)| pair.light(u, v)).sum::<f64>();
    let expected = light(full) * other.exposure_us / full.exposure_us;
    (expected > 0.0).then(|| 100.0 * (light(other) / expected - 1.0))
}

/// How much of the laser's light in `pair` is left in `after`, percent, summed over pixels; `None` without light.
pub fn light_left_percent(pair: &Pair, after: &GreyImage, pixels: &[(usize, usize)]) -> Option<f64> {
    let light = pixels.iter().map(|&(u, v)| pair.light(u, v)).sum::<f64>();
    let left = Pair { lit: after, ..*pair };
    let left = pixels.iter().map(|&(u, v)| left.light(u, v)).sum::<f64>();
    (light > 0.0).then(|| 100.0 * left / light)
}

/// The way of a board between two pictures, in its own plane, mm: mean over its corners, and their scatter.
///
/// The first picture gives the mapping from the board to pixels; where a corner lies in the second is looked up in it.
/// What moves out of the board's plane is not seen. The lens is taken to be straight. `None` with fewer than eight corners
/// in common, or if they do not lie on a plane.
pub fn way_of_board(before: &BoardCorners, after: &BoardCorners, geometry: &BoardGeometry) -> Option<(f64, f64)> {
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
    let ways: Vec<Vector2<f64>> = board_after
        .iter()
        .zip(&pixels_after)
        .map(|(board, pixel)| {
            let seen = board_from_pixel * pixel.push(1.0);
            seen.xy() / seen.z - board
        })
        .collect();
    let mean = ways.iter().sum::<Vector2<f64>>() / ways.len() as f64;
    let variance = ways.iter().map(|way| (way - mean).norm_squared()).sum::<f64>() / ways.len() as f64;
    Some((mean.norm(), variance.sqrt()))
}

fn pixels(image: &GreyImage) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (width, height) = (image.width(), image.height());
    (0..height).flat_map(move |v| (0..width).map(move |u| (u, v)))
}

/// Whether two pictures can be compared pixel by pixel.
pub fn is_alike(a: &GreyImage, b: &GreyImage) -> bool {
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
    fn a_steady_camera_has_its_rate_whatever_is_missing() {
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
    fn jitter_is_the_scatter_of_the_times() {
        // Every other frame 0.3 ms late: ±0.15 ms about a steady rate.
        let times: Vec<f64> =
            (0..200).map(|n| f64::from(n) * 0.02 + if n % 2 == 0 { 3e-4 } else { 0.0 }).collect();
        let found = rate(&times).unwrap();
        // Two fitted numbers of two hundred make half a percent.
        assert!((found.jitter_us - 150.0).abs() < 2.0 && (found.rate_hz - 50.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn noise_is_what_changes_from_picture_to_picture() {
        // A pattern that stays, and ±2 levels that change: σ of two values four apart is √8 levels.
        let (a, b) = (image(|at| 20 + (at % 50) as u8), image(|at| 24 + (at % 50) as u8));
        let (level, noise) = dark(&[&a, &b]).unwrap();
        assert!((noise - 8.0_f64.sqrt() / 2.55).abs() < 1e-9, "{noise}");
        assert!((level - (22.0 + 24.5) / 2.55).abs() < 1e-9, "{level}");
        assert_eq!(dark(&[&a]), None);
    }

    /// A scene of many brightnesses under light, by a response curve.
    fn scene(exposure: f64, response: impl Fn(f64) -> f64) -> GreyImage {
        image(|at| (255.0 * response(at as f64 / 400.0 * exposure)).round() as u8)
    }

    #[test]
    fn a_response_in_proportion_to_time_has_no_nonlinearity_and_a_gamma_curve_has() {
        let dark = image(|_| 0);
        for (gamma, expected) in [(1.0, 0.0), (2.2, 100.0 * (0.25_f64.powf(1.0 / 2.2) / 0.25 - 1.0))] {
            let picture = |exposure| scene(exposure, |light| light.powf(1.0 / gamma));
            let (long, short) = (picture(1.0), picture(0.25));
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
    fn light_that_is_left_is_a_share_of_what_there_was() {
        let (dark, lit, after) = (image(|_| 10), image(|_| 110), image(|_| 30));
        let pair = Pair { exposure_us: 1000.0, lit: &lit, dark: &dark };
        let pixels = responding(&pair, (15.0, 85.0));
        assert_eq!(light_left_percent(&pair, &after, &pixels), Some(20.0));
        assert_eq!(light_left_percent(&pair, &after, &[]), None);
    }

    /// Corners of a board seen aslant, moved by `way_mm` in its plane.
    fn seen(way_mm: Vector2<f64>) -> BoardCorners {
        let corner = |row: usize, column: usize| {
            let at = Vector2::new(column as f64, row as f64) * 12.0 + way_mm;
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
    fn the_way_of_a_board_is_that_in_its_plane_however_it_is_seen() {
        let way = Vector2::new(9.0, -4.0);
        let (length, scatter) = way_of_board(&seen(Vector2::zeros()), &seen(way), &BOARD).unwrap();
        assert!((length - way.norm()).abs() < 1e-6 && scatter < 1e-6, "{length} {scatter}");
        let few = BoardCorners { corners: seen(way).corners[..7].to_vec(), ..seen(way) };
        assert_eq!(way_of_board(&few, &seen(way), &BOARD), None);
    }
}
