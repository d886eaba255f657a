//! Noise-free pixels with their true points, as written by the twin beside its captures.

use std::path::Path;

use nalgebra::Vector2;
use optics::Calibration;

use pipeline::Failure;

/// A labelled pixel and the true depth of its point, camera frame.
#[derive(Debug, Clone, Copy)]
pub struct TruePoint {
    order: i8,
    pixel: Vector2<f64>,
    z_mm: f64,
}

/// Reads `truth-<scan>.csv`.
pub fn read_truth(path: &Path) -> Result<Vec<TruePoint>, Failure> {
    let damaged = |what: String| Failure::bad_input(format!("{}: {what}", path.display())).in_file(path);
    let text = std::fs::read_to_string(path).map_err(|error| damaged("cannot be read".into()).because(&error))?;
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| {
        head.iter().position(|entry| *entry == name).ok_or_else(|| damaged(format!("has no column {name}")))
    };
    let [order, u_px, v_px, z_mm] = [column("order")?, column("u_px")?, column("v_px")?, column("z_mm")?];
    lines
        .enumerate()
        .map(|(idx, line)| {
            let fields: Vec<&str> = line.split(',').collect();
            let number = |column: usize| {
                let value = fields.get(column).and_then(|field| field.parse::<f64>().ok());
                value.ok_or_else(|| damaged(format!("line {} is not a row of numbers", idx + 2)))
            };
            Ok(TruePoint {
                order: number(order)? as i8,
                pixel: Vector2::new(number(u_px)?, number(v_px)?),
                z_mm: number(z_mm)?,
            })
        })
        .collect()
}

/// RMS depth error of a calibration on noise-free pixels, which is its systematic error, mm.
pub fn systematic_depth_rmse_mm(calibration: &Calibration, points: &[TruePoint]) -> f64 {
    let squares: Vec<f64> = points
        .iter()
        .filter_map(|point| {
            let hit = calibration.triangulate(point.order, &point.pixel, None)?;
            Some((hit.hit_in_camera.xyz.z - point.z_mm).powi(2))
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}
