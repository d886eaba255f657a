//! The results of a station, compared with its truth.

use std::collections::HashMap;
use std::path::Path;

use calibration::CalibrationOptions;
use metrology::{MeasureRequest, Tool, measure};
use nalgebra::Vector2;
use optics::Calibration;
use pipeline::{Failure, calibrate_features, open_capture, read_features, scan_capture};
use scanning::CloudPoint;
use vision::LineDirection;

use super::station::Station;
use crate::warnings::WarningCollector;

/// Largest distance of a point on a true line, relative to the line's σ, at least a pixel: wide lines are cut at edges.
const ON_LINE_SIGMAS: f64 = 1.25;
/// Columns on either side in which a true line counts as well, since its end is not known to the pixel.
const MARGIN_COLUMNS: i64 = 4;

/// A true line in one scan column (row).
struct TrueLine {
    frame: u32,
    order: i8,
    pixel: Vector2<f64>,
    z_mm: f64,
}

/// Results of one station.
#[derive(Debug, Default)]
pub struct Outcome {
    /// RMS depth error of noise-free pixels, and the calibration's prediction.
    pub model_mm: f64,
    pub predicted_mm: f64,
    pub light_rms_px: f64,
    pub corner_sigma_px: f64,
    pub n_true: usize,
    pub n_found: usize,
    pub n_points: usize,
    pub n_wrong: usize,
    pub n_astray: usize,
    pub ball_error_mm: f64,
    pub ball_u_mm: f64,
    pub notes: Vec<String>,
}

impl Outcome {
    pub const HEADER: &str =
        "model (predicted) µm, light px, corner px, complete %, wrong, astray of points, ball ± U µm";

    pub fn complete(&self) -> f64 {
        self.n_found as f64 / self.n_true as f64
    }

    pub fn wrong(&self) -> f64 {
        self.n_wrong as f64 / self.n_points as f64
    }

    /// Renders, calibrates, scans and measures.
    pub fn of(station: &Station) -> Result<Self, String> {
        let folder = tempfile::tempdir().unwrap();
        let capture = folder.path().join("capture");
        let proceed = |_| std::ops::ControlFlow::Continue(());
        twin::capture_folder(&station.model, &station.request(), &capture, &proceed).unwrap();
        let warnings = WarningCollector::default();
        Self::of_capture(station, &capture, &warnings)
            .map_err(|failure| format!("{failure}; {:?}", warnings.0.lock().unwrap()))
    }

    fn of_capture(station: &Station, folder: &Path, warnings: &WarningCollector) -> Result<Self, Failure> {
        let capture = open_capture(folder, warnings)?;
        let features = read_features(&capture, false, warnings)?;
        let calibrated = calibrate_features(&capture, &features, &CalibrationOptions::default(), warnings)?;
        let calibration = calibrated.document.calibration();
        let report = &calibrated.result.report;
        let light = report.light.as_ref().unwrap();
        let truth = true_lines(&folder.join("truth-sphere.csv"));
        let mut outcome = Self {
            model_mm: model_rms_mm(&calibration, &truth),
            predicted_mm: light.systematic_sigma_mm,
            light_rms_px: light.rms_px,
            corner_sigma_px: report.camera.corner_sigma_px,
            ..Self::default()
        };
        let scan = scan_capture(&capture, &calibrated.document, "sphere", warnings)?;
        outcome.score(station, &scan.cloud.points, &truth);
        if std::env::var_os("EXPLAIN").is_some() {
            eprintln!("{:?}", scan.report.dropped);
        }
        let nominal_mm = station.ball_mm;
        let request = MeasureRequest { nominal_mm: Some(nominal_mm), ..MeasureRequest::new(Tool::Sphere) };
        let ball = measure(&scan.cloud, Some(&calibration), &request)?;
        outcome.ball_error_mm = ball.value - nominal_mm;
        outcome.ball_u_mm = ball.expanded_uncertainty;
        outcome.notes = warnings.0.lock().unwrap().clone();
        outcome.notes.extend(ball.missing.iter().map(|missing| format!("{missing:?}")));
        outcome.notes.extend(ball.findings.iter().map(|finding| format!("{finding:?}")));
        Ok(outcome)
    }

    /// Compares the points of every frame with truth.
    fn score(&mut self, station: &Station, points: &[CloudPoint], truth: &[TrueLine]) {
        let rows = station.model.shape.line_direction == LineDirection::Rows;
        let place = |u: f64, v: f64| if rows { (u.round() as i64, v) } else { (v.round() as i64, u) };
        let on_line_px = (ON_LINE_SIGMAS * station.model.shape.line_sigma_px).max(1.0);
        let mut lines: HashMap<(u32, i64), Vec<(i8, f64)>> = HashMap::new();
        for line in truth {
            let (along, across) = place(line.pixel.x, line.pixel.y);
            lines.entry((line.frame, along)).or_default().push((line.order, across));
        }
        let mut found: HashMap<(u32, i64), Vec<(i8, f64)>> = HashMap::new();
        for point in points
            .iter()
            .filter(|point| (point.frame as usize).is_multiple_of(twin::capture_folder::TRUTH_EVERY_FRAMES))
        {
            let (along, across) = place(f64::from(point.u_px), f64::from(point.v_px));
            found.entry((point.frame, along)).or_default().push((point.order, across));
            let near: Vec<i8> = (along - MARGIN_COLUMNS..=along + MARGIN_COLUMNS)
                .filter_map(|along| lines.get(&(point.frame, along)))
                .flatten()
                .filter(|line| (line.1 - across).abs() < on_line_px)
                .map(|line| line.0)
                .collect();
            self.n_points += 1;
            self.n_astray += usize::from(near.is_empty());
            self.n_wrong += usize::from(!near.is_empty() && !near.contains(&point.order));
        }
        let is_found = |place: &(u32, i64), line: &(i8, f64)| {
            found.get(place).is_some_and(|found| {
                found.iter().any(|point| point.0 == line.0 && (point.1 - line.1).abs() < on_line_px)
            })
        };
        self.n_true = truth.len();
        self.n_found = lines
            .iter()
            .map(|(place, of_place)| of_place.iter().filter(|line| is_found(place, line)).count())
            .sum();
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:.1} ({:.1}) µm, {:.3} px, {:.4} px, {:.2} %, {} wrong, {} astray of {}, ball {:+.1} ± {:.1} µm, {:?}",
            1e3 * self.model_mm,
            1e3 * self.predicted_mm,
            self.light_rms_px,
            self.corner_sigma_px,
            100.0 * self.complete(),
            self.n_wrong,
            self.n_astray,
            self.n_points,
            1e3 * self.ball_error_mm,
            1e3 * self.ball_u_mm,
            self.notes
        )
    }
}

fn true_lines(path: &Path) -> Vec<TrueLine> {
    let table = std::fs::read_to_string(path).unwrap();
    let line = |row: &str| {
        let values: Vec<f64> = row.split(',').map(|word| word.parse().unwrap()).collect();
        TrueLine {
            frame: values[0] as u32,
            order: values[1] as i8,
            pixel: Vector2::new(values[2], values[3]),
            z_mm: values[6],
        }
    };
    table.lines().skip(1).map(line).collect()
}

fn model_rms_mm(calibration: &Calibration, truth: &[TrueLine]) -> f64 {
    let error = |line: &TrueLine| {
        let hit = calibration.triangulate(line.order, &line.pixel, None)?;
        Some((hit.hit_in_camera.xyz.z - line.z_mm).powi(2))
    };
    let squares: Vec<f64> = truth.iter().filter_map(error).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}
