//! What a scan that cannot work is refused for, each with its place in the input and its remedy.

use devices::{Homing, StageKind};
use optics::Calibration;
use station::StationStatus;

use super::motion::run_up_mm;
use super::params::{
    DEFAULT_LASER_POWER, DEFAULT_STEP_MM, EXPOSURES, LEAST_EXPOSURE_RATIO, POINTS_LIMIT, RESOLUTION_SHARE,
    SMEAR_SHARE, STEP_MIN_MM,
};
use super::prediction::Prediction;
use super::{Rows, SweepRate};
use crate::error::{AppError, ErrorKind};
use crate::jobs::{ScanInput, ScanMode};

fn refused(field: &str, detail: impl Into<String>, remedy: impl Into<String>) -> AppError {
    AppError::new(ErrorKind::Impossible, detail).at(format!("/{field}")).remedy(remedy)
}

/// Every number is one, and has the right sign.
pub fn numbers(input: &ScanInput) -> Result<(), AppError> {
    let numbers = [
        ("from_mm", input.from_mm, false),
        ("to_mm", input.to_mm, false),
        ("step_mm", input.step_mm, true),
        ("speed_mm_s", input.speed_mm_s, true),
        ("exposure_us", input.exposure_us, true),
        ("laser_power", input.laser_power, true),
    ];
    for (field, value, positive) in numbers {
        let Some(value) = value else { continue };
        if !value.is_finite() || (positive && value <= 0.0) {
            let wanted = if positive { "a finite number above 0" } else { "a finite number" };
            return Err(refused(field, format!("{field} is {value}"), format!("give {wanted}")));
        }
    }
    Ok(())
}

/// Without its devices a station has no limits to plan with.
pub fn devices(status: &StationStatus) -> Result<(), AppError> {
    let there = [
        ("camera", status.camera.connected),
        ("stage", status.stage.connected),
        ("laser", status.laser.connected),
    ];
    match there.iter().find(|(_, connected)| !connected) {
        None if status.stage.capabilities.kind == StageKind::Rotary => {
            Err(AppError::new(ErrorKind::Impossible, "the stage is rotary, and scans need a linear one")
                .remedy("scan with a linear stage; this version has no rotary scan"))
        }
        None => Ok(()),
        Some((device, _)) => {
            Err(AppError::new(ErrorKind::DeviceFault, format!("the station's {device} is not connected"))
                .remedy("check its cable and power, then reset the station"))
        }
    }
}

/// The calibration is of this camera as it is set.
pub fn camera(calibration: &Calibration, status: &StationStatus) -> Result<(), AppError> {
    let roi = status.camera_settings.roi;
    let camera = &calibration.camera;
    if (roi.width_px, roi.height_px) == (camera.width_px, camera.height_px) && (roi.left_px, roi.top_px) == (0, 0)
    {
        return Ok(());
    }
    let detail = format!(
        "the camera delivers {}×{} pixels from ({}, {}), calibration {} is for {}×{} from (0, 0)",
        roi.width_px, roi.height_px, roi.left_px, roi.top_px, calibration.id, camera.width_px, camera.height_px
    );
    Err(refused("calibration_id", detail, "read the whole sensor, or use the calibration of this camera"))
}

