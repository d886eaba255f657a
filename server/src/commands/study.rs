//! `sheaf study`.

use crate::cli::{Study, StudyArgs, StudyPaperArgs};
use crate::commands::Answer;
use crate::failure::{Exit, Failure};
use crate::progress::Reporter;
use crate::report::study_page;
use crate::study::paper;
use crate::tables::{study_json, study_text};

/// Fewest seeds whose root mean square says something about a ratio.
const MIN_SEEDS: u64 = 2;

/// Runs a study.
pub fn run(args: &StudyArgs, reporter: &Reporter) -> Result<Answer, Failure> {
    match &args.study {
        Study::Paper(args) => run_paper(args, reporter),
    }
}

fn run_paper(args: &StudyPaperArgs, reporter: &Reporter) -> Result<Answer, Failure> {
    if args.seeds < MIN_SEEDS {
        return Err(Failure::new(
            Exit::Usage,
            format!("--seeds {} is too few: give at least {MIN_SEEDS}", args.seeds),
        ));
    }
    let task = reporter.fraction("simulating stations");
    let study = paper::run(args.seeds, &|done| task.at("simulating stations", done));
    drop(task);
    std::fs::write(&args.plot, study_page(&study))
        .map_err(|cause| Failure::new(Exit::BadInput, format!("cannot write {}: {cause}", args.plot.display())))?;
    reporter.note(&format!("plot: {}", args.plot.display()));
    Ok(Answer::done(study_text(&study), study_json(&study, &args.plot)))
}
