//! Dark frames of a synthetic sensor with known defects. Amplifier glow, temperature and the noise tails of real
//! sensors are not covered.

use rand::{Rng as _, SeedableRng as _};
use rand_pcg::Pcg64;

use super::*;
use crate::{CentrelineParams, CentrelinePoint, GreyImage, Pixels, find_centrelines};

const SIZE: (usize, usize) = (320, 240);

/// Read noise of the synthetic sensor, levels of 255.
const NOISE: f64 = 1.5;

/// Peak of the laser line, levels.
const LINE: f64 = 120.0;

/// A sensor with hot pixels, two bright rows and a fixed column pattern.
struct Sensor {
    offsets: Vec<f64>,
    hot: Vec<usize>,
    random: Pcg64,
}

impl Sensor {
    fn new() -> Self {
        let mut random = Pcg64::seed_from_u64(5);
        let columns: Vec<f64> = (0..SIZE.0).map(|_| 2.0 * gauss(&mut random)).collect();
        // Two bright rows side by side look like a laser line.
        let row = |v: usize| if v == 60 || v == 61 { 30.0 } else { 0.0 };
        let mut offsets: Vec<f64> = (0..SIZE.0 * SIZE.1).map(|i| columns[i % SIZE.0] + row(i / SIZE.0)).collect();
        let hot: Vec<usize> = (0..60).map(|_| random.random_range(0..offsets.len())).collect();
        hot.iter().for_each(|&idx| offsets[idx] += 100.0);
        Self { offsets, hot, random }
    }

    fn capture(&mut self, light: impl Fn(f64, f64) -> f64) -> GreyImage {
        let offsets = &self.offsets;
        let random = &mut self.random;
        let level = |idx: usize| {
            let level = 12.0 + offsets[idx] + light((idx % SIZE.0) as f64, (idx / SIZE.0) as f64);
            (level + NOISE * gauss(random)).round().clamp(0.0, 255.0) as u8
        };
        GreyImage::new(SIZE.0, SIZE.1, Pixels::Eight((0..offsets.len()).map(level).collect())).unwrap()
    }

    fn dark_frame(&mut self) -> DarkFrame {
        let mut frames = DarkFrameAccumulator::default();
        (0..32).for_each(|_| frames.add(&self.capture(|_, _| 0.0)).unwrap());
        frames.finish().unwrap()
    }
}