/// Range, step, mode and speed, as asked for or by default.
pub fn rows(input: &ScanInput, status: &StationStatus) -> Result<Rows, AppError> {
    let ends = [("from_mm", input.from_mm), ("to_mm", input.to_mm)];
    if let Some((field, _)) = ends.iter().find(|(_, end)| end.is_none()) {
        let remedy = "say from which to which stage position to scan";
        return Err(refused(field, format!("a scan from the station needs {field}"), remedy));
    }
    let (from_mm, to_mm) = (input.from_mm.unwrap_or(0.0), input.to_mm.unwrap_or(0.0));
    let continuous = match (input.mode, input.speed_mm_s) {
        (Some(ScanMode::StopAndGo), Some(_)) => {
            let remedy = "leave it out, or choose the mode continuous";
            return Err(refused("speed_mm_s", "a stop-and-go scan has no speed of its own", remedy));
        }
        (Some(ScanMode::Continuous), _) | (None, Some(_)) => true,
        (Some(ScanMode::StopAndGo) | None, None) => false,
    };
    let resolution_mm = status.stage.capabilities.resolution_mm;
    let mut rows = Rows {
        mode: if continuous { ScanMode::Continuous } else { ScanMode::StopAndGo },
        from_mm,
        to_mm,
        step_mm: input.step_mm.unwrap_or(DEFAULT_STEP_MM.max(resolution_mm)),
        sweep: None,
    };
    if continuous {
        sweep(&mut rows, input, status)?;
    } else if rows.step_mm < resolution_mm * RESOLUTION_SHARE {
        let detail =
            format!("rows {} mm apart are finer than this stage's steps of {resolution_mm} mm", rows.step_mm);
        return Err(refused("step_mm", detail, format!("give {resolution_mm} mm or more")));
    }
    if rows.step_mm < STEP_MIN_MM {
        let detail =
            format!("rows {} mm apart are below the {STEP_MIN_MM} mm a stage can be read back to", rows.step_mm);
        return Err(refused(
            if input.step_mm.is_some() { "step_mm" } else { "speed_mm_s" },
            detail,
            "scan more coarsely",
        ));
    }
    Ok(rows)
}

/// Speed, step and frame rate of a continuous scan: what is not given follows from the rest.
fn sweep(rows: &mut Rows, input: &ScanInput, status: &StationStatus) -> Result<(), AppError> {
    let stage = &status.stage.capabilities;
    if stage.follows_frames {
        let recorded_mm = stage.resolution_mm;
        if input.step_mm.is_some_and(|step_mm| (step_mm / recorded_mm - 1.0).abs() > 1.0 - RESOLUTION_SHARE) {
            let detail = format!("the recorded frames are {recorded_mm} mm apart, a sweep takes them as they are");
            return Err(refused("step_mm", detail, "leave it out, or scan stop-and-go"));
        }
        rows.step_mm = recorded_mm;
    }
    if rows.from_mm == rows.to_mm {
        let detail = "a continuous scan needs a way to go, from_mm equals to_mm";
        return Err(refused("to_mm", detail, "give another to_mm, or scan stop-and-go"));
    }
    let rate_hz = status.camera_settings.frame_rate_hz;
    let given_step_mm = if stage.follows_frames { Some(rows.step_mm) } else { input.step_mm };
    let (speed_mm_s, frame_rate_hz) = match (input.speed_mm_s, given_step_mm) {
        (Some(speed), Some(step)) => (speed, speed / step),
        (Some(speed), None) => (speed, rate_hz),
        (None, _) => (rows.step_mm * rate_hz, rate_hz),
    };
    rows.step_mm = speed_mm_s / frame_rate_hz;
    let top_mm_s = stage.max_speed_mm_s;
    if speed_mm_s > top_mm_s {
        let detail = format!("the scan needs {speed_mm_s} mm/s, the stage moves at most at {top_mm_s} mm/s");
        let field = if input.speed_mm_s.is_some() { "speed_mm_s" } else { "step_mm" };
        return Err(refused(field, detail, "scan more slowly, or with a lower frame rate"));
    }
    if let Some(range) = status.camera.capabilities.frame_rate_hz
        && !(range.min..=range.max).contains(&frame_rate_hz)
    {
        let detail = format!(
            "{speed_mm_s} mm/s in steps of {} mm need {frame_rate_hz:.1} frames/s, the camera takes {} to {}",
            rows.step_mm, range.min, range.max
        );
        return Err(refused("step_mm", detail, "choose another speed or step"));
    }
    rows.sweep = Some(SweepRate { speed_mm_s, frame_rate_hz });
    Ok(())
}

