//! Calibrate camera, light and stage: from a stored capture, at the simulated station, or from a person's session.
//!
//! Whatever the source, the pictures become a capture first, and the calibration is computed from that capture by the
//! functions of `sheaf calibrate`: the same pictures give the same bytes.

mod product;

use crate::captures::without_folder;
use crate::jobs::{CalibrateInput, Done, JobContext, JobEnd, Source};
use crate::pipeline::open_capture;
use crate::problem::{Problem, ProblemKind};

use product::calibrated;

/// The kind of record that calibrations make.
pub const CALIBRATION: &str = "calibration";

/// Board poses that the virtual operator takes unless asked for another number.
pub const N_POSES: usize = 12;

/// Calibrates.
pub fn run(input: CalibrateInput, ctx: &JobContext) -> Result<Done, JobEnd> {
    match (&input.session_id, &input.source) {
        (None, Source::Capture { capture_id }) => from_capture(&input, capture_id, ctx),
        _ => Err(Problem::new(ProblemKind::Unavailable, "this build calibrates from captures alone").into()),
    }
}

fn from_capture(input: &CalibrateInput, capture_id: &str, ctx: &JobContext) -> Result<Done, JobEnd> {
    ctx.report(0.0, "unpacking the capture");
    let name = ctx.wait(ctx.ledger.read().capture(capture_id))?.name;
    let checked_out = ctx.captures.check_out(capture_id)?;
    ctx.go_on()?;
    let compute = || {
        let capture = open_capture(&checked_out.folder, &ctx.reporter(0.0..0.0))?;
        calibrated(&capture, &name, capture_id, input, ctx, 0.0..1.0)
    };
    compute().map_err(|end| match end {
        JobEnd::Failed(problem) => without_folder(*problem, &checked_out.folder).into(),
        cancelled => cancelled,
    })
}
