//! Checks of the manifest's values before any image is read.

use std::collections::HashSet;
use std::path::Path;

use crate::error::CaptureError;
use crate::manifest::Manifest;
use crate::params::{FORMAT, IMAGE_LIMIT_PX, LINES_MAX, ORDER_LIMIT};
use crate::projector::{COLUMNS, Projector, ROWS};
use crate::stage::{StageDescription, StageKind};
use crate::target::Target;
use crate::target_check::TargetError;

/// Checks every value of the manifest read from `file`; returns an error for the first wrong one.
pub(crate) fn check_values(file: &Path, manifest: &Manifest) -> Result<(), CaptureError> {
    if manifest.format != FORMAT {
        return Err(CaptureError::UnknownFormat { file: file.to_owned(), found: manifest.format.clone() });
    }
    check_camera(file, manifest)?;
    check_target(file, &manifest.target)?;
    check_projector(file, &manifest.projector)?;
    check_positions(file, manifest)?;
    check_lines(file, manifest)?;
    check_scan_names(file, manifest)
}

fn check_camera(file: &Path, manifest: &Manifest) -> Result<(), CaptureError> {
    let (width_px, height_px) = (manifest.camera.width_px, manifest.camera.height_px);
    check_range(file, "camera.width_px", width_px as f64, width_px > 0, "a number of pixels above 0")?;
    check_range(file, "camera.height_px", height_px as f64, height_px > 0, "a number of pixels above 0")?;
    match width_px.checked_mul(height_px) {
        Some(n_pixels) if n_pixels <= IMAGE_LIMIT_PX => Ok(()),
        _ => Err(CaptureError::ImagesTooLarge { file: file.to_owned(), width_px, height_px }),
    }
}

fn check_target(file: &Path, target: &Target) -> Result<(), CaptureError> {
    target.check().map_err(|error| match error {
        TargetError::OutOfRange { entry, value, expected } => {
            CaptureError::OutOfRange { file: file.to_owned(), entry: format!("target.{entry}"), value, expected }
        }
        TargetError::Markers { cause } => CaptureError::Markers { file: file.to_owned(), cause },
    })
}

fn check_projector(file: &Path, projector: &Projector) -> Result<(), CaptureError> {
    if let Some(direction) = projector.line_direction()
        && direction != ROWS
        && direction != COLUMNS
    {
        return Err(unknown_value(file, "projector.line_direction", direction, "\"rows\" or \"columns\""));
    }
    match projector {
        Projector::Grating(grating) => {
            check_positive(file, "projector.wavelength_nm", grating.wavelength_nm)?;
            check_positive(file, "projector.grating_lines_per_mm", grating.grating_lines_per_mm)?;
            check_orders(file, &grating.orders)
        }
        Projector::Planes(planes) => {
            let allowed = (1..=LINES_MAX).contains(&planes.lines);
            check_range(file, "projector.lines", planes.lines as f64, allowed, "the number of lines, 1 to 41")
        }
        Projector::Cross(_) => Ok(()),
    }
}

fn check_orders(file: &Path, orders: &[i8]) -> Result<(), CaptureError> {
    if orders.is_empty() {
        return Err(CaptureError::NoOrders { file: file.to_owned() });
    }
    for (idx, &order) in orders.iter().enumerate() {
        let entry = format!("projector.orders[{idx}]");
        if !(-ORDER_LIMIT..=ORDER_LIMIT).contains(&order) {
            return Err(CaptureError::OrderTooHigh { file: file.to_owned(), entry, order });
        }
        if idx == 0 {
            continue;
        }
        let (previous, rising) = (orders[idx - 1], orders[1] > orders[0]);
        if order == previous || (order > previous) != rising {
            return Err(CaptureError::OrdersNotMonotonic { file: file.to_owned(), entry, order, previous });
        }
    }
    Ok(())
}

