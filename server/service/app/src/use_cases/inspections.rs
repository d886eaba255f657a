//! Inspections: start, re-evaluate, try a plan; hold and resume their queue.

use std::time::Duration;

use metrology::{PartVerdict, Plan};
use report::tables::plan_json;
use serde_json::Value;
use store::{Change, JobRecord, JobState, ScanRecord};

use crate::App;
use crate::access::principal::Principal;
use crate::control::{Request, admit};
use crate::error::{AppError, ErrorKind};
use crate::jobs::inspect::without_scan;
use crate::jobs::{InspectInput, InspectionHold, JobInput, JobView, ReEvaluateInput, ScanSource};
use crate::resources::inspections::{InspectedPart, judged};
use crate::resources::labels::label;
use crate::resources::models::{models_of, require_models, surface_profiles};
use crate::resources::recipes::check::{check_attributes, check_plan, refused};
use crate::resources::recipes::{RecipeRef, RecipeVersion, found};
use crate::use_cases::jobs::start_job;
use crate::use_cases::measurements::on_cloud;

/// Requests the inspection of a part on the station, together with what `and` returns; without a recipe it is selected by
/// serial number.
///
/// # Errors
/// No recipe is found, the serial number or an attribute is invalid, or as [`start_job`].
pub async fn inspect(
    app: &App,
    by: &Principal,
    recipe: Option<RecipeRef>,
    part: InspectedPart,
    and: impl FnOnce(&JobRecord) -> Vec<Change>,
) -> Result<JobRecord, AppError> {
    inspect_from(app, by, ScanSource::Station, recipe, part, and).await
}

/// The same with the frames of a source: of a capture, it is a computation that needs no station.
///
/// # Errors
/// As [`inspect`]; the capture does not exist.
pub async fn inspect_from(
    app: &App,
    by: &Principal,
    source: ScanSource,
    recipe: Option<RecipeRef>,
    part: InspectedPart,
    and: impl FnOnce(&JobRecord) -> Vec<Change>,
) -> Result<JobRecord, AppError> {
    label(&part.serial, "/serial")?;
    if let Some(order) = &part.order {
        label(order, "/order")?;
    }
    check_attributes(part.attributes.iter(), "/attributes")?;
    let version = found(&app.catalogue, recipe.as_ref(), &part.serial).await?;
    check_outputs(app, &version)?;
    let input = InspectInput { recipe_id: version.id, recipe_version: version.version, part, source };
    start_job(app, by, JobInput::Inspection(input), and).await
}

/// Requests a re-evaluation of the scan of an inspection, together with what `and` returns; without a recipe, with the
/// newest version of its own; without a calibration, with that of the scan.
///
/// # Errors
/// The inspection, the recipe or the calibration does not exist, its scan was deleted, or as [`start_job`].
pub async fn re_evaluate(
    app: &App,
    by: &Principal,
    id: &str,
    recipe: Option<RecipeRef>,
    calibration_id: Option<String>,
    and: impl FnOnce(&JobRecord) -> Vec<Change>,
) -> Result<JobRecord, AppError> {
    let earlier = app.catalogue.read().inspection(id).await?;
    if earlier.scan_id.is_none() {
        return Err(without_scan(&earlier));
    }
    let recipe = recipe.unwrap_or(RecipeRef::Id { id: earlier.recipe_id, version: None });
    let version = found(&app.catalogue, Some(&recipe), &earlier.serial).await?;
    check_outputs(app, &version)?;
    let input = ReEvaluateInput {
        inspection_id: earlier.id,
        recipe_id: version.id,
        recipe_version: version.version,
        calibration_id,
    };
    start_job(app, by, JobInput::ReEvaluation(input), and).await
}

/// What an inspection with a plan would say about a scanned part.
#[derive(Debug)]
pub struct Evaluation {
    /// The scan.
    pub scan: ScanRecord,
    /// The verdict on the part.
    pub verdict: PartVerdict,
    /// Values, uncertainties and verdicts, as an inspection stores them.
    pub result: Value,
}

/// Measures a plan on the cloud of a scan and judges the part as an inspection would; stores nothing. Takes up to some
/// seconds. `permit` is dropped when the computation has ended, also if the caller no longer waits for it.
///
/// # Errors
/// The plan is inconsistent (at `/plan`), the scan does not exist, or it has no cloud.
pub async fn evaluate_plan(
    app: &App,
    scan_id: &str,
    plan: Plan,
    permit: impl Send + 'static,
) -> Result<Evaluation, AppError> {
    check_plan(&plan, "/plan")?;
    let models = models_of(&*app.artifacts, &plan).await?;
    require_models(&models, &plan, "/plan")?;
    on_cloud(app, scan_id, permit, move |scan, cloud, calibration| {
        let result = judged(&plan, &scan, cloud, calibration, &models)?;
        Ok(Evaluation { scan, verdict: result.verdict, result: plan_json(&result) })
    })
    .await
}

