//! Checks of a scan request; each refusal names the field by its JSON pointer, with a remedy.

use devices::Homing;
use optics::{Calibration, StageKind};
use station::StationStatus;

use super::Rows;
use super::motion::run_up;
use super::params::{
    CLOSING_TURN_DEG, DEFAULT_LASER_POWER, DEFAULT_STEP_DEG, DEFAULT_STEP_MM, EXPOSURES, LEAST_EXPOSURE_RATIO,
    POINTS_LIMIT, RESOLUTION_RATIO, SMEAR_FRACTION, STEP_MIN,
};
use super::prediction::Prediction;
use super::requested::{RequestedRange, fields_of};
use crate::error::{AppError, ErrorKind};
use crate::jobs::{ScanInput, ScanMode};
use crate::resources::scan_run::{ScanRange, stage_kind};

pub fn refused(field: &str, detail: impl Into<String>, remedy: impl Into<String>) -> AppError {
    AppError::new(ErrorKind::Impossible, detail).at(format!("/{field}")).remedy(remedy)
}

/// Every number is finite and has the right sign.
pub fn numbers(input: &ScanInput) -> Result<(), AppError> {
    let ranges = [StageKind::Linear, StageKind::Rotary].map(|stage| RequestedRange::of(&input.settings, stage));
    let signed = ranges.iter().flat_map(|range| {
        let names = fields_of(range.stage);
        range.given().map(move |(field, value)| (field, value, [names.step, names.speed].contains(&field)))
    });
    let others = [("exposure_us", input.settings.exposure_us), ("laser_power", input.settings.laser_power)];
    let others = others.into_iter().filter_map(|(field, value)| Some((field, value?, true)));
    for (field, value, positive) in signed.chain(others) {
        if !value.is_finite() || (positive && value <= 0.0) {
            let wanted = if positive { "a finite number above 0" } else { "a finite number" };
            return Err(refused(field, format!("{field} is {value}"), format!("give {wanted}")));
        }
    }
    Ok(())
}

/// Planning needs the limits of the connected devices.
pub fn devices(status: &StationStatus) -> Result<(), AppError> {
    let there = [
        ("camera", status.camera.connected),
        ("stage", status.stage.connected),
        ("laser", status.laser.connected),
    ];
    match there.iter().find(|(_, connected)| !connected) {
        None => Ok(()),
        Some((device, _)) => {
            Err(AppError::new(ErrorKind::DeviceFault, format!("the station's {device} is not connected"))
                .remedy("check its cable and power, then reset the station"))
        }
    }
}

/// The calibration matches the camera with its current settings.
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

/// Range, step, mode and speed, requested or default.
pub fn rows(input: &ScanInput, status: &StationStatus) -> Result<Rows, AppError> {
    let requested = RequestedRange::checked(&input.settings, stage_kind(status))?;
    let names = fields_of(requested.stage);
    if status.stage.capabilities.frame_pitch_mm.is_some() {
        belt(input, &requested)?;
    }
    let ends = [(names.from, requested.from), (names.to, requested.to)];
    if let Some((field, _)) = ends.iter().find(|(_, end)| end.is_none()) {
        let remedy = "give the first and last stage position";
        return Err(refused(field, format!("a scan from the station needs {field}"), remedy));
    }
    if input.settings.mode == Some(ScanMode::StopAndGo) && requested.speed.is_some() {
        let remedy = "omit it, or choose the mode continuous";
        return Err(refused(names.speed, "a stop-and-go scan has no speed", remedy));
    }
    let (resolution, default_step) = (status.stage.capabilities.resolution_mm, default_step(requested.stage));
    let range = ScanRange {
        stage: requested.stage,
        from: requested.from.unwrap_or(0.0),
        to: requested.to.unwrap_or(0.0),
        step: requested.step.unwrap_or(default_step.max(resolution)),
        speed: None,
    };
    let mut rows = Rows { mode: input.settings.mode(), range, frame_rate_hz: None };
    let amount = |way| range.amount(way);
    if rows.mode == ScanMode::Continuous {
        sweep(&mut rows, &requested, status)?;
    } else if range.step < resolution * RESOLUTION_RATIO {
        let (step, resolution) = (amount(range.step), amount(resolution));
        let detail = format!("a row spacing of {step} is finer than the stage resolution of {resolution}");
        return Err(refused(names.step, detail, format!("give {resolution} or more")));
    }
    if rows.range.step < STEP_MIN {
        let (step, least) = (amount(rows.range.step), amount(STEP_MIN));
        let detail = format!("a row spacing of {step} is below the minimum of {least}");
        let field = if requested.step.is_some() { names.step } else { names.speed };
        return Err(refused(field, detail, "use a larger step"));
    }
    Ok(rows)
}

