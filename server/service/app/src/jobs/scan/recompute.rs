//! Recomputes a scan from its peaks with another calibration and measures it again; the original is not changed.

use store::ScanRecord;

use crate::error::AppError;
use crate::jobs::plan::Pace;
use crate::jobs::progress::Phase;
use crate::jobs::scan::{Evaluating, Measured, ScanStory, check_camera_of, evaluated_share, made_scan, measured};
use crate::jobs::{ComputeContext, Done, JobEnd, RecomputeInput, ScanMode};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::measurements::parts::planned_measurements;
use crate::resources::stored_scan::{cloud_name, new_id, stored_peaks};

/// Fraction of the job for reading the peaks.
const READING: f64 = 0.05;

/// Computes and measures.
pub fn run(input: RecomputeInput, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    let scan = ctx.wait(ctx.catalogue.read().scan(&input.scan_id))?;
    recomputed(&scan, input.calibration_id.as_deref(), ctx, |measured| Ok(measured.done()))
}

/// The scan with the calibration (`None`: the active one), measured as the original, for what `then` makes of it.
pub fn recomputed(
    scan: &ScanRecord,
    calibration_id: Option<&str>,
    ctx: &ComputeContext,
    then: impl FnOnce(Measured) -> Result<Done, JobEnd>,
) -> Result<Done, JobEnd> {
    // Both scans refer to them: they are kept even if the original is deleted in the meantime.
    let lost = |error| AppError::from(error).of_stored(&format!("the peaks of scan {}", scan.id));
    ctx.wait(ctx.artifacts.hold(&scan.peaks)).map_err(lost)?;
    let done = computed(scan, calibration_id, ctx).and_then(then);
    if done.is_err() {
        ctx.artifacts.release(&scan.peaks);
    }
    done
}

fn computed(scan: &ScanRecord, calibration_id: Option<&str>, ctx: &ComputeContext) -> Result<Measured, JobEnd> {
    let document = ctx.wait(stored_document(&ctx.catalogue, &*ctx.artifacts, calibration_id))?;
    ctx.report(0.0, Phase::ReadingPeaks, "reading the peaks of the scan");
    let frames = ctx.wait(stored_peaks(&*ctx.artifacts, &scan.peaks, &scan.id))?;
    ctx.check_cancelled()?;
    check_camera_of(&frames, &document)?;
    let losses = serde_json::from_value(scan.report["losses"].clone()).unwrap_or_default();
    let story = ScanStory {
        id: new_id(),
        name: scan.name.clone(),
        cloud_name: cloud_name(scan),
        plan: scan.plan.clone(),
        state: scan.state,
        peaks: scan.peaks.clone(),
        capture_id: scan.capture_id.clone(),
        recomputed_from: Some(scan.id.clone()),
        display: None,
        replaces: false,
        losses,
        also: Vec::new(),
    };
    let pace = ctx.wait(Pace::learned(&ctx.catalogue, ScanMode::StopAndGo));
    let part = READING..evaluated_share(planned_measurements(&story.plan).len());
    let made = made_scan(ctx, story, &frames, &document, Evaluating { part, passes: pace.passes })?;
    measured(made, ctx)
}