/// The deviations of the points of a scan from the CAD model of a surface profile, at most about `limit` points, evenly
/// thinned: x, y, z in the frame of the scan, the deviation (NaN where there is no surface to compare with), and its
/// standard uncertainty, mm.
///
/// # Errors
/// As [`evaluate_plan`]; the characteristic is no surface profile, or could not be measured.
pub async fn deviations(
    app: &App,
    scan_id: &str,
    plan: Plan,
    characteristic: &str,
    limit: usize,
    permit: impl Send + 'static,
) -> Result<Vec<[f32; 5]>, AppError> {
    check_plan(&plan, "/plan")?;
    let plan = surface_profiles(&plan, |id| id == characteristic);
    if plan.characteristics.is_empty() {
        let detail = format!("the plan has no surface profile \"{characteristic}\"");
        return Err(refused("/characteristic", detail, "name one of its surface profiles"));
    }
    let models = models_of(&*app.artifacts, &plan).await?;
    require_models(&models, &plan, "/plan")?;
    on_cloud(app, scan_id, permit, move |scan, cloud, calibration| {
        let result = judged(&plan, &scan, cloud, calibration, &models)?;
        let measured = result.characteristics.first();
        let Some(comparison) = measured.and_then(|measured| measured.comparison.as_deref()) else {
            let why = measured.and_then(|measured| measured.failure.as_ref()).map(ToString::to_string);
            return Err(AppError::new(ErrorKind::Impossible, "the surface could not be compared with its model")
                .because(why.unwrap_or_default())
                .remedy("check the alignment and the model"));
        };
        let step = cloud.points.len().div_ceil(limit).max(1);
        let points = cloud.points.iter().zip(comparison.deviations_mm.iter().zip(&comparison.u_mm)).step_by(step);
        Ok(points
            .map(|(at, (deviation, u))| [at.x_mm as f32, at.y_mm as f32, at.z_mm as f32, *deviation, *u])
            .collect())
    })
    .await
}

/// A result that would reach nobody is refused before the part is measured.
fn check_outputs(app: &App, version: &RecipeVersion) -> Result<(), AppError> {
    match version.recipe.outputs.iter().flatten().find(|door| !app.doors.has(door)) {
        None => Ok(()),
        Some(door) => {
            let detail =
                format!("the results of recipe {} are for door {door}, which is not configured", version.id);
            Err(refused("/recipe", detail, "configure the door, or publish a version with other outputs"))
        }
    }
}

/// Waits for the end of a job, at most `limit`; returns its state then.
///
/// # Errors
/// The job does not exist.
pub async fn wait_for_job(app: &App, id: &str, limit: Duration) -> Result<JobView, AppError> {
    let mut news = app.jobs.watch_progress();
    let ended = async {
        loop {
            news.borrow_and_update();
            let view = app.jobs.view(id).await?;
            if view.record.state.is_terminal() || news.changed().await.is_err() {
                return Ok::<_, AppError>(view);
            }
        }
    };
    match tokio::time::timeout(limit, ended).await {
        Ok(view) => view,
        Err(_) => app.jobs.view(id).await,
    }
}

/// Holds the queue: no further inspection starts; a running one completes.
///
/// # Errors
/// Someone else is in control, or the store cannot be written.
pub async fn hold_inspections(app: &App, by: &Principal, reason: Option<String>) -> Result<(), AppError> {
    if let Some(reason) = &reason {
        label(reason, "/reason")?;
    }
    admit(app, by, Request::CancelJob)?;
    app.jobs.hold_inspections(by, reason).await
}

/// Ends a hold: waiting inspections start.
///
/// # Errors
/// As [`hold_inspections`].
pub async fn resume_inspections(app: &App, by: &Principal) -> Result<(), AppError> {
    admit(app, by, Request::CancelJob)?;
    app.jobs.resume_inspections(by).await
}

/// The inspection queue.
#[derive(Debug, Clone, PartialEq)]
pub struct InspectionQueue {
    /// The hold, if there is one.
    pub hold: Option<InspectionHold>,
    /// Number of waiting inspections.
    pub n_waiting: usize,
    /// The running inspection.
    pub running_job_id: Option<String>,
}

/// The state of the inspection queue.
///
/// # Errors
/// The store cannot be read.
pub async fn inspection_queue(app: &App) -> Result<InspectionQueue, AppError> {
    let all = store::Page { before: None, limit: u32::MAX };
    let is_one = |view: &JobView| view.record.kind == "inspection";
    let running = app.jobs.list(Some(JobState::Running), &all).await?.records;
    let waiting = app.jobs.list(Some(JobState::Queued), &all).await?.records;
    Ok(InspectionQueue {
        hold: app.jobs.inspection_hold(),
        n_waiting: waiting.iter().filter(|view| is_one(view) && view.record.state == JobState::Queued).count(),
        running_job_id: running.into_iter().find(is_one).map(|view| view.record.id),
    })
}
