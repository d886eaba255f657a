//! Scan a known part and compare: is the station still what its calibration says?

use metrology::{MeasureRequest, Tool};
use store::ResultRef;
use twin::{Scene, SceneKind, TwinControl};

use crate::jobs::scan::make;
use crate::jobs::{Done, JobContext, JobEnd, ScanInput, ScanSource, VerifyInput};
use crate::measurements::{changes, measurement};
use crate::problem::{Problem, ProblemKind};
use crate::progress::Phase;
use crate::stored_calibration::stored_document;
use crate::stored_scan::stored_cloud;

/// The kind of record that a verification ends with.
const MEASUREMENT: &str = "measurement";

/// Range of a verification's scan if nothing else is said, mm: the five lines of a station lie 13 mm apart and meet
/// every place of a part in the middle of the table.
const RANGE_MM: (f64, f64) = (-16.0, 16.0);

/// Distance of its rows, mm: a radius or a height needs thousands of points, not millions.
const STEP_MM: f64 = 0.4;

/// Scans and compares.
pub fn run(input: VerifyInput, ctx: &JobContext) -> Result<Done, JobEnd> {
    let (part, tool) = artefact(&input)?;
    let operator = match input.scan.source {
        ScanSource::Station => ctx.station.simulation(),
        ScanSource::Capture { .. } => None,
    };
    let at_work = operator.map(|operator| Exchanged::new(operator, &part, ctx));
    let made = make(&filled(&input), ctx)?;
    drop(at_work);
    let calibration_id = made.record.calibration_id.as_str();
    let document = ctx.wait(stored_document(&ctx.ledger, &*ctx.artifacts, Some(calibration_id)))?;
    ctx.report(1.0, Phase::Measuring, "measuring");
    let request = MeasureRequest {
        nominal_mm: Some(input.nominal_mm),
        tolerance_mm: input.tolerance_mm,
        ..MeasureRequest::new(tool)
    };
    let cloud = ctx.wait(stored_cloud(&*ctx.artifacts, &made.record))?;
    let record = measurement(&made.record, &cloud, &document.calibration(), &request)?;
    let mut stored = made.changes();
    stored.extend(changes(&record));
    Ok(Done {
        result: ResultRef { kind: MEASUREMENT.to_owned(), id: format!("{}/{}", record.scan_id, record.id) },
        message: in_words(&input, &record.result),
        changes: stored,
    })
}

/// The scan that a verification will run.
///
/// # Errors
/// A problem for an unknown part or an impossible number.
pub fn checked(input: &VerifyInput) -> Result<ScanInput, Problem> {
    artefact(input).map(|_| filled(input))
}

/// The part as the virtual operator knows it, and how it is measured.
fn artefact(input: &VerifyInput) -> Result<(SceneKind, Tool), Problem> {
    let refused = |field: &str, detail: String, remedy: &str| {
        Err(Problem::new(ProblemKind::Impossible, detail).at(format!("/{field}")).remedy(remedy))
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
        "gauge" => Ok((SceneKind::Gauge { height_mm: nominal_mm }, Tool::Step)),
        "sphere" => Ok((SceneKind::Sphere { radius_mm: nominal_mm }, Tool::Sphere)),
        other => refused("artefact", format!("there is no known part \"{other}\""), "use gauge or sphere"),
    }
}

/// The scan, with a range if none was given.
fn filled(input: &VerifyInput) -> ScanInput {
    let scan = input.scan.clone();
    if scan.source != ScanSource::Station || scan.resume_scan_id.is_some() {
        return scan;
    }
    let free = scan.step_mm.is_none() && scan.speed_mm_s.is_none();
    ScanInput {
        name: scan.name.or_else(|| Some(input.artefact.clone())),
        from_mm: scan.from_mm.or(Some(RANGE_MM.0)),
        to_mm: scan.to_mm.or(Some(RANGE_MM.1)),
        step_mm: if free { Some(STEP_MM) } else { scan.step_mm },
        ..scan
    }
}

/// The virtual operator has put the known part on the stage, and will put back what was there.
struct Exchanged {
    operator: TwinControl,
    before: Scene,
}

impl Exchanged {
    fn new(operator: TwinControl, part: &SceneKind, ctx: &JobContext) -> Self {
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

fn in_words(input: &VerifyInput, result: &serde_json::Value) -> String {
    let number = |key: &str| result[key].as_f64().unwrap_or(f64::NAN);
    let verdict = result["verdict"].as_str().map_or_else(String::new, |verdict| format!(", {verdict}"));
    format!(
        "{}: true {:.4} mm, measured {:.4} mm, U = {:.4} mm (k = 2){verdict}",
        input.artefact,
        input.nominal_mm,
        number("value"),
        number("expanded_uncertainty")
    )
}
