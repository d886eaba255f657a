//! `sheaf measure`: one measurement on a cloud, or all characteristics of a plan, with uncertainty and, given limits, a
//! verdict.

use std::path::Path;

use app::recipes::ModelFile;
use metrology::{
    Measure, MeasureRequest, Measurement, Models, Nominal, PartVerdict, Plan, Region, Tool, Verdict, evaluate,
    measure,
};
use optics::Calibration;
use scanning::Cloud;
use scanning::files::read_cloud;
use serde_json::json;

use crate::answer::exit::Exit;
use crate::arguments::MeasureArgs;
use crate::commands::Answer;
use pipeline::Failure;
use pipeline::Reporter;
use pipeline::extract;
use pipeline::read_document;
use report::tables::{measurement_json, measurement_text, plan_json, plan_text};

/// Measures; the exit code is the verdict's.
pub fn run(args: &MeasureArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let cloud = read_cloud(&args.cloud)?;
    let calibration = calibration_of(&cloud, args.calibration.as_deref())?;
    if calibration.is_none() {
        reporter.warn(
            "the cloud contains no calibration: the uncertainty is incomplete and no verdict is possible; give one with --calibration",
        );
    }
    if let Some(path) = &args.plan {
        return run_plan(&read_plan(path)?, path, &cloud, calibration.as_ref(), args);
    }
    let measurement = measure(&cloud, calibration.as_ref(), &request(args))
        .map_err(|error| Failure::from(error).in_file(&args.cloud))?;
    let mut json = measurement_json(&measurement);
    json["cloud"] = json!(args.cloud);
    json["calibration_id"] = json!(calibration.map(|calibration| calibration.id));
    Ok(Answer { text: measurement_text(&measurement), json, exit: exit_of(&measurement) })
}

fn request(args: &MeasureArgs) -> MeasureRequest {
    let region = args.region_mm.map(region_between);
    MeasureRequest {
        nominal_mm: args.nominal_mm,
        tolerance_mm: args.tolerance_mm,
        seed: args.seed,
        region,
        ..MeasureRequest::new(args.tool.map_or(Tool::Plane, Into::into))
    }
}

/// The box between two corners: x, y, z of one, then of the other.
pub fn region_between([x, y, z, other_x, other_y, other_z]: [f64; 6]) -> Region {
    Region::between([x, y, z], [other_x, other_y, other_z])
}

/// All characteristics of a plan; the exit code is that of the part's verdict.
fn run_plan(
    plan: &Plan,
    path: &Path,
    cloud: &Cloud,
    calibration: Option<&Calibration>,
    args: &MeasureArgs,
) -> Result<Answer, Failure> {
    let models = models_of(plan, path, Vec::new())?;
    let result =
        evaluate(plan, cloud, calibration, &models).map_err(|error| Failure::from(error).in_file(&args.cloud))?;
    let mut json = plan_json(&result);
    json["cloud"] = json!(args.cloud);
    json["plan"] = json!(plan.name);
    json["calibration_id"] = json!(calibration.map(|calibration| &calibration.id));
    let is_judged = result.characteristics.iter().any(|characteristic| characteristic.verdict.is_some());
    let exit = if is_judged { exit_of_part(result.verdict) } else { Exit::Done };
    Ok(Answer { text: plan_text(&result), json, exit })
}

/// The CAD models that a plan or recipe names: those of its file, others from its folder.
pub fn models_of(plan: &Plan, document: &Path, in_file: Vec<ModelFile>) -> Result<Models, Failure> {
    let mut models = Models::new();
    for ModelFile { name, sha256, bytes } in in_file {
        models.insert(sha256, nominal_in(&name, &bytes, document)?);
    }
    for characteristic in &plan.characteristics {
        let Measure::SurfaceProfile { model, .. } = &characteristic.measure else { continue };
        let named = model.sha256.to_ascii_lowercase();
        if models.contains_key(&named) {
            continue;
        }
        let path = document.with_file_name(&model.name);
        let bytes = std::fs::read(&path).map_err(|cause| {
            Failure::bad_input(format!("{}: the CAD model cannot be read", path.display()))
                .because(&cause)
                .in_file(&path)
                .remedy("place the model beside the plan")
        })?;
        let sha256 = app::hash_hex(&bytes);
        if sha256 != named {
            let detail = format!("{}: SHA-256 {sha256}, not {named} as in the plan", path.display());
            return Err(Failure::bad_input(detail).in_file(&path).remedy("use the model that the plan names"));
        }
        models.insert(sha256, nominal_in(&model.name, &bytes, &path)?);
    }
    Ok(models)
}

fn nominal_in(name: &str, bytes: &[u8], path: &Path) -> Result<Nominal, Failure> {
    app::models::nominal_of(name, bytes)
        .map_err(|error| Failure::bad_input(error.detail).in_file(path).remedy(error.remedy.unwrap_or_default()))
}

/// A plan from its file.
pub fn read_plan(path: &Path) -> Result<Plan, Failure> {
    let text = std::fs::read_to_string(path).map_err(|cause| {
        Failure::bad_input(format!("{}: the plan cannot be read", path.display())).because(&cause).in_file(path)
    })?;
    Plan::from_json(&text).map_err(|error| Failure::from(error).in_file(path))
}

/// The exit code of a verdict on a part.
pub fn exit_of_part(verdict: PartVerdict) -> Exit {
    match verdict {
        PartVerdict::Ok => Exit::Done,
        PartVerdict::Undecided => Exit::VerdictUndecided,
        PartVerdict::Invalid | PartVerdict::NotOk => Exit::VerdictFail,
    }
}

/// The calibration of the cloud: the document at `named`, otherwise the one stored in the cloud.
pub fn calibration_of(cloud: &Cloud, named: Option<&Path>) -> Result<Option<Calibration>, Failure> {
    match named {
        Some(path) => Ok(Some(read_document(path)?.calibration())),
        None => Ok(extract(cloud)?.map(|text| text.value())),
    }
}

fn exit_of(measurement: &Measurement) -> Exit {
    match measurement.verdict {
        None | Some(Verdict::Pass) => Exit::Done,
        Some(Verdict::Fail) => Exit::VerdictFail,
        Some(Verdict::Undecided) => Exit::VerdictUndecided,
    }
}