/// Unit Gaussian (sum of twelve).
fn gauss(random: &mut Pcg64) -> f64 {
    (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
}

/// The row of the laser line in a column.
fn line_row(u: f64) -> f64 {
    150.0 + 0.1 * u
}

fn line(u: f64, v: f64) -> f64 {
    LINE * (-0.5 * ((v - line_row(u)) / 2.0).powi(2)).exp()
}

fn points(image: &GreyImage) -> Vec<CentrelinePoint> {
    let found = find_centrelines(image, &CentrelineParams::default());
    found.segments.into_iter().flat_map(|segment| segment.points).collect()
}

fn corrected(image: &GreyImage, dark: &DarkFrame) -> GreyImage {
    let mut image = image.clone();
    dark.correct(&mut image, (0, 0), LineDirection::Rows, Correction::Full).unwrap();
    image
}

/// Distance from the line along its normal.
fn error_px(point: &CentrelinePoint) -> f64 {
    (point.v_px - line_row(point.u_px)) / 0.1_f64.hypot(1.0)
}

#[test]
fn the_hot_pixels_and_the_pattern_match_the_simulated_sensor() {
    let mut sensor = Sensor::new();
    let dark = sensor.dark_frame();
    let mut hot: Vec<usize> = sensor.hot.clone();
    hot.sort_unstable();
    hot.dedup();
    let found: Vec<usize> = dark.hot_pixels().map(|(u, v)| v * SIZE.0 + u).collect();
    assert_eq!(found, hot);
    let statistics = dark.statistics();
    assert!((statistics.noise / NOISE.hypot((1.0_f64 / 12.0).sqrt()) - 1.0).abs() < 0.02, "{statistics:?}");
    let good = (0..dark.pattern.len()).filter(|idx| hot.binary_search(idx).is_err());
    let off = good.map(|idx| (f64::from(dark.pattern[idx]) + statistics.level - 12.0 - sensor.offsets[idx]).abs());
    // Half a level of rounding and five standard deviations of a mean of 32.
    assert!(off.fold(0.0, f64::max) < 0.5 + 5.0 * statistics.noise / 32.0_f64.sqrt() + 0.5);
}

#[test]
fn bright_rows_and_hot_pixels_give_false_lines_only_without_a_dark_frame() {
    let mut sensor = Sensor::new();
    let dark = sensor.dark_frame();
    let image = sensor.capture(line);
    let is_false = |point: &&CentrelinePoint| error_px(point).abs() > 1.0;
    let before = points(&image);
    assert!(before.iter().filter(is_false).count() > SIZE.0 / 2, "{}", before.len());
    let after = points(&corrected(&image, &dark));
    assert_eq!(after.iter().filter(is_false).count(), 0);
    assert!(after.len() >= SIZE.0 - 2, "{} of {}", after.len(), SIZE.0);
}

/// RMS over twenty frames of the errors over their standard deviations.
fn whitened(frame: &mut dyn FnMut() -> GreyImage) -> f64 {
    let errors: Vec<f64> =
        (0..20).flat_map(|_| points(&frame())).map(|point| error_px(&point) / point.sigma_px).collect();
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn the_sigmas_of_corrected_frames_are_as_realistic_as_those_of_an_ideal_sensor() {
    let mut ideal = Sensor { offsets: vec![0.0; SIZE.0 * SIZE.1], hot: Vec::new(), ..Sensor::new() };
    let mut defective = Sensor::new();
    let dark = defective.dark_frame();
    let of_ideal = whitened(&mut || ideal.capture(line));
    let of_defective = whitened(&mut || corrected(&defective.capture(line), &dark));
    // The rounding of the pattern adds 0.29 levels to a noise of 1.5.
    assert!(
        (of_defective / of_ideal - 1.0).abs() < 0.15,
        "{of_defective:.2} of the defective sensor, {of_ideal:.2} of the ideal one"
    );
    assert!(of_defective < 1.0, "{of_defective:.2}");
}

#[test]
fn a_flickering_pixel_is_hot_although_its_mean_is_normal() {
    let mut frames = DarkFrameAccumulator::default();
    let mut random = Pcg64::seed_from_u64(3);
    for n in 0..32 {
        let mut levels: Vec<u8> = (0..64 * 64).map(|_| (10.0 + 1.5 * gauss(&mut random)).round() as u8).collect();
        levels[70] = if n % 8 == 0 { 18 } else { 9 };
        frames.add(&GreyImage::new(64, 64, Pixels::Eight(levels)).unwrap()).unwrap();
    }
    let dark = frames.finish().unwrap();
    assert_eq!(dark.hot_pixels().collect::<Vec<_>>(), [(6, 1)]);
}

#[test]
fn an_ideal_sensor_has_no_hot_pixels() {
    for noise in [0.0, 0.2, 1.0, 3.0] {
        let mut random = Pcg64::seed_from_u64(9);
        let mut frames = DarkFrameAccumulator::default();
        for _ in 0..16 {
            let levels = (0..200 * 200).map(|_| (10.4 + noise * gauss(&mut random)).round() as u8).collect();
            frames.add(&GreyImage::new(200, 200, Pixels::Eight(levels)).unwrap()).unwrap();
        }
        assert_eq!(frames.finish().unwrap().hot_pixels().len(), 0, "noise {noise}");
    }
}

#[test]
fn frames_that_show_a_scene_are_refused() {
    let averaged = |light: fn(f64, f64) -> f64| {
        let mut sensor = Sensor::new();
        let mut frames = DarkFrameAccumulator::default();
        (0..8).for_each(|_| frames.add(&sensor.capture(light)).unwrap());
        frames.finish().map(drop)
    };
    assert_eq!(averaged(|_, _| 0.0), Ok(()));
    assert!(matches!(averaged(|u, _| if u < 100.0 { 12.0 } else { 0.0 }), Err(DarkFrameError::Lit { .. })));
    assert!(matches!(averaged(|_, _| 60.0), Err(DarkFrameError::Lit { .. })));
}

#[test]
fn a_region_of_interest_is_corrected_by_its_part_of_the_dark_frame_and_saturation_is_kept() {
    let mut pattern = vec![0; 16];
    pattern[6] = 3;
    let statistics = DarkFrameStatistics {
        n_frames: 8,
        bit_depth: 8,
        level: 10.0,
        noise: 1.0,
        pattern: 1.0,
        hot_above: 5.0,
        hot_noise_above: 3.0,
    };
    let dark = DarkFrame { width: 4, height: 4, statistics, pattern, hot: vec![10] };
    let region = |levels: [u8; 6]| GreyImage::new(3, 2, Pixels::Eight(levels.to_vec())).unwrap();
    let mut image = region([50, 50, 50, 50, 200, 60]);
    dark.correct(&mut image, (1, 1), LineDirection::Rows, Correction::Full).unwrap();
    // Column 2, row 1 of the sensor has a pattern of 3; the hot one below it lies between 50 and 60.
    assert_eq!(image, region([50, 47, 50, 50, 55, 60]));
    let mut saturated = region([0, 255, 0, 0, 0, 0]);
    dark.correct(&mut saturated, (1, 1), LineDirection::Rows, Correction::Full).unwrap();
    assert_eq!(saturated, region([0, 255, 0, 0, 0, 0]));
    let mut hot_only = region([50, 50, 50, 50, 200, 60]);
    dark.correct(&mut hot_only, (1, 1), LineDirection::Rows, Correction::HotPixels).unwrap();
    assert_eq!(hot_only, region([50, 50, 50, 50, 55, 60]));
    let mut beyond = region([1; 6]);
    assert_eq!(dark.correct(&mut beyond, (2, 1), LineDirection::Rows, Correction::Full), None);
}

#[test]
fn a_dark_frame_is_read_back_from_its_bytes_and_damaged_bytes_are_refused() {
    let dark = Sensor::new().dark_frame();
    let bytes = dark.to_bytes();
    assert_eq!(DarkFrame::from_bytes(SIZE.0, SIZE.1, *dark.statistics(), &bytes), Some(dark.clone()));
    for damaged in [&bytes[1..], &bytes[..bytes.len() - 1], &[]] {
        assert_eq!(DarkFrame::from_bytes(SIZE.0, SIZE.1, *dark.statistics(), damaged), None);
    }
}
