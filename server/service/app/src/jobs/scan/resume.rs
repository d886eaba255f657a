//! Resumes a stopped scan: same plan, same calibration, from the first missing row.

use scanning::files::peaks::PeaksFile;
use store::{ScanRecord, ScanState};

use crate::error::{AppError, ErrorKind};
use crate::jobs::plan::{RequestedRange, ScanPlan, ScanRun, fields_of};
use crate::jobs::progress::Phase;
use crate::jobs::{JobEnd, ScanInput, ScanMode, StationContext};
use crate::resources::measurements::{MeasureInput, ScanPurpose};
use crate::resources::scan_run::ScanSettings;
use crate::resources::stored_scan::stored_peaks;

/// The completed part of a scan.
pub struct Earlier {
    /// The partial record.
    pub record: ScanRecord,
    /// Its plan.
    pub plan: ScanPlan,
    /// Its measurements.
    pub measure: Vec<MeasureInput>,
    /// Its purpose.
    pub purpose: ScanPurpose,
    /// Its frames.
    pub frames: PeaksFile,
    /// Frames lost so far, as text.
    pub losses: Vec<String>,
}

fn conflict(detail: String, remedy: &str) -> AppError {
    AppError::new(ErrorKind::Conflict, detail).at("/resume_scan_id").remedy(remedy)
}

/// The scan to resume, if requested.
pub fn earlier(input: &ScanInput, ctx: &StationContext) -> Result<Option<Earlier>, JobEnd> {
    let Some(id) = &input.resume_scan_id else { return Ok(None) };
    let record = ctx.wait(ctx.catalogue.read().scan(id))?;
    if record.state != ScanState::Partial || record.recomputed_from.is_some() {
        let detail = format!("scan {id} is not a stopped scan of this station and cannot be resumed");
        return Err(conflict(detail, "start a new scan").into());
    }
    if let Some(wanted) = input.calibration_id.as_ref().filter(|wanted| **wanted != record.calibration_id) {
        let detail = format!("scan {id} was started with calibration {}, not {wanted}", record.calibration_id);
        return Err(conflict(detail, "resume it with its own calibration and recompute it afterwards").into());
    }
    let run = ScanRun::of(&record)?;
    let Some(plan) = run.plan else {
        return Err(conflict(format!("scan {id} was not captured by this station"), "start a new scan").into());
    };
    ctx.report(0.0, Phase::ReadingRows, "reading the rows captured so far");
    let frames = ctx.wait(stored_peaks(&*ctx.artifacts, &record.peaks, &record.id))?;
    let losses = serde_json::from_value(record.report["losses"].clone()).unwrap_or_default();
    Ok(Some(Earlier { record, plan, measure: run.measure, purpose: run.purpose, frames, losses }))
}

impl Earlier {
    /// The input, completed from the earlier plan.
    pub fn filled(&self, input: &ScanInput) -> ScanInput {
        let plan = &self.plan;
        let own = &input.settings;
        let mode = own.mode.unwrap_or(plan.mode);
        let continuous = mode == ScanMode::Continuous;
        let requested = RequestedRange::of(own, plan.range.stage);
        let speed = requested.speed.or(plan.range.speed.filter(|_| continuous));
        let step = requested.step.or(Some(plan.range.step));
        let [from, to] = [requested.from.or(Some(plan.range.from)), requested.to.or(Some(plan.range.to))];
        let ranged = RequestedRange { from, to, step, speed, ..requested }.filled_into(own);
        let exposures_us = if own.exposures_us.is_empty() { &plan.exposures_us } else { &own.exposures_us };
        let settings = ScanSettings {
            mode: Some(mode),
            exposure_us: own.exposure_us.or(plan.exposures_us.is_empty().then_some(plan.exposure_us)),
            exposures_us: exposures_us.clone(),
            laser_power: own.laser_power.or(Some(plan.laser_power)),
            keep_frames: own.keep_frames || plan.keep_frames,
            background: own.background.or(plan.background),
            ..ranged
        };
        ScanInput {
            settings,
            calibration_id: Some(self.record.calibration_id.clone()),
            measure: self.measure.clone(),
            purpose: self.purpose,
            ..input.clone()
        }
    }

    /// Checks that frames of `plan` match the existing ones.
    ///
    /// # Errors
    /// A problem: another range, step, speed, exposure or power.
    pub fn check(&self, plan: &ScanPlan) -> Result<(), AppError> {
        if plan.continues(&self.plan) {
            return Ok(());
        }
        let detail =
            format!("scan {} was started with another plan: {}", self.record.id, differences(plan, &self.plan));
        Err(conflict(detail, "omit the settings of the scan, or start a new scan"))
    }
}

fn differences(plan: &ScanPlan, earlier: &ScanPlan) -> String {
    let (names, range, of_earlier) = (fields_of(plan.range.stage), &plan.range, &earlier.range);
    let pairs = [
        (names.from, range.from, of_earlier.from),
        (names.to, range.to, of_earlier.to),
        (names.step, range.step, of_earlier.step),
        ("exposure_us", plan.exposure_us, earlier.exposure_us),
        ("laser_power", plan.laser_power, earlier.laser_power),
    ];
    let named: Vec<String> =
        pairs.iter().filter(|(_, a, b)| a != b).map(|(name, a, b)| format!("{name} {a} instead of {b}")).collect();
    if named.is_empty() { "mode, speed or images differ".to_owned() } else { named.join(", ") }
}
