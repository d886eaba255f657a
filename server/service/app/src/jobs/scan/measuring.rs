//! Measurements in the scan job itself: the verdict does not depend on an open browser.

use std::time::Instant;

use serde_json::json;
use store::{Change, MeasurementRecord, ResultRef};

use crate::jobs::plan::TIMING;
use crate::jobs::progress::Phase;
use crate::jobs::scan::{MadeScan, SCAN};
use crate::jobs::{ComputeContext, Done, JobEnd};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::measurements::parts::{planned_measurements, verdict_of};
use crate::resources::measurements::{changes, planned_measurement};

/// A scan with the measurements of its plan.
pub struct Measured {
    /// The scan.
    pub made: MadeScan,
    /// Newest first.
    pub measurements: Vec<MeasurementRecord>,
}

/// Makes the measurements of the plan.
///
/// A job cancelled in between keeps its scan; missing measurements make the part invalid.
pub fn measured(mut made: MadeScan, ctx: &ComputeContext) -> Result<Measured, JobEnd> {
    let from = made.done_at;
    let planned = planned_measurements(&made.record.plan);
    let mut measurements = Vec::with_capacity(planned.len());
    if planned.is_empty() {
        return Ok(Measured { made, measurements });
    }
    let began = Instant::now();
    ctx.report(from, Phase::Measuring.counted(0, planned.len()), "measuring");
    let id = Some(made.record.calibration_id.as_str());
    let calibration = ctx.wait(stored_document(&ctx.catalogue, &*ctx.artifacts, id))?.calibration();
    let cloud = made.cloud(ctx)?;
    for (done, input) in planned.iter().enumerate() {
        if ctx.cancel.is_cancelled() {
            let unmeasured = Measured { made, measurements: Vec::new() };
            return Err(JobEnd::CancelledAfter(Box::new(unmeasured.done())));
        }
        let words = format!("measuring: {} of {}", done + 1, planned.len());
        let fraction = from + (1.0 - from) * done as f64 / planned.len() as f64;
        ctx.report(fraction, Phase::Measuring.counted(done + 1, planned.len()), &words);
        measurements.push(planned_measurement(&made.record, &cloud, &calibration, input)?);
    }
    measurements.reverse();
    made.record.report[TIMING]["measuring_s"] = json!(began.elapsed().as_secs_f64());
    made.record.report[TIMING]["n_measured"] = json!(planned.len());
    Ok(Measured { made, measurements })
}

impl Measured {
    /// Message for the operator, with the verdict.
    pub fn message(&self) -> String {
        let verdict = verdict_of(&self.made.record, &self.measurements).filter(|_| !self.measurements.is_empty());
        let verdict = verdict.map_or_else(String::new, |verdict| format!("; {}", verdict.label()));
        format!("{}{verdict}", self.made.message())
    }

    /// The changes that store scan and measurements.
    pub fn changes(&self) -> Vec<Change> {
        let mut all = self.made.changes();
        // Oldest first, as measured.
        all.extend(self.measurements.iter().rev().flat_map(changes));
        all
    }

    /// The end of a job that produced a scan.
    pub fn done(self) -> Done {
        let result = ResultRef { kind: SCAN.to_owned(), id: self.made.record.id.clone() };
        self.done_with(result, None)
    }

    /// The same with another result and final message.
    pub fn done_with(self, result: ResultRef, message: Option<String>) -> Done {
        let message = message.unwrap_or_else(|| self.message());
        let changes = self.changes();
        Done { result, message, changes, finished_work: self.made.work_of }
    }
}
