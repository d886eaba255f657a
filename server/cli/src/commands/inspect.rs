//! `sheaf inspect`: evaluates a cloud by a recipe file, as the service evaluates the scan of an inspection.

use std::path::Path;

use app::error::AppError;
use app::recipes::{RecipeFile, RecipeFileError};
use metrology::{PlanResult, evaluate};
use pipeline::{Failure, Reporter};
use report::tables::{plan_json, plan_text};
use scanning::files::read_cloud;
use serde_json::json;

use crate::arguments::InspectArgs;
use crate::commands::Answer;
use crate::commands::measure::{calibration_of, exit_of_part, models_of};

/// Evaluates; the exit code is that of the part's verdict.
pub fn run(args: &InspectArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let file = read_recipe(&args.recipe)?;
    let cloud = read_cloud(&args.cloud)?;
    let calibration = calibration_of(&cloud, args.calibration.as_deref())?;
    if calibration.is_none() {
        reporter.warn(
            "the cloud contains no calibration: the uncertainty is incomplete and no part is OK; give one with --calibration",
        );
    }
    let plan = &file.recipe.plan;
    let in_file = file
        .model_files()
        .map_err(|problem| failure_of(RecipeFileError::Recipe(problem)).in_file(&args.recipe))?;
    let models = models_of(plan, &args.recipe, in_file)?;
    let result: PlanResult = evaluate(plan, &cloud, calibration.as_ref(), &models)
        .map_err(|error| Failure::from(error).in_file(&args.cloud))?;
    let mut json = plan_json(&result);
    json["cloud"] = json!(args.cloud);
    json["serial"] = json!(args.serial);
    json["recipe"] = json!({ "id": file.id, "version": file.version, "digest": file.recipe.digest() });
    json["calibration_id"] = json!(calibration.map(|calibration| calibration.id));
    let serial = args.serial.as_deref().map_or_else(String::new, |serial| format!("part {serial}, "));
    let text = format!("{serial}recipe {}@{}\n{}", file.id, file.version, plan_text(&result));
    Ok(Answer { text, json, exit: exit_of_part(result.verdict) })
}

fn read_recipe(path: &Path) -> Result<RecipeFile, Failure> {
    let text = std::fs::read_to_string(path).map_err(|cause| {
        Failure::bad_input(format!("{}: the recipe cannot be read", path.display())).because(&cause).in_file(path)
    })?;
    RecipeFile::from_json(&text).map_err(|error| failure_of(error).in_file(path))
}

fn failure_of(error: RecipeFileError) -> Failure {
    match error {
        RecipeFileError::Json { cause } => Failure::bad_input("the recipe cannot be read")
            .because(&cause)
            .remedy("export it from the station again: GET /api/v1/recipes/{id}/versions/{version}/file"),
        RecipeFileError::Recipe(AppError { detail, pointer, remedy, .. }) => {
            let failure = Failure::bad_input(detail).at_entry(pointer.unwrap_or_default());
            match remedy {
                Some(remedy) => failure.remedy(remedy),
                None => failure,
            }
        }
    }
}
