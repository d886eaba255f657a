//! The report of a study, made on request.

use metrology::PartVerdict;
use metrology::acceptance::MissingPositions;
use report::study::{StudySheet, study_page, study_pdf};
use store::Catalogue;

use crate::error::AppError;
use crate::resources::inspections::{ReportFormat, utc};
use crate::resources::studies::outcome::{MissingInspections, Outcome, outcome};
use crate::resources::studies::{Found, Study, StudyPlan};

mod acceptance;
mod gauge_rr;
mod type_1;

/// The report of a study as a file. That of an incomplete study contains what has been measured, and names what is missing.
///
/// # Errors
/// The study does not exist, or a record is damaged.
pub async fn study_report(read: &dyn Catalogue, id: &str, format: ReportFormat) -> Result<Vec<u8>, AppError> {
    let study = Study::of(read.study(id).await?)?;
    let found = outcome(read, &study).await?;
    let sheet = sheet(&study, &found);
    Ok(match format {
        ReportFormat::Html => study_page(&sheet).into_bytes(),
        ReportFormat::Pdf => study_pdf(&sheet),
    })
}

fn sheet(study: &Study, outcome: &Outcome) -> StudySheet {
    let mut facts = vec![
        ("study", study.id.clone()),
        ("created", format!("{} by {}", utc(study.created_at_ms), study.body.author)),
    ];
    if study.changed_at_ms != study.created_at_ms {
        facts.push(("last changed", utc(study.changed_at_ms)));
    }
    let blank = StudySheet {
        kind: "Acceptance test",
        name: study.body.name.clone(),
        verdict: outcome.verdict,
        simulated: false,
        criteria: Vec::new(),
        missing: missing(outcome),
        facts,
        tables: Vec::new(),
        charts: Vec::new(),
    };
    match (&study.body.plan, &outcome.found) {
        (StudyPlan::Acceptance(plan), Found::Acceptance(result)) => acceptance::fill(blank, study, plan, result),
        (StudyPlan::Type1(plan), Found::Type1 { selected, study, .. }) => {
            type_1::fill(blank, plan, selected.as_ref(), study.as_ref())
        }
        (StudyPlan::GaugeRr(plan), Found::GaugeRr { selected, study, .. }) => {
            gauge_rr::fill(blank, plan, selected.as_ref(), study.as_ref())
        }
        _ => blank,
    }
}

fn missing(outcome: &Outcome) -> Vec<String> {
    let positions =
        outcome.missing_positions().iter().map(|MissingPositions { procedure, n_present, n_needed }| {
            format!("{}: {n_present} of {n_needed} positions", procedure.name().replace('_', " "))
        });
    let inspections = outcome.missing_inspections().iter().map(
        |MissingInspections { serial, operator, n_present, n_needed }| {
            let by = operator.as_ref().map_or_else(String::new, |operator| format!(" by {operator}"));
            format!("part {serial}{by}: {n_present} of {n_needed} inspections")
        },
    );
    positions.chain(inspections).collect()
}

/// A length in micrometres, to a hundredth.
fn um(length_mm: f64) -> String {
    format!("{:.2}", 1000.0 * length_mm)
}

/// A value or a dash.
fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "–".to_owned())
}

fn label(verdict: Option<PartVerdict>) -> String {
    or_dash(verdict.map(|verdict| verdict.label().to_owned()))
}
