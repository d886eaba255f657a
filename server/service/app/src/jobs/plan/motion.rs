//! Duration of stage motion.

use station::StationStatus;
use station::params::{RUN_UP_MARGIN, RUN_UP_TIME};

use super::Rows;

/// Run-up before and after the range of a continuous scan, in the unit of the stage.
pub fn run_up(speed: f64, status: &StationStatus) -> f64 {
    if status.stage.capabilities.follows_frames {
        return 0.0;
    }
    match status.stage.capabilities.acceleration_mm_s2 {
        Some(a) if a > 0.0 => speed * speed / (2.0 * a) * RUN_UP_MARGIN,
        _ => speed * RUN_UP_TIME.as_secs_f64(),
    }
}

/// Duration of motion and exposures of a scan, from the first motion to the last frame, s.
pub fn duration_s(rows: &Rows, n_rows: usize, exposure_us: f64, status: &StationStatus) -> f64 {
    let top_speed = status.stage.capabilities.max_speed_mm_s;
    let approach = status.position_mm.map_or(0.0, |position| (position - rows.range.from).abs());
    let approach_s = move_s(approach, top_speed, status);
    match rows.range.speed {
        None => {
            let row_s = move_s(rows.range.step, top_speed, status) + exposure_us * 1e-6;
            approach_s + n_rows as f64 * row_s
        }
        Some(speed) => {
            let way = rows.range.length() + 2.0 * run_up(speed, status);
            approach_s + move_s(way, speed, status)
        }
    }
}

/// Time of a move with ramps at both ends, s.
fn move_s(distance: f64, speed: f64, status: &StationStatus) -> f64 {
    let cruise_s = distance / speed;
    match status.stage.capabilities.acceleration_mm_s2 {
        Some(a) if a > 0.0 && distance < speed * speed / a => 2.0 * (distance / a).sqrt(),
        Some(a) if a > 0.0 => cruise_s + speed / a,
        _ => cruise_s,
    }
}
