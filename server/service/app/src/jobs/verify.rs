//! Verification: scans a reference part and compares it with its nominal value.

use metrology::Tool;
use optics::StageKind;
use store::{MeasurementRecord, ResultRef};
use twin::{Scene, SceneKind, TwinControl};

use crate::config::AppConfig;
use crate::error::{AppError, ErrorKind};
use crate::jobs::plan::RequestedRange;
use crate::jobs::progress::Phase;
use crate::jobs::scan::{Measured, at_station_measured, of_capture_measured};
use crate::jobs::{
    ComputeContext, Done, JobEnd, RecordedFrames, ScanInput, ScanSource, StationContext, VerifyInput,
};
use crate::resources::measurements::parts::verdict_in;
use crate::resources::measurements::{MeasureInput, ScanPurpose};
use crate::resources::scan_run::stage_kind;

/// The result kind of a verification.
const MEASUREMENT: &str = "measurement";

/// Default range of a verification scan, mm: the five lines are 13 mm apart, so all of them sweep a part in the middle of
/// the table.
const RANGE_MM: (f64, f64) = (-16.0, 16.0);

/// Default distance between rows, mm: a radius or a height needs thousands of points, not millions.
const STEP_MM: f64 = 0.4;

/// Default range on a turntable, degrees: a full turn and an overlap that shows the closure.
const TURN_DEG: (f64, f64) = (0.0, 375.0);

/// Default angle between rows, degrees.
const TURN_STEP_DEG: f64 = 1.5;

/// Scans and compares; on the simulated station the virtual operator places the part.
pub fn at_station(input: &VerifyInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    let part = reference_part(input, &ctx.config)?;
    let at_work = ctx.station.simulation().map(|operator| Exchanged::new(operator, &part, ctx));
    let stage = stage_kind(&ctx.station.status());
    let measured = at_station_measured(&filled(input, stage), ctx)?;
    drop(at_work);
    compared(input, measured)
}

/// Compares the part in the frames of a capture.
pub fn of_capture(input: &VerifyInput, frames: &RecordedFrames, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    compared(input, of_capture_measured(&filled(input, StageKind::Linear), frames, ctx)?)
}

fn compared(input: &VerifyInput, measured: Measured) -> Result<Done, JobEnd> {
    let record = measured.measurements.first().ok_or_else(|| {
        AppError::new(ErrorKind::Internal, "the reference part was not measured").remedy("verify again")
    })?;
    let result = ResultRef { kind: MEASUREMENT.to_owned(), id: format!("{}/{}", record.scan_id, record.id) };
    let message = message(input, record);
    Ok(measured.done_with(result, Some(message)))
}

/// The scan of a verification on a station with this kind of stage.
///
/// # Errors
/// A problem for an unknown part or an invalid number.
pub fn checked(input: &VerifyInput, stage: StageKind) -> Result<ScanInput, AppError> {
    tool(input).map(|_| filled(input, stage))
}

/// The simulated part with its true size, regardless of the nominal value.
fn reference_part(input: &VerifyInput, config: &AppConfig) -> Result<SceneKind, AppError> {
    let (height_mm, radius_mm) = config.known_sizes_mm();
    Ok(match tool(input)? {
        Tool::Step => SceneKind::Gauge { height_mm },
        _ => SceneKind::Sphere { radius_mm },
    })
}

/// How the part is measured.
fn tool(input: &VerifyInput) -> Result<Tool, AppError> {
    let refused = |field: &str, detail: String, remedy: &str| {
        Err(AppError::new(ErrorKind::Impossible, detail).at(format!("/{field}")).remedy(remedy))
    };
    let nominal_mm = input.nominal_mm;
    if !(nominal_mm.is_finite() && nominal_mm > 0.0) {
        return refused("nominal_mm", format!("nominal_mm is {nominal_mm}"), "give its size in millimetres");
    }
    if let Some(tolerance_mm) = input.tolerance_mm
        && !(tolerance_mm.is_finite() && tolerance_mm > 0.0)
    {
        return refused("tolerance_mm", format!("tolerance_mm is {tolerance_mm}"), "give a number above 0");
    }
    match input.reference_part.as_str() {
        "gauge" => Ok(Tool::Step),
        "sphere" => Ok(Tool::Sphere),
        other => refused("reference_part", format!("unknown reference part \"{other}\""), "use gauge or sphere"),
    }
}

/// The scan with its measurement, and with a default range if none was given.
fn filled(input: &VerifyInput, stage: StageKind) -> ScanInput {
    let known = MeasureInput {
        tool: if input.reference_part == "gauge" { Tool::Step } else { Tool::Sphere }.name().to_owned(),
        name: None,
        nominal_mm: Some(input.nominal_mm),
        tolerance_mm: input.tolerance_mm,
        region_mm: None,
        seed: None,
    };
    let mut scan = ScanInput { purpose: ScanPurpose::Verification, ..input.scan.clone() };
    if scan.resume_scan_id.is_none() {
        scan.measure = vec![known];
    }
    if scan.source != ScanSource::Station || scan.resume_scan_id.is_some() {
        return scan;
    }
    let (usual, usual_step) = match stage {
        StageKind::Linear => (RANGE_MM, STEP_MM),
        StageKind::Rotary => (TURN_DEG, TURN_STEP_DEG),
    };
    let requested = RequestedRange::of(&scan.settings, stage);
    let free = requested.step.is_none() && requested.speed.is_none();
    let range = RequestedRange {
        from: requested.from.or(Some(usual.0)),
        to: requested.to.or(Some(usual.1)),
        step: if free { Some(usual_step) } else { requested.step },
        ..requested
    };
    let name = scan.name.clone().or_else(|| Some(input.reference_part.clone()));
    let settings = range.filled_into(&scan.settings);
    ScanInput { name, settings, ..scan }
}

/// The virtual operator has placed the reference part on the stage and will restore the previous scene.
struct Exchanged {
    operator: TwinControl,
    before: Scene,
}

impl Exchanged {
    fn new(operator: TwinControl, part: &SceneKind, ctx: &ComputeContext) -> Self {
        let words = format!("the virtual operator places a {} on the stage", part.name());
        ctx.report(0.0, Phase::PlacingPart, &words);
        let before = (*operator.scene()).clone();
        operator.place_part(part);
        Self { operator, before }
    }
}

impl Drop for Exchanged {
    fn drop(&mut self) {
        self.operator.place(self.before.clone());
    }
}

fn message(input: &VerifyInput, record: &MeasurementRecord) -> String {
    let number =
        |key: &str| record.result[key].as_f64().map_or_else(|| "–".to_owned(), |mm| format!("{mm:.4} mm"));
    let verdict = verdict_in(record).map_or_else(String::new, |verdict| format!(", {}", verdict.label()));
    format!(
        "{}: nominal {:.4} mm, measured {}, U = {} (k = 2){verdict}",
        input.reference_part,
        input.nominal_mm,
        number("value"),
        number("expanded_uncertainty")
    )
}
