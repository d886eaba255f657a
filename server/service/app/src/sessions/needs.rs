//! What a session still needs for a good calibration, step by step, the same for all clients.

use crate::sessions::body::{BoardImage, SessionBody};
use crate::sessions::found::COVERAGE;

/// Required boards. With these requirements the errors of the twin's calibrations stay below their own σ.
const BOARDS: f64 = 8.0;

/// Required cells of the coverage map, of 48: in the others the distortion is extrapolated.
const CELLS: f64 = 36.0;

/// Required tilted boards, to separate focal length and distance.
const TILTED_BOARDS: f64 = 3.0;

/// Tilt from which a board counts as tilted, degrees.
const TILTED_DEG: f64 = 15.0;

/// Required spread of the board distances as a fraction of their mean: depth is calibrated only where boards were.
const DISTANCE_SPREAD: f64 = 0.1;

/// Required boards with laser lines: two determine a light sheet, the third is a check.
const LASER_BOARDS: f64 = 3.0;

/// Required stage positions: two always fit a line, the third is a check.
const STAGE_VIEWS: f64 = 3.0;

/// One requirement of a calibration.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Need {
    /// Current value.
    pub actual: f64,
    /// Required value.
    pub required: f64,
    /// Whether the requirement is met.
    pub met: bool,
}

/// The requirements of the steps of a session.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SessionNeeds {
    /// Boards with detected corners.
    pub boards: Need,
    /// Covered cells of the coverage map.
    pub cells: Need,
    /// Boards tilted by `tilted_deg` or more.
    pub tilted_boards: Need,
    /// Tilt from which a board counts as tilted, degrees.
    pub tilted_deg: f64,
    /// Spread of the board distances, mm.
    pub distance_mm: Need,
    /// Whether all requirements of the camera step are met.
    pub camera_met: bool,
    /// Boards with detected laser lines.
    pub laser_boards: Need,
    /// Stage positions with a detected board.
    pub stage_views: Need,
}

impl SessionNeeds {
    /// The requirements of a session with their current values.
    pub fn of(body: &SessionBody) -> Self {
        let need = |actual: f64, required: f64| Need { actual, required, met: actual >= required };
        let readable = |board: &&BoardImage| !board.corners.is_empty();
        let boards: Vec<&BoardImage> = body.poses.iter().map(|pose| &pose.board).filter(readable).collect();
        let n_cells = COVERAGE.0 * COVERAGE.1;
        let covered =
            if boards.is_empty() { 0 } else { n_cells.saturating_sub(body.camera.uncovered_cells.len()) };
        let tilted = boards.iter().filter(|board| board.tilt_deg.is_some_and(|tilt| tilt >= TILTED_DEG)).count();
        let lit = body.poses.iter().filter_map(|pose| pose.laser.as_ref()).filter(|laser| laser.n_segments > 0);
        let views = body.stage_views.iter().map(|view| &view.board).filter(readable);
        let mut needs = Self {
            boards: need(boards.len() as f64, BOARDS),
            cells: need(covered as f64, CELLS),
            tilted_boards: need(tilted as f64, TILTED_BOARDS),
            tilted_deg: TILTED_DEG,
            distance_mm: distance(&boards),
            camera_met: false,
            laser_boards: need(lit.count() as f64, LASER_BOARDS),
            stage_views: need(views.count() as f64, STAGE_VIEWS),
        };
        let camera = [needs.boards, needs.cells, needs.tilted_boards, needs.distance_mm];
        needs.camera_met = camera.iter().all(|need| need.met);
        needs
    }
}

/// The spread of distances; 0 for a single one.
fn distance(boards: &[&BoardImage]) -> Need {
    let distances_mm: Vec<f64> = boards.iter().filter_map(|board| board.distance_mm).collect();
    let low = distances_mm.iter().copied().fold(f64::INFINITY, f64::min);
    let high = distances_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let actual = (high - low).max(0.0);
    let mean_mm = distances_mm.iter().sum::<f64>() / distances_mm.len().max(1) as f64;
    let required = DISTANCE_SPREAD * mean_mm;
    Need { actual, required, met: distances_mm.len() > 1 && actual >= required }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::sessions::stored::from_stored;

    /// Eight boards that meet all requirements, as changed by the test.
    fn needs(change: impl Fn(usize, &mut BoardImage), uncovered: usize) -> SessionNeeds {
        let image = json!({ "artifact": "", "exposure_us": 1.0, "taken_at_ms": 0 });
        let pose = |idx: usize| {
            let board = json!({ "image": image, "corners": [[0, 0, 10, 10, 0.01]], "coverage_cells": [],
                "corner_sigma_px": null, "saturated_fraction": 0, "tilt_deg": 10 + 2 * idx,
                "distance_mm": 360 + 10 * idx, "rms_px": null, "problem": null });
            let laser = json!({ "image": image, "n_segments": 5, "n_points": 9, "lines_px": [],
                "saturated_fraction": 0, "problem": null });
            json!({ "id": idx.to_string(), "board": board, "laser": laser })
        };
        let poses: Vec<_> = (0..8).map(pose).collect();
        let uncovered: Vec<usize> = (0..uncovered).collect();
        let body = json!({
            "name": "", "target": { "inner_columns": 3, "inner_rows": 3, "square_mm": 1.0 },
            "projector": { "wavelength_nm": 1.0, "grating_lines_per_mm": 1.0, "orders": [0],
                "line_direction": "rows" },
            "exposures": { "board_exposure_us": 1.0, "laser_exposure_us": 1.0, "laser_power": 1.0 }, "width_px": 8, "height_px": 8, "poses": poses,
            "stage_views": [], "camera": { "focal_px": null, "rms_px": null, "uncovered_cells": uncovered,
                "problem": null }, "job_id": null
        });
        let mut body = from_stored(body).unwrap();
        body.poses.iter_mut().enumerate().for_each(|(idx, pose)| change(idx, &mut pose.board));
        SessionNeeds::of(&body)
    }

    #[test]
    fn each_requirement_is_reported_separately() {
        let all = needs(|_, _| {}, 0);
        assert!(all.camera_met && all.laser_boards.met && !all.stage_views.met, "{all:?}");
        let flat = needs(|_, board| board.tilt_deg = Some(5.0), 0);
        assert_eq!((flat.tilted_boards.met, flat.distance_mm.met, flat.cells.met), (false, true, true));
        let one_distance = needs(|_, board| board.distance_mm = Some(400.0), 0);
        assert_eq!((one_distance.tilted_boards.met, one_distance.distance_mm.met), (true, false));
        let corner = needs(|_, _| {}, 44);
        assert_eq!((corner.cells.actual, corner.cells.met, corner.camera_met), (4.0, false, false));
        let unreadable = needs(
            |idx, board| {
                if idx == 0 {
                    board.corners.clear()
                }
            },
            0,
        );
        assert_eq!((unreadable.boards.actual, unreadable.boards.met), (7.0, false));
        let none = needs(|_, board| board.corners.clear(), 48);
        assert_eq!((none.boards.actual, none.cells.actual, none.distance_mm.met), (0.0, 0.0, false));
    }
}
