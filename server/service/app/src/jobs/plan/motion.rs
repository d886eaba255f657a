//! How long the stage takes.

use station::StationStatus;
use station::params::{RUN_UP_MARGIN, RUN_UP_TIME};

use super::Rows;

/// Way the stage needs before and behind the range of a continuous scan, mm.
pub fn run_up_mm(speed_mm_s: f64, status: &StationStatus) -> f64 {
    if status.stage.capabilities.follows_frames {
        return 0.0;
    }
    match status.stage.capabilities.acceleration_mm_s2 {
        Some(a) if a > 0.0 => speed_mm_s * speed_mm_s / (2.0 * a) * RUN_UP_MARGIN,
        _ => speed_mm_s * RUN_UP_TIME.as_secs_f64(),
    }
}

/// How long motion and exposures of a scan take, from the first motion to the last frame, s.
pub fn duration_s(rows: &Rows, n_rows: usize, exposure_us: f64, status: &StationStatus) -> f64 {
    let top_mm_s = status.stage.capabilities.max_speed_mm_s;
    let approach_mm = status.position_mm.map_or(0.0, |position_mm| (position_mm - rows.from_mm).abs());
    let approach_s = move_s(approach_mm, top_mm_s, status);
    match rows.sweep {
        None => {
            let row_s = move_s(rows.step_mm, top_mm_s, status) + exposure_us * 1e-6;
            approach_s + n_rows as f64 * row_s
        }
        Some(sweep) => {
            let way_mm = (rows.to_mm - rows.from_mm).abs() + 2.0 * run_up_mm(sweep.speed_mm_s, status);
            approach_s + move_s(way_mm, sweep.speed_mm_s, status)
        }
    }
}

/// Time of a move with ramps at both ends, s.
fn move_s(distance_mm: f64, speed_mm_s: f64, status: &StationStatus) -> f64 {
    let cruise_s = distance_mm / speed_mm_s;
    match status.stage.capabilities.acceleration_mm_s2 {
        Some(a) if a > 0.0 && distance_mm < speed_mm_s * speed_mm_s / a => 2.0 * (distance_mm / a).sqrt(),
        Some(a) if a > 0.0 => cruise_s + speed_mm_s / a,
        _ => cruise_s,
    }
}
