//! The report of a study of the station as HTML and PDF: verdict, criteria, tables, charts.

mod html;
mod pdf;

pub use html::study_page;
pub use pdf::study_pdf;

use metrology::PartVerdict;

/// Contents of the report of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct StudySheet {
    /// What was examined: `Acceptance test`, `Type-1 study`, `Gauge R&R study`.
    pub kind: &'static str,
    /// Its name.
    pub name: String,
    /// The verdict; `None` while something is missing.
    pub verdict: Option<PartVerdict>,
    /// Whether the devices were simulated or replayed.
    pub simulated: bool,
    /// What the verdict is based on, in sentences.
    pub criteria: Vec<String>,
    /// What is still missing, in sentences.
    pub missing: Vec<String>,
    /// Names and values to print: artefacts, calibration, time.
    pub facts: Vec<(&'static str, String)>,
    /// The tables.
    pub tables: Vec<SheetTable>,
    /// The charts.
    pub charts: Vec<SheetChart>,
}

/// A table of a report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SheetTable {
    /// Its title.
    pub title: String,
    /// What it shows, in a sentence.
    pub about: String,
    /// Names of the columns.
    pub head: Vec<&'static str>,
    /// The cells.
    pub rows: Vec<Vec<String>>,
    /// Indices of the rows to highlight.
    pub marked: Vec<usize>,
}

/// A chart of values over their number.
#[derive(Debug, Clone, PartialEq)]
pub struct SheetChart {
    /// What it shows.
    pub title: String,
    /// Title of the horizontal axis.
    pub x: &'static str,
    /// Title of the vertical axis, with unit.
    pub y: String,
    /// The values, numbered from 1.
    pub values: Vec<f64>,
    /// Limits and reference values.
    pub rules: Vec<f64>,
}

impl StudySheet {
    fn title(&self) -> String {
        format!("{} {}", self.kind, self.name)
    }

    /// The verdict in print.
    fn verdict_label(&self) -> &'static str {
        self.verdict.map_or("NOT COMPLETE", PartVerdict::label)
    }
}

/// Notice for studies without real devices.
const SIMULATED: &str = "Simulated or replayed devices: not a verdict on a real station.";

#[cfg(test)]
pub(crate) fn example() -> StudySheet {
    StudySheet {
        kind: "Acceptance test",
        name: "after service & move".to_owned(),
        verdict: Some(PartVerdict::NotOk),
        simulated: true,
        criteria: vec!["each error is at most its limit by U or more".to_owned()],
        missing: Vec::new(),
        facts: vec![("artefact", "ball <7>".to_owned())],
        tables: vec![SheetTable {
            title: "Results".to_owned(),
            about: "In micrometres.".to_owned(),
            head: vec!["quantity", "worst", "verdict"],
            rows: vec![
                vec!["probing error of form".to_owned(), "83.1".to_owned(), "NOT OK".to_owned()],
                vec!["probing error of size".to_owned(), "-4.2".to_owned(), "OK".to_owned()],
            ],
            marked: vec![0],
        }],
        charts: vec![SheetChart {
            title: "Probing error of form".to_owned(),
            x: "position",
            y: "error, µm".to_owned(),
            values: vec![51.0, 83.1, 60.0],
            rules: vec![80.0],
        }],
    }
}