/// Refuses what a conveyor cannot do: it is not commanded and does not reverse.
fn belt(input: &ScanInput, requested: &RequestedRange) -> Result<(), AppError> {
    let not_ours = "the belt is not controlled here";
    if input.settings.mode() != ScanMode::Continuous {
        return Err(refused(
            "mode",
            format!("{not_ours}: it does not stop for rows"),
            "choose the mode continuous",
        ));
    }
    if input.resume_scan_id.is_some() {
        return Err(refused("resume_scan_id", format!("{not_ours}: the part has passed"), "scan the part again"));
    }
    if input.settings.background.is_some() {
        let detail = format!("{not_ours}: it does not stop for a laser-off image");
        return Err(refused("background", detail, "omit it, and shield the station from ambient light"));
    }
    if let (Some(from), Some(to)) = (requested.from, requested.to)
        && from > to
    {
        let names = fields_of(requested.stage);
        return Err(refused(
            names.to,
            format!("{not_ours}: its position only increases"),
            "exchange the two ends",
        ));
    }
    Ok(())
}

fn default_step(stage: StageKind) -> f64 {
    match stage {
        StageKind::Linear => DEFAULT_STEP_MM,
        StageKind::Rotary => DEFAULT_STEP_DEG,
    }
}

/// Speed, step and frame rate of a continuous scan: what is not given follows from the others.
fn sweep(rows: &mut Rows, requested: &RequestedRange, status: &StationStatus) -> Result<(), AppError> {
    let stage = &status.stage.capabilities;
    let (range, names) = (&mut rows.range, fields_of(requested.stage));
    if stage.follows_frames {
        let recorded = stage.resolution_mm;
        if requested.step.is_some_and(|step| (step / recorded - 1.0).abs() > 1.0 - RESOLUTION_RATIO) {
            let recorded = range.amount(recorded);
            let detail = format!("the frames are {recorded} apart, which a continuous scan cannot change");
            return Err(refused(names.step, detail, "omit it, or scan stop-and-go"));
        }
        range.step = recorded;
    }
    if range.from == range.to {
        let detail = format!("a continuous scan needs a range, but {} equals {}", names.from, names.to);
        return Err(refused(names.to, detail, format!("give another {}, or scan stop-and-go", names.to)));
    }
    let rate_hz = status.camera_settings.frame_rate_hz;
    let given_step = if stage.follows_frames { Some(range.step) } else { requested.step };
    let (speed, frame_rate_hz) = match (requested.speed, given_step) {
        (Some(speed), Some(step)) => (speed, speed / step),
        (Some(speed), None) => (speed, rate_hz),
        (None, _) => (range.step * rate_hz, rate_hz),
    };
    range.step = speed / frame_rate_hz;
    let top_speed = stage.max_speed_mm_s;
    if speed > top_speed {
        let (needed, top) = (range.amount(speed), range.amount(top_speed));
        let detail = format!("the scan needs {needed}/s, the maximum speed of the stage is {top}/s");
        let field = if requested.speed.is_some() { names.speed } else { names.step };
        return Err(refused(field, detail, "scan more slowly, or with a lower frame rate"));
    }
    if let Some(camera) = status.camera.capabilities.frame_rate_hz
        && !(camera.min..=camera.max).contains(&frame_rate_hz)
    {
        let detail = format!(
            "{}/s in steps of {} need {frame_rate_hz:.1} frames/s, the camera takes {} to {}",
            range.amount(speed),
            range.amount(range.step),
            camera.min,
            camera.max
        );
        return Err(refused(names.step, detail, "choose another speed or step"));
    }
    (range.speed, rows.frame_rate_hz) = (Some(speed), Some(frame_rate_hz));
    Ok(())
}