/// The range with its run-up lies within the travel, and the direction of the stage is known.
pub fn travel(rows: &Rows, calibration: &Calibration, status: &StationStatus) -> Result<(), AppError> {
    if calibration.stage.is_none() && rows.from_mm != rows.to_mm {
        let detail = format!("calibration {} does not know which way the stage moves", calibration.id);
        let remedy = "calibrate with at least two stage views, or use another calibration";
        return Err(refused("calibration_id", detail, remedy));
    }
    if let Some(kind) =
        calibration.stage.map(|stage| stage.kind()).filter(|kind| *kind != optics::StageKind::Linear)
    {
        let detail =
            format!("calibration {} is for a {} stage, the station's stage travels", calibration.id, kind.name());
        return Err(refused("calibration_id", detail, "use a calibration that was made with this stage"));
    }
    let (min_mm, max_mm) = status.stage.capabilities.travel_mm;
    let run_up_mm = rows.sweep.map_or(0.0, |sweep| run_up_mm(sweep.speed_mm_s, status));
    let outwards = if rows.to_mm < rows.from_mm { [1.0, -1.0] } else { [-1.0, 1.0] };
    for (field, end_mm, outwards) in [("from_mm", rows.from_mm, outwards[0]), ("to_mm", rows.to_mm, outwards[1])] {
        let reached_mm = end_mm + outwards * run_up_mm;
        if (min_mm..=max_mm).contains(&reached_mm) {
            continue;
        }
        let detail = match rows.sweep {
            None => format!("{field} = {end_mm} mm is outside the stage's travel of {min_mm} to {max_mm} mm"),
            Some(_) => format!(
                "{field} = {end_mm} mm and {run_up_mm:.1} mm of run-up are outside the stage's travel of {min_mm} to {max_mm} mm"
            ),
        };
        return Err(refused(
            field,
            detail,
            format!("stay between {:.3} and {:.3} mm", min_mm + run_up_mm, max_mm - run_up_mm),
        ));
    }
    Ok(())
}

/// The exposure asked for, or the station's own for laser frames.
pub fn exposure_us(input: &ScanInput, rows: &Rows, status: &StationStatus) -> Result<f64, AppError> {
    let set_us = status.camera_settings.exposure_us;
    let default_us = if status.simulated == Some("twin") { twin::live::LASER_EXPOSURE_US } else { set_us };
    let exposure_us = input.exposure_us.unwrap_or(default_us);
    if let (Some(range), Some(_)) = (status.camera.capabilities.exposure_us, input.exposure_us)
        && !(range.min..=range.max).contains(&exposure_us)
    {
        let detail = format!("the camera exposes for {} to {} µs, not for {exposure_us}", range.min, range.max);
        return Err(refused("exposure_us", detail, "choose an exposure it can do"));
    }
    if let Some(sweep) = rows.sweep
        && exposure_us * 1e-6 * sweep.frame_rate_hz >= 1.0
    {
        let detail =
            format!("an exposure of {exposure_us} µs does not fit into {:.1} frames/s", sweep.frame_rate_hz);
        return Err(refused(
            "exposure_us",
            detail,
            "expose for a shorter time, or scan with fewer frames per second",
        ));
    }
    Ok(exposure_us)
}

