//! Scan a known part and compare: is the station still what its calibration says?

use metrology::Tool;
use optics::StageKind;
use store::{MeasurementRecord, ResultRef};
use twin::{Scene, SceneKind, TwinControl};

use crate::config::AppConfig;
use crate::error::{AppError, ErrorKind};
use crate::jobs::plan::AskedRange;
use crate::jobs::scan::{Measured, at_station_measured, of_capture_measured};
use crate::jobs::{
    ComputeContext, Done, JobEnd, RecordedFrames, ScanInput, ScanSource, StationContext, VerifyInput,
};
use crate::progress::Phase;
use crate::resources::measurements::parts::verdict_in;
use crate::resources::measurements::{MeasureInput, ScanPurpose};
use crate::resources::scan_run::stage_kind;

/// The kind of record that a verification ends with.
const MEASUREMENT: &str = "measurement";

/// Range of a verification's scan if nothing else is said, mm: the five lines of a station lie 13 mm apart and meet
/// every place of a part in the middle of the table.
const RANGE_MM: (f64, f64) = (-16.0, 16.0);

/// Distance of its rows, mm: a radius or a height needs thousands of points, not millions.
const STEP_MM: f64 = 0.4;

/// The same on a turntable, degrees: a turn and what shows how well it closes.
const TURN_DEG: (f64, f64) = (0.0, 375.0);

/// Angle between its rows, degrees.
const TURN_STEP_DEG: f64 = 1.5;

/// Scans and compares; at the simulated station the virtual operator brings the part.
pub fn at_station(input: &VerifyInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    let part = artefact(input, &ctx.config)?;
    let at_work = ctx.station.simulation().map(|operator| Exchanged::new(operator, &part, ctx));
    let stage = stage_kind(&ctx.station.status());
    let measured = at_station_measured(&filled(input, stage), ctx)?;
    drop(at_work);
    compared(input, measured)
}

/// Compares what the frames of a capture show.
pub fn of_capture(input: &VerifyInput, frames: &RecordedFrames, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    compared(input, of_capture_measured(&filled(input, StageKind::Linear), frames, ctx)?)
}

fn compared(input: &VerifyInput, measured: Measured) -> Result<Done, JobEnd> {
    let record = measured.measurements.first().ok_or_else(|| {
        AppError::new(ErrorKind::Internal, "the known part was not measured").remedy("verify again")
    })?;
    let result = ResultRef { kind: MEASUREMENT.to_owned(), id: format!("{}/{}", record.scan_id, record.id) };
    let message = in_words(input, record);
    Ok(measured.done_with(result, Some(message)))
}

/// The scan that a verification will run at a station with such a stage.
///
/// # Errors
/// A problem for an unknown part or an impossible number.
pub fn checked(input: &VerifyInput, stage: StageKind) -> Result<ScanInput, AppError> {
    tool(input).map(|_| filled(input, stage))
}

/// The part as the virtual operator finds it beside the station: of its own true size, whatever a person believes it
/// to be.
fn artefact(input: &VerifyInput, config: &AppConfig) -> Result<SceneKind, AppError> {
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
    match input.artefact.as_str() {
        "gauge" => Ok(Tool::Step),
        "sphere" => Ok(Tool::Sphere),
        other => refused("artefact", format!("there is no known part \"{other}\""), "use gauge or sphere"),
    }
}

/// The scan with what is measured on it, and with a range if none was given.
fn filled(input: &VerifyInput, stage: StageKind) -> ScanInput {
    let known = MeasureInput {
        tool: if input.artefact == "gauge" { Tool::Step } else { Tool::Sphere }.name().to_owned(),
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
    let asked = AskedRange::of(&scan, stage);
    let free = asked.step.is_none() && asked.speed.is_none();
    let range = AskedRange {
        from: asked.from.or(Some(usual.0)),
        to: asked.to.or(Some(usual.1)),
        step: if free { Some(usual_step) } else { asked.step },
        ..asked
    };
    let name = scan.name.clone().or_else(|| Some(input.artefact.clone()));
    ScanInput { name, ..range.filled_into(&scan) }
}

/// The virtual operator has put the known part on the stage, and will put back what was there.
struct Exchanged {
    operator: TwinControl,
    before: Scene,
}

impl Exchanged {
    fn new(operator: TwinControl, part: &SceneKind, ctx: &ComputeContext) -> Self {
        let words = format!("the virtual operator puts a {} on the stage", part.name());
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

fn in_words(input: &VerifyInput, record: &MeasurementRecord) -> String {
    let number =
        |key: &str| record.result[key].as_f64().map_or_else(|| "–".to_owned(), |mm| format!("{mm:.4} mm"));
    let verdict = verdict_in(record).map_or_else(String::new, |verdict| format!(", {}", verdict.label()));
    format!(
        "{}: nominal {:.4} mm, measured {}, U = {} (k = 2){verdict}",
        input.artefact,
        input.nominal_mm,
        number("value"),
        number("expanded_uncertainty")
    )
}
