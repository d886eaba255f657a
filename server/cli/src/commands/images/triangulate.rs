//! `sheaf triangulate`: triangulates labelled raw pixels to points in the camera frame, as a stream of CSV rows.

use std::io::{BufRead, Write};

use calibration::CalibrationDocument;
use nalgebra::Vector2;
use optics::Calibration;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::arguments::TriangulateArgs;
use crate::commands::Answer;
use crate::inputs::pixel_row::{PixelRow, RowLayout};
use pipeline::Reporter;
use pipeline::read_document;
use pipeline::{Failure, FailureKind};

/// Rows per block: enough for all cores, few enough to stream.
const BLOCK_ROWS: usize = 16_384;

const OUTPUT_HEADER: &str = "order,u_px,v_px,x_mm,y_mm,z_mm,sigma_mm";

/// Counts of rows without a point.
#[derive(Debug, Default, Clone, Copy)]
struct Missed {
    rows: usize,
    unknown_order: usize,
}

/// A triangulated row: position and standard deviation along the ray, mm.
struct Point {
    xyz_mm: [f64; 3],
    sigma_mm: f64,
}

/// Reads rows from stdin and writes the same rows, in the same order, with their points.
pub fn run(args: &TriangulateArgs, json: bool, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    if !(args.pixel_sigma >= 0.0 && args.pixel_sigma.is_finite()) {
        return Err(Failure::new(
            FailureKind::BadParameter,
            "--pixel-sigma must be a number of pixels, 0 or more",
        ));
    }
    let document: CalibrationDocument = read_document(&args.calibration)?;
    let calibration = document.calibration();
    let mut lines = std::io::stdin().lock().lines();
    let header = match lines.next() {
        Some(line) => line.map_err(|error| unreadable(&error))?,
        None => String::new(),
    };
    let layout = RowLayout::from_header(&header)?;
    let mut stream = Stream::new(json)?;
    let mut missed = Missed::default();
    let mut block = Vec::with_capacity(BLOCK_ROWS);
    let mut line_number = 1;
    loop {
        block.clear();
        for line in lines.by_ref().take(BLOCK_ROWS) {
            line_number += 1;
            let line = line.map_err(|error| unreadable(&error))?;
            if !line.trim().is_empty() {
                block.push((line_number, line));
            }
        }
        if block.is_empty() {
            break;
        }
        let rows: Vec<(PixelRow, Option<Point>)> = block
            .par_iter()
            .map(|(number, line)| {
                let row = layout.parse(line, *number)?;
                let point = triangulate(&calibration, &row, args.pixel_sigma);
                Ok((row, point))
            })
            .collect::<Result<_, Failure>>()?;
        for (row, point) in &rows {
            missed.rows += usize::from(point.is_none());
            missed.unknown_order += usize::from(!calibration.orders.contains(&row.order));
        }
        if !stream.write(&rows)? {
            break;
        }
    }
    warn_missed(&missed, &calibration, reporter);
    let result = json!({ "calibration_id": calibration.id, "frame": "camera", "n_without_point": missed.rows,
        "points": stream.points });
    Ok(Answer::done(String::new(), result))
}

fn triangulate(calibration: &Calibration, row: &PixelRow, pixel_sigma_px: f64) -> Option<Point> {
    let point = calibration.triangulate(row.order, &Vector2::new(row.u_px, row.v_px), None)?;
    let systematic_mm = calibration.systematic_sigma_mm(row.order, &point)?;
    // The direction of the line in the image is not known here: noise is assumed to be equal along both axes.
    let noise_mm = point.range_by_pixel.norm() * pixel_sigma_px;
    Some(Point { xyz_mm: point.hit_in_camera.xyz.into(), sigma_mm: systematic_mm.hypot(noise_mm) })
}

fn warn_missed(missed: &Missed, calibration: &Calibration, reporter: &dyn Reporter) {
    if missed.unknown_order > 0 {
        reporter.warn(&format!(
            "rows with an order that is not in this calibration (it has {1:?}), left empty: {0}",
            missed.unknown_order, calibration.orders
        ));
    }
    let off_sheet = missed.rows.saturating_sub(missed.unknown_order);
    if off_sheet > 0 {
        reporter.warn(&format!("{off_sheet} rows do not intersect their light sheet; their fields are empty"));
    }
}

fn unreadable(error: &std::io::Error) -> Failure {
    Failure::bad_input("cannot read rows from stdin").because(error).remedy("send CSV text in UTF-8")
}

/// Output of the rows: to stdout immediately, or collected for the JSON value.
struct Stream {
    json: bool,
    points: Vec<Value>,
}

impl Stream {
    fn new(json: bool) -> Result<Self, Failure> {
        if !json {
            write_out(format!("{OUTPUT_HEADER}\n").as_bytes())?;
        }
        Ok(Self { json, points: Vec::new() })
    }

    /// Returns `false` if stdout is closed.
    fn write(&mut self, rows: &[(PixelRow, Option<Point>)]) -> Result<bool, Failure> {
        if self.json {
            self.points.extend(rows.iter().map(|(row, point)| json_row(row, point.as_ref())));
            return Ok(true);
        }
        let text: Vec<String> = rows.par_iter().map(|(row, point)| csv_row(row, point.as_ref())).collect();
        write_out(text.concat().as_bytes())
    }
}

fn csv_row(row: &PixelRow, point: Option<&Point>) -> String {
    let [order, u, v] = &row.text;
    match point {
        Some(Point { xyz_mm: [x, y, z], sigma_mm }) => {
            format!("{order},{u},{v},{x:.6},{y:.6},{z:.6},{sigma_mm:.6}\n")
        }
        None => format!("{order},{u},{v},,,,\n"),
    }
}

fn json_row(row: &PixelRow, point: Option<&Point>) -> Value {
    let (u_px, v_px) = (row.u_px, row.v_px);
    match point {
        Some(Point { xyz_mm: [x, y, z], sigma_mm }) => json!({ "order": row.order, "u_px": u_px, "v_px": v_px,
            "x_mm": x, "y_mm": y, "z_mm": z, "sigma_mm": sigma_mm }),
        None => json!({ "order": row.order, "u_px": u_px, "v_px": v_px,
            "x_mm": null, "y_mm": null, "z_mm": null, "sigma_mm": null }),
    }
}

/// Returns `false` on a closed pipe: the reader wants no more.
fn write_out(bytes: &[u8]) -> Result<bool, Failure> {
    match std::io::stdout().lock().write_all(bytes) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(Failure::new(FailureKind::Internal, "cannot write to stdout").because(&error)),
    }
}
