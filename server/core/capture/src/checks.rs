//! What the manifest's values must satisfy before any image is looked at.

use std::collections::HashSet;
use std::path::Path;

use vision::CharucoParams;

use crate::error::CaptureError;
use crate::manifest::Manifest;
use crate::params::{CORNERS_MAX, CORNERS_MIN, FORMAT, IMAGE_LIMIT_PX, LINES_MAX, ORDER_LIMIT};
use crate::projector::{COLUMNS, Projector, ROWS};
use crate::stage::{StageKind, StageSheet};
use crate::target::{CirclesTarget, SquareMm, Target};

/// Checks every value of the manifest read from `file`; the first that is wrong is the error.
pub(crate) fn check_values(file: &Path, manifest: &Manifest) -> Result<(), CaptureError> {
    if manifest.format != FORMAT {
        return Err(CaptureError::UnknownFormat { file: file.to_owned(), found: manifest.format.clone() });
    }
    check_camera(file, manifest)?;
    check_target(file, &manifest.target)?;
    check_projector(file, &manifest.projector)?;
    check_positions(file, manifest)?;
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
    let square = target.square_mm();
    if let Some((grid, asymmetric)) = target.circles() {
        return check_circles(file, grid, asymmetric);
    }
    let (inner_columns, inner_rows) = target.inner_corners();
    let counts = match target {
        Target::Charuco(board) => [("target.columns", board.columns), ("target.rows", board.rows)],
        _ => [("target.inner_columns", inner_columns + 1), ("target.inner_rows", inner_rows + 1)],
    };
    let is_chessboard = matches!(target, Target::Chessboard(_));
    let expected = match is_chessboard {
        true => "the number of inner corners along that side, between 2 and 1000",
        false => "the number of squares along that side, between 3 and 1001",
    };
    for (entry, n_squares) in counts {
        let n_corners = n_squares.saturating_sub(1);
        let told = if is_chessboard { n_corners } else { n_squares };
        check_range(file, entry, told as f64, (CORNERS_MIN..=CORNERS_MAX).contains(&n_corners), expected)?;
    }
    check_positive(file, "target.square_mm", square.x_mm)?;
    check_positive(file, "target.square_mm", square.y_mm)?;
    let Target::Charuco(board) = target else { return Ok(()) };
    let side_mm = square.x_mm.min(square.y_mm);
    let fits = board.marker_mm > 0.0 && board.marker_mm < side_mm;
    check_range(file, "target.marker_mm", board.marker_mm, fits, "a length above 0 and below that of a square")?;
    let params = CharucoParams {
        columns: board.columns,
        rows: board.rows,
        marker_share: board.marker_mm / side_mm,
        dictionary: board.dictionary.clone(),
    };
    params.check().map_err(|cause| CaptureError::Markers { file: file.to_owned(), cause })
}

/// Discs that do not touch: their centres are a step apart, of an asymmetric grid one along and one across.
fn check_circles(file: &Path, grid: &CirclesTarget, asymmetric: bool) -> Result<(), CaptureError> {
    for (entry, count) in [("target.columns", grid.columns), ("target.rows", grid.rows)] {
        let expected = "the number of discs along that side, between 2 and 1000";
        check_range(file, entry, count as f64, (CORNERS_MIN..=CORNERS_MAX).contains(&count), expected)?;
    }
    let SquareMm { x_mm, y_mm } = grid.square_mm;
    check_positive(file, "target.square_mm", x_mm)?;
    check_positive(file, "target.square_mm", y_mm)?;
    let nearest_mm = if asymmetric { x_mm.hypot(y_mm).min(2.0 * x_mm).min(2.0 * y_mm) } else { x_mm.min(y_mm) };
    let fits = grid.diameter_mm > 0.0 && grid.diameter_mm < nearest_mm;
    let expected = "a length above 0 and below the distance of neighbouring discs";
    check_range(file, "target.diameter_mm", grid.diameter_mm, fits, expected)
}

fn check_projector(file: &Path, projector: &Projector) -> Result<(), CaptureError> {
    if let Some(direction) = projector.line_direction()
        && direction != ROWS
        && direction != COLUMNS
    {
        return Err(unknown_word(file, "projector.line_direction", direction, "\"rows\" or \"columns\""));
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

/// The stage stands somewhere in every stage view and every frame, by the key of its kind.
fn check_positions(file: &Path, manifest: &Manifest) -> Result<(), CaptureError> {
    let StageSheet { kind, angle_sigma_deg } = manifest.stage;
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

fn unknown_word(file: &Path, entry: &'static str, found: &str, allowed: &'static str) -> CaptureError {
    CaptureError::UnknownWord { file: file.to_owned(), entry, found: found.to_owned(), allowed }
}