/// The exposures of every row, the shortest first; none where a row has one.
pub fn exposures_us(input: &ScanInput, rows: &Rows, status: &StationStatus) -> Result<Vec<f64>, AppError> {
    let mut exposures_us = input.exposures_us.clone();
    if exposures_us.is_empty() {
        return Ok(exposures_us);
    }
    let refused = |detail: String, remedy: &str| Err(refused("exposures_us", detail, remedy));
    exposures_us.sort_by(f64::total_cmp);
    if !EXPOSURES.contains(&exposures_us.len()) {
        return refused(format!("{} exposures of a row were asked for", exposures_us.len()), "give two to four");
    }
    if input.exposure_us.is_some() {
        return refused("exposure_us and exposures_us were both given".to_owned(), "leave one of them out");
    }
    if rows.mode == ScanMode::Continuous {
        let detail = "a stage that moves gives a row no second exposure".to_owned();
        return refused(detail, "scan stop and go, or with one exposure");
    }
    if input.keep_frames {
        let detail = "pictures of rows with several exposures cannot be kept".to_owned();
        return refused(detail, "leave out keep_frames, or scan with one exposure");
    }
    let Some(range) = status.camera.capabilities.exposure_us else {
        return refused("this camera's exposure cannot be set".to_owned(), "scan with one exposure");
    };
    if let Some(beyond) = exposures_us.iter().find(|us| !(range.min..=range.max).contains(*us)) {
        let detail = format!("the camera exposes for {} to {} µs, not for {beyond}", range.min, range.max);
        return refused(detail, "choose exposures it can do");
    }
    if exposures_us.windows(2).any(|pair| pair[1] < LEAST_EXPOSURE_RATIO * pair[0]) {
        let detail = format!("exposures of {exposures_us:?} µs hardly differ");
        return refused(
            detail,
            "make each at least one and a half times the one before; four to eight times is usual",
        );
    }
    Ok(exposures_us)
}

/// The laser power asked for.
pub fn laser_power(input: &ScanInput, status: &StationStatus) -> Result<f64, AppError> {
    let power = input.laser_power.unwrap_or(DEFAULT_LASER_POWER);
    let (min, max) = status.laser.capabilities.power.map_or((0.0, 1.0), |range| (range.min, range.max));
    if (min..=max).contains(&power) {
        return Ok(power);
    }
    let remedy = format!("give a share of full power from {min} to {max}");
    Err(refused("laser_power", format!("the laser cannot shine with power {power}"), remedy))
}

/// The most points there can be, if they can be computed with.
pub fn points(n_rows: usize, calibration: &Calibration) -> Result<u64, AppError> {
    let camera = &calibration.camera;
    let per_row = (calibration.orders.len() * camera.width_px.max(camera.height_px)) as u64;
    let points = n_rows as u64 * per_row;
    if points <= POINTS_LIMIT {
        return Ok(points);
    }
    let rows_limit = POINTS_LIMIT / per_row.max(1);
    let detail = format!("{n_rows} rows may give {points} points, more than the {POINTS_LIMIT} a scan may have");
    Err(refused("step_mm", detail, format!("plan at most {rows_limit} rows: a larger step, or a shorter range")))
}

/// What a person should know before the scan begins.
pub fn notes(rows: &Rows, exposure_us: f64, status: &StationStatus, prediction: &Prediction) -> Vec<String> {
    let mut notes = Vec::new();
    if !status.homed && status.stage.capabilities.homing == Homing::Required {
        notes.push("the stage is not homed; home it before the scan".to_owned());
    }
    if !status.laser.capabilities.switched {
        notes.push(
            "the laser is not controlled here: it stays on before, during and after the scan, and after Stop"
                .to_owned(),
        );
    }
    if let Some(sweep) = rows.sweep {
        let smear_mm = sweep.speed_mm_s * exposure_us * 1e-6;
        if smear_mm > SMEAR_SHARE * rows.step_mm {
            notes.push(format!("the part moves {smear_mm:.3} mm during an exposure; expose for a shorter time, or scan more slowly"));
        }
    }
    if prediction.unambiguous_depth_mm[0] > prediction.depth_mm[0]
        || prediction.unambiguous_depth_mm[1] < prediction.depth_mm[1]
    {
        let [near, far] = prediction.unambiguous_depth_mm;
        notes.push(format!("parts that reach out of {near:.1}–{far:.1} mm are told apart by a second line only; scan far enough that two lines see them"));
    }
    notes
}
