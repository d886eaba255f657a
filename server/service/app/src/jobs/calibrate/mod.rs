//! Calibration of camera, light sheets and stage: from a stored capture, at the simulated station, or from a session.
//!
//! In every case the images are first stored as a capture, and the calibration is computed from that capture by the
//! functions of `sheaf calibrate`: the same images give the same bytes.

mod product;
mod session;
mod station;

use crate::events::{Event, event};
use std::path::Path;

use crate::camera::correction::ImageDarkFrame;
use crate::error::disk_problem;
use crate::jobs::progress::Phase;
use crate::jobs::{CalibrateInput, ComputeContext, Done, JobEnd, StationContext};
use crate::resources::calibrations::used_station::UsedStation;
use crate::resources::captures::{CaptureOrigin, without_folder};
use pipeline::open_capture;
use product::{CalibrationImages, calibrated};

/// The record kind of calibrations.
pub const CALIBRATION: &str = "calibration";

pub use crate::sessions::virtual_operator::N_POSES;
pub use session::{SolveSession, solve_input};

/// Fraction of the job for capturing the images at the simulated station.
const TAKING: f64 = 0.5;

/// Fraction of the job for reading the images of a session.
const GATHERING: f64 = 0.05;

/// Fraction of the job after which the images are stored as a capture.
const STORING: f64 = 0.05;

/// Captures the images at the simulated station and calibrates from them.
pub fn at_station(input: &CalibrateInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    let name = format!("calibration job {}", ctx.id);
    let used = UsedStation::of(&ctx.station.status());
    let input = &CalibrateInput { station: Some(used), ..input.clone() };
    made_from(input, &name, ctx, TAKING, |folder| station::take_pictures(input, ctx, folder, TAKING))
}

/// Calibrates from the images of a session.
pub fn from_session(input: &CalibrateInput, session_id: &str, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    let name = format!("calibration session {session_id}");
    made_from(input, &name, ctx, GATHERING, |folder| session::gather_pictures(session_id, ctx, folder))
}

/// Calibrates from a stored capture.
pub fn from_capture(input: &CalibrateInput, capture_id: &str, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    ctx.report(0.0, Phase::UnpackingCapture, "unpacking the capture");
    let name = ctx.wait(ctx.catalogue.read().capture(capture_id))?.name;
    let checked_out = ctx.captures.check_out(capture_id)?;
    ctx.check_cancelled()?;
    compute(&checked_out.folder, (&name, capture_id, None), input, ctx, 0.0)
}

/// Calibrates from images that `take` writes to a folder, with the dark frame of each; the folder is kept as a capture even if the calibration fails.
fn made_from(
    input: &CalibrateInput,
    name: &str,
    ctx: &ComputeContext,
    taken: f64,
    take: impl FnOnce(&Path) -> Result<Vec<Option<ImageDarkFrame>>, JobEnd>,
) -> Result<Done, JobEnd> {
    let folder = tempfile::Builder::new().prefix("calibration-").tempdir_in(ctx.artifacts.workbench().scratch());
    let folder = folder.map_err(disk_problem)?;
    let dark_frames = take(folder.path())?;
    ctx.check_cancelled()?;
    ctx.report(taken, Phase::StoringImages, "storing the images");
    let (record, change) = ctx.captures.take_in_folder(folder.path(), CaptureOrigin::Calibration, name)?;
    let created = event(&record.id, Event::CaptureCreated((&record).into()));
    ctx.wait(ctx.catalogue.commit(vec![change, created]))?;
    compute(folder.path(), (name, &record.id, Some(&dark_frames)), input, ctx, taken + STORING)
}

fn compute(
    folder: &Path,
    (name, capture_id, dark_frames): (&str, &str, Option<&[Option<ImageDarkFrame>]>),
    input: &CalibrateInput,
    ctx: &ComputeContext,
    begun: f64,
) -> Result<Done, JobEnd> {
    let calibrate = |ctx: &ComputeContext| {
        let capture = open_capture(folder, &ctx.reporter(Phase::ReadingImages, begun..begun))?;
        let images = CalibrationImages { capture: &capture, capture_id, name, dark_frames };
        calibrated(&images, input, ctx, begun..1.0)
    };
    calibrate(ctx).map_err(|end| match end {
        JobEnd::Failed(problem) => without_folder(*problem, folder).into(),
        cancelled => cancelled,
    })
}
