//! `sheaf study`.

use crate::arguments::{Study, StudyArgs, StudyPaperArgs};
use crate::commands::Answer;
use crate::study::{paper, study_json, study_page, study_text};
use pipeline::Reporter;
use pipeline::{Failure, FailureKind};

/// Minimum number of seeds.
const MIN_SEEDS: u64 = 2;

/// Runs a study.
pub fn run(args: &StudyArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    match &args.study {
        Study::Paper(args) => run_paper(args, reporter),
    }
}

fn run_paper(args: &StudyPaperArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    if args.seeds < MIN_SEEDS {
        return Err(Failure::new(
            FailureKind::BadParameter,
            format!("--seeds {} is too few: give at least {MIN_SEEDS}", args.seeds),
        ));
    }
    let task = reporter.fraction("simulating stations");
    let study = paper::run(args.seeds, &|done| task.at("simulating stations", done));
    drop(task);
    std::fs::write(&args.plot, study_page(&study)).map_err(|cause| {
        Failure::new(FailureKind::BadInput, format!("cannot write {}: {cause}", args.plot.display()))
    })?;
    reporter.note(&format!("plot: {}", args.plot.display()));
    Ok(Answer::done(study_text(&study), study_json(&study, &args.plot)))
}