/// The range with its run-up lies within the travel, and the stage motion is calibrated.
pub fn travel(rows: &Rows, calibration: &Calibration, status: &StationStatus) -> Result<(), AppError> {
    let range = &rows.range;
    if calibration.stage.is_none() && range.from != range.to {
        let (detail, remedy) = match range.stage {
            StageKind::Linear => ("has no stage direction", "calibrate with at least two stage views"),
            StageKind::Rotary => {
                ("has no turntable axis", "calibrate with at least three stage views at different angles")
            }
        };
        let detail = format!("calibration {} {detail}", calibration.id);
        return Err(refused("calibration_id", detail, format!("{remedy}, or use another calibration")));
    }
    if let Some(kind) = calibration.stage.map(|stage| stage.kind()).filter(|kind| *kind != range.stage) {
        let (of, is) = (kind.name(), range.stage.name());
        let detail = format!("calibration {} is for a {of} stage, the station's stage is {is}", calibration.id);
        return Err(refused("calibration_id", detail, "use a calibration that was made with this stage"));
    }
    let (min, max) = status.stage.capabilities.travel_mm;
    let run_up = range.speed.map_or(0.0, |speed| run_up(speed, status));
    let names = fields_of(range.stage);
    let ends = [(names.from, range.from, -range.direction()), (names.to, range.to, range.direction())];
    for (field, end, outwards) in ends {
        if (min..=max).contains(&(end + outwards * run_up)) {
            continue;
        }
        let [end, least, most] = [end, min, max].map(|at| range.amount(at));
        let detail = match range.speed {
            None => format!("{field} = {end} is outside the stage's travel of {least} to {most}"),
            Some(_) => {
                let unit = range.stage.unit();
                format!(
                    "{field} = {end} and {run_up:.1} {unit} of run-up are outside the stage's travel of {least} to {most}"
                )
            }
        };
        let unit = range.stage.unit();
        let remedy = format!("stay between {:.3} and {:.3} {unit}", min + run_up, max - run_up);
        return Err(refused(field, detail, remedy));
    }
    Ok(())
}

/// The requested exposure, or the default for laser frames.
pub fn exposure_us(input: &ScanInput, rows: &Rows, status: &StationStatus) -> Result<f64, AppError> {
    let set_us = status.camera_settings.exposure_us;
    let default_us = if status.simulated == Some("twin") { twin::live::LASER_EXPOSURE_US } else { set_us };
    let exposure_us = input.settings.exposure_us.unwrap_or(default_us);
    if let (Some(range), Some(_)) = (status.camera.capabilities.exposure_us, input.settings.exposure_us)
        && !(range.min..=range.max).contains(&exposure_us)
    {
        let detail = format!(
            "the exposure range of the camera is {} to {} µs, requested {exposure_us}",
            range.min, range.max
        );
        return Err(refused("exposure_us", detail, "choose an exposure within the range"));
    }
    if let Some(frame_rate_hz) = rows.frame_rate_hz
        && exposure_us * 1e-6 * frame_rate_hz >= 1.0
    {
        let detail = format!("an exposure of {exposure_us} µs does not fit into {frame_rate_hz:.1} frames/s");
        return Err(refused(
            "exposure_us",
            detail,
            "expose for a shorter time, or scan with fewer frames per second",
        ));
    }
    Ok(exposure_us)
}

/// The exposures of every row, shortest first; empty for a single exposure.
pub fn exposures_us(input: &ScanInput, rows: &Rows, status: &StationStatus) -> Result<Vec<f64>, AppError> {
    let mut exposures_us = input.settings.exposures_us.clone();
    if exposures_us.is_empty() {
        return Ok(exposures_us);
    }
    let refused = |detail: String, remedy: &str| Err(refused("exposures_us", detail, remedy));
    exposures_us.sort_by(f64::total_cmp);
    if !EXPOSURES.contains(&exposures_us.len()) {
        return refused(format!("{} exposures per row were requested", exposures_us.len()), "give two to four");
    }
    if input.settings.exposure_us.is_some() {
        return refused("exposure_us and exposures_us exclude each other".to_owned(), "omit one of them");
    }
    if rows.mode == ScanMode::Continuous {
        let detail = "several exposures per row need stop-and-go".to_owned();
        return refused(detail, "scan stop-and-go, or with one exposure");
    }
    if input.settings.background.is_some() {
        let detail = "ambient light subtraction is not available with several exposures per row".to_owned();
        return refused(detail, "omit background, or scan with one exposure");
    }
    if input.settings.keep_frames || input.settings.record {
        let detail = "frames of rows with several exposures cannot be kept or recorded".to_owned();
        return refused(detail, "omit keep_frames and record, or scan with one exposure");
    }
    let Some(range) = status.camera.capabilities.exposure_us else {
        return refused("this camera's exposure cannot be set".to_owned(), "scan with one exposure");
    };
    if let Some(beyond) = exposures_us.iter().find(|us| !(range.min..=range.max).contains(*us)) {
        let detail =
            format!("the exposure range of the camera is {} to {} µs, requested {beyond}", range.min, range.max);
        return refused(detail, "choose exposures within the range");
    }
    if exposures_us.windows(2).any(|pair| pair[1] < LEAST_EXPOSURE_RATIO * pair[0]) {
        let detail = format!("exposures of {exposures_us:?} µs are too similar");
        return refused(detail, "make each at least 1.5 times the previous one; four to eight times is usual");
    }
    Ok(exposures_us)
}