/// Every stage view and frame must state a position, with the key of the stage's kind.
fn check_positions(file: &Path, manifest: &Manifest) -> Result<(), CaptureError> {
    let StageDescription { kind, angle_sigma_deg } = manifest.stage;
    if let Some(angle_sigma_deg) = angle_sigma_deg {
        if kind == StageKind::Linear {
            let entry = "stage.angle_sigma_deg".to_owned();
            return Err(CaptureError::OtherStage {
                file: file.to_owned(),
                entry,
                key: "angle_sigma_deg",
                kind: "linear",
            });
        }
        check_positive(file, "stage.angle_sigma_deg", angle_sigma_deg)?;
    }
    let views = manifest.stage_views.iter().enumerate();
    let views = views.map(|(idx, view)| (format!("stage_views[{idx}]"), [view.position_mm, view.angle_deg]));
    let frames = manifest.scans.iter().enumerate().flat_map(|(scan_idx, scan)| {
        scan.frames.iter().enumerate().map(move |(idx, frame)| {
            (format!("scans[{scan_idx}].frames[{idx}]"), [frame.position_mm, frame.angle_deg])
        })
    });
    for (of, [position_mm, angle_deg]) in views.chain(frames) {
        let (own, other, other_key, expected) = match kind {
            StageKind::Linear => (position_mm, angle_deg, "angle_deg", "a finite position in millimetres"),
            StageKind::Rotary => (angle_deg, position_mm, "position_mm", "a finite angle in degrees"),
        };
        if other.is_some() {
            let entry = format!("{of}.{other_key}");
            return Err(CaptureError::OtherStage {
                file: file.to_owned(),
                entry,
                key: other_key,
                kind: kind.name(),
            });
        }
        let entry = format!("{of}.{}", kind.key());
        let Some(value) = own else {
            return Err(CaptureError::NoPosition { file: file.to_owned(), entry, kind: kind.name() });
        };
        check_range(file, &entry, value, value.is_finite(), expected)?;
    }
    Ok(())
}

/// If lines are switched on one by one, every image must state its line; otherwise none may.
fn check_lines(file: &Path, manifest: &Manifest) -> Result<(), CaptureError> {
    let wrong = |entry: String, problem: String, remedy: &'static str| {
        Err(CaptureError::SwitchedLines { file: file.to_owned(), entry, problem, remedy })
    };
    const SWITCHED: &str =
        "write \"switched\": true in the projector if its lines are switched on one by one, or omit it";
    let switched = manifest.projector.switched_lines();
    for (idx, pose) in manifest.poses.iter().enumerate() {
        let (one, several) = (format!("poses[{idx}].laser"), format!("poses[{idx}].lasers"));
        match (switched, pose.lasers.len()) {
            (None, 0) => {}
            (None, _) => return wrong(several, "is stated, but the lines are on together".into(), SWITCHED),
            (Some(_), _) if pose.laser.is_some() => {
                let problem = "is stated, but the lines are switched on one by one".into();
                return wrong(one, problem, "name one image per line in \"lasers\" instead");
            }
            (Some(lines), n) if n != 0 && n != lines => {
                let problem = format!("has {n} images, but the projector has {lines} lines");
                return wrong(several, problem, "name one image per line, in the order of their numbers");
            }
            (Some(_), _) => {}
        }
    }
    let frames = manifest.scans.iter().enumerate().flat_map(|(scan_idx, scan)| {
        let entry = move |idx| format!("scans[{scan_idx}].frames[{idx}].line");
        scan.frames.iter().enumerate().map(move |(idx, frame)| (entry(idx), frame.line))
    });
    for (entry, line) in frames {
        match (switched, line) {
            (None, None) => {}
            (None, Some(_)) => return wrong(entry, "is stated, but the lines are on together".into(), SWITCHED),
            (Some(_), None) => {
                let problem = "is missing: the lines are switched on one by one".into();
                return wrong(entry, problem, "state which line was on, counted from 0");
            }
            (Some(lines), Some(line)) => {
                let known = usize::try_from(line).is_ok_and(|line| line < lines);
                check_range(file, &entry, f64::from(line), known, "the number of a line, counted from 0")?;
            }
        }
    }
    Ok(())
}

fn check_scan_names(file: &Path, manifest: &Manifest) -> Result<(), CaptureError> {
    let mut seen = HashSet::new();
    for (idx, scan) in manifest.scans.iter().enumerate() {
        if scan.name.trim().is_empty() || !seen.insert(scan.name.as_str()) {
            let entry = format!("scans[{idx}].name");
            return Err(CaptureError::ScanName { file: file.to_owned(), entry, name: scan.name.clone() });
        }
    }
    Ok(())
}

fn check_positive(file: &Path, entry: &str, value: f64) -> Result<(), CaptureError> {
    check_range(file, entry, value, value.is_finite() && value > 0.0, "a finite number above 0")
}

fn check_range(
    file: &Path,
    entry: &str,
    value: f64,
    allowed: bool,
    expected: &'static str,
) -> Result<(), CaptureError> {
    if allowed {
        return Ok(());
    }
    Err(CaptureError::OutOfRange { file: file.to_owned(), entry: entry.to_owned(), value, expected })
}

fn unknown_value(file: &Path, entry: &'static str, found: &str, allowed: &'static str) -> CaptureError {
    CaptureError::UnknownValue { file: file.to_owned(), entry, found: found.to_owned(), allowed }
}
