//! What a scan that cannot work is refused for, each with its place in the input and its remedy.

use devices::Homing;
use optics::{Calibration, StageKind};
use station::StationStatus;

use super::asked::{AskedRange, fields_of};
use super::motion::run_up;
use super::params::{
    CLOSING_TURN_DEG, DEFAULT_LASER_POWER, DEFAULT_STEP_DEG, DEFAULT_STEP_MM, EXPOSURES, LEAST_EXPOSURE_RATIO,
    POINTS_LIMIT, RESOLUTION_SHARE, SMEAR_SHARE, STEP_MIN,
};
use super::prediction::Prediction;
use super::{Rows, mode_of};
use crate::error::{AppError, ErrorKind};
use crate::jobs::{ScanInput, ScanMode};
use crate::resources::scan_run::{ScanRange, stage_kind};

pub fn refused(field: &str, detail: impl Into<String>, remedy: impl Into<String>) -> AppError {
    AppError::new(ErrorKind::Impossible, detail).at(format!("/{field}")).remedy(remedy)
}

/// Every number is one, and has the right sign.
pub fn numbers(input: &ScanInput) -> Result<(), AppError> {
    let ranges = [StageKind::Linear, StageKind::Rotary].map(|stage| AskedRange::of(input, stage));
    let signed = ranges.iter().flat_map(|range| {
        let names = fields_of(range.stage);
        range.given().map(move |(field, value)| (field, value, [names.step, names.speed].contains(&field)))
    });
    let others = [("exposure_us", input.exposure_us), ("laser_power", input.laser_power)];
    let others = others.into_iter().filter_map(|(field, value)| Some((field, value?, true)));
    for (field, value, positive) in signed.chain(others) {
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
    let asked = AskedRange::checked(input, stage_kind(status))?;
    let names = fields_of(asked.stage);
    let ends = [(names.from, asked.from), (names.to, asked.to)];
    if let Some((field, _)) = ends.iter().find(|(_, end)| end.is_none()) {
        let remedy = "say from which to which stage position to scan";
        return Err(refused(field, format!("a scan from the station needs {field}"), remedy));
    }
    if input.mode == Some(ScanMode::StopAndGo) && asked.speed.is_some() {
        let remedy = "leave it out, or choose the mode continuous";
        return Err(refused(names.speed, "a stop-and-go scan has no speed of its own", remedy));
    }
    let (resolution, default_step) = (status.stage.capabilities.resolution_mm, default_step(asked.stage));
    let range = ScanRange {
        stage: asked.stage,
        from: asked.from.unwrap_or(0.0),
        to: asked.to.unwrap_or(0.0),
        step: asked.step.unwrap_or(default_step.max(resolution)),
        speed: None,
    };
    let mut rows = Rows { mode: mode_of(input), range, frame_rate_hz: None };
    let amount = |way| range.amount(way);
    if rows.mode == ScanMode::Continuous {
        sweep(&mut rows, &asked, status)?;
    } else if range.step < resolution * RESOLUTION_SHARE {
        let (step, resolution) = (amount(range.step), amount(resolution));
        let detail = format!("rows {step} apart are finer than this stage's steps of {resolution}");
        return Err(refused(names.step, detail, format!("give {resolution} or more")));
    }
    if rows.range.step < STEP_MIN {
        let (step, least) = (amount(rows.range.step), amount(STEP_MIN));
        let detail = format!("rows {step} apart are below the {least} a stage can be read back to");
        let field = if asked.step.is_some() { names.step } else { names.speed };
        return Err(refused(field, detail, "scan more coarsely"));
    }
    Ok(rows)
}

fn default_step(stage: StageKind) -> f64 {
    match stage {
        StageKind::Linear => DEFAULT_STEP_MM,
        StageKind::Rotary => DEFAULT_STEP_DEG,
    }
}

/// Speed, step and frame rate of a continuous scan: what is not given follows from the rest.
fn sweep(rows: &mut Rows, asked: &AskedRange, status: &StationStatus) -> Result<(), AppError> {
    let stage = &status.stage.capabilities;
    let (range, names) = (&mut rows.range, fields_of(asked.stage));
    if stage.follows_frames {
        let recorded = stage.resolution_mm;
        if asked.step.is_some_and(|step| (step / recorded - 1.0).abs() > 1.0 - RESOLUTION_SHARE) {
            let recorded = range.amount(recorded);
            let detail = format!("the recorded frames are {recorded} apart, a sweep takes them as they are");
            return Err(refused(names.step, detail, "leave it out, or scan stop-and-go"));
        }
        range.step = recorded;
    }
    if range.from == range.to {
        let detail = format!("a continuous scan needs a way to go, {} equals {}", names.from, names.to);
        return Err(refused(names.to, detail, format!("give another {}, or scan stop-and-go", names.to)));
    }
    let rate_hz = status.camera_settings.frame_rate_hz;
    let given_step = if stage.follows_frames { Some(range.step) } else { asked.step };
    let (speed, frame_rate_hz) = match (asked.speed, given_step) {
        (Some(speed), Some(step)) => (speed, speed / step),
        (Some(speed), None) => (speed, rate_hz),
        (None, _) => (range.step * rate_hz, rate_hz),
    };
    range.step = speed / frame_rate_hz;
    let top_speed = stage.max_speed_mm_s;
    if speed > top_speed {
        let (needed, top) = (range.amount(speed), range.amount(top_speed));
        let detail = format!("the scan needs {needed}/s, the stage moves at most at {top}/s");
        let field = if asked.speed.is_some() { names.speed } else { names.step };
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

/// The range with its run-up lies within the travel, and the way of the stage is known.
pub fn travel(rows: &Rows, calibration: &Calibration, status: &StationStatus) -> Result<(), AppError> {
    let range = &rows.range;
    if calibration.stage.is_none() && range.from != range.to {
        let (detail, remedy) = match range.stage {
            StageKind::Linear => {
                ("does not know which way the stage moves", "calibrate with at least two stage views")
            }
            StageKind::Rotary => {
                ("does not know the axis of the turntable", "calibrate with at least three stage views at angles")
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
    if input.background.is_some() {
        let detail = "a picture with the laser off has one exposure, these rows have several".to_owned();
        return refused(detail, "leave out background, or scan with one exposure");
    }
    if input.keep_frames || input.record {
        let detail = "pictures of rows with several exposures cannot be kept or recorded".to_owned();
        return refused(detail, "leave out keep_frames and record, or scan with one exposure");
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
    Err(refused("laser_power", format!("the laser cannot be set to power {power}"), remedy))
}

/// Pictures with the laser off can be taken as asked.
pub fn background(input: &ScanInput, rows: &Rows, status: &StationStatus) -> Result<(), AppError> {
    let Some(asked) = input.background else { return Ok(()) };
    if !status.laser.capabilities.switched {
        let detail = "the laser cannot be switched off here, so that nothing can be seen without it";
        return Err(refused("background", detail, "leave it out, or connect the laser to be switched"));
    }
    if input.record {
        let detail = "a recording would not say which frames are backgrounds";
        return Err(refused("background", detail, "leave out record or background; keep_frames keeps both"));
    }
    if asked.every_rows == Some(0) {
        return Err(refused("background/every_rows", "every_rows is 0", "give 1 or more"));
    }
    if asked.every_rows.is_some() && rows.mode == ScanMode::Continuous {
        let detail = "a continuous scan has its pictures with the laser off before and after it";
        return Err(refused("background/every_rows", detail, "leave it out, or scan stop-and-go"));
    }
    match asked.above_levels.filter(|levels| !(0.0..=255.0).contains(levels)) {
        None => Ok(()),
        Some(levels) => Err(refused(
            "background/above_levels",
            format!("above_levels is {levels}"),
            "give a level from 0 to 255",
        )),
    }
}

/// The most points there can be, if they can be computed with.
pub fn points(n_rows: usize, rows: &Rows, calibration: &Calibration) -> Result<u64, AppError> {
    let camera = &calibration.camera;
    let per_row = (calibration.orders.len() * camera.width_px.max(camera.height_px)) as u64;
    let points = n_rows as u64 * per_row;
    if points <= POINTS_LIMIT {
        return Ok(points);
    }
    let rows_limit = POINTS_LIMIT / per_row.max(1);
    let detail = format!("{n_rows} rows may give {points} points, more than the {POINTS_LIMIT} a scan may have");
    let step = fields_of(rows.range.stage).step;
    Err(refused(step, detail, format!("plan at most {rows_limit} rows: a larger step, or a shorter range")))
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
    if let Some(speed) = rows.range.speed {
        let (smear, unit) = (speed * exposure_us * 1e-6, rows.range.stage.unit());
        if smear > SMEAR_SHARE * rows.range.step {
            notes.push(format!("the part moves {smear:.3} {unit} during an exposure; expose for a shorter time, or scan more slowly"));
        }
    }
    if rows.range.stage == StageKind::Rotary && rows.range.length() < CLOSING_TURN_DEG {
        notes.push(format!("less than {CLOSING_TURN_DEG}° does not show how well a turn closes"));
    }
    if prediction.unambiguous_depth_mm[0] > prediction.depth_mm[0]
        || prediction.unambiguous_depth_mm[1] < prediction.depth_mm[1]
    {
        let [near, far] = prediction.unambiguous_depth_mm;
        notes.push(format!("parts that reach out of {near:.1}–{far:.1} mm are resolved by a second line only; scan far enough that two lines see them"));
    }
    notes
}