/// The requested laser power.
pub fn laser_power(input: &ScanInput, status: &StationStatus) -> Result<f64, AppError> {
    let power = input.settings.laser_power.unwrap_or(DEFAULT_LASER_POWER);
    let (min, max) = status.laser.capabilities.power.map_or((0.0, 1.0), |range| (range.min, range.max));
    if (min..=max).contains(&power) {
        return Ok(power);
    }
    let remedy = format!("give a fraction of full power from {min} to {max}");
    Err(refused("laser_power", format!("the laser cannot be set to power {power}"), remedy))
}

/// Laser-off images can be captured as requested.
pub fn background(input: &ScanInput, rows: &Rows, status: &StationStatus) -> Result<(), AppError> {
    let Some(requested) = input.settings.background else { return Ok(()) };
    if !status.laser.capabilities.switched {
        let detail = "the laser of this station cannot be switched off, so there are no laser-off images";
        return Err(refused("background", detail, "omit it, or connect the laser so that it can be switched"));
    }
    if input.settings.record {
        let detail = "a recording does not distinguish laser-off images from other frames";
        return Err(refused("background", detail, "omit record or background; keep_frames keeps both"));
    }
    if requested.every_rows == Some(0) {
        return Err(refused("background/every_rows", "every_rows is 0", "give 1 or more"));
    }
    if requested.every_rows.is_some() && rows.mode == ScanMode::Continuous {
        let detail = "a continuous scan captures laser-off images only before and after it";
        return Err(refused("background/every_rows", detail, "omit it, or scan stop-and-go"));
    }
    match requested.above_levels.filter(|levels| !(0.0..=255.0).contains(levels)) {
        None => Ok(()),
        Some(levels) => Err(refused(
            "background/above_levels",
            format!("above_levels is {levels}"),
            "give a level from 0 to 255",
        )),
    }
}

/// The maximum number of points, if within the limit.
pub fn points(n_rows: usize, rows: &Rows, calibration: &Calibration) -> Result<u64, AppError> {
    let camera = &calibration.camera;
    let per_row = (calibration.orders.len() * camera.width_px.max(camera.height_px)) as u64;
    let points = n_rows as u64 * per_row;
    if points <= POINTS_LIMIT {
        return Ok(points);
    }
    let rows_limit = POINTS_LIMIT / per_row.max(1);
    let detail = format!("{n_rows} rows may give {points} points; the limit is {POINTS_LIMIT}");
    let step = fields_of(rows.range.stage).step;
    Err(refused(step, detail, format!("plan at most {rows_limit} rows: increase the step or shorten the range")))
}

/// Notes for the operator before the scan starts.
pub fn notes(rows: &Rows, exposure_us: f64, status: &StationStatus, prediction: &Prediction) -> Vec<String> {
    let mut notes = Vec::new();
    if !status.homed && status.stage.capabilities.homing == Homing::Required {
        notes.push("the stage is not homed; home it before the scan".to_owned());
    }
    if !status.laser.capabilities.switched {
        notes.push(
            "the laser is not controlled by this station: it stays on before, during and after the scan, and after Stop"
                .to_owned(),
        );
    }
    if let Some(speed) = rows.range.speed {
        let (smear, unit) = (speed * exposure_us * 1e-6, rows.range.stage.unit());
        if smear > SMEAR_FRACTION * rows.range.step {
            notes.push(format!(
                "the part moves {smear:.3} {unit} during an exposure; use a shorter exposure or a lower speed"
            ));
        }
    }
    if rows.range.stage == StageKind::Rotary && rows.range.length() < CLOSING_TURN_DEG {
        notes.push(format!("a scan of less than {CLOSING_TURN_DEG}° does not show the closure of a turn"));
    }
    if prediction.unambiguous_depth_mm[0] > prediction.depth_mm[0]
        || prediction.unambiguous_depth_mm[1] < prediction.depth_mm[1]
    {
        let [near, far] = prediction.unambiguous_depth_mm;
        notes.push(format!("the order of lines on surfaces outside {near:.1}–{far:.1} mm is known only where a second line sees them; extend the range so that two lines do"));
    }
    notes
}
