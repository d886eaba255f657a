//! Checks and their table.

use std::fmt::Write as _;

use serde_json::{Value, json};

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Within its limit.
    Ok,
    /// Outside its limit, or aborted by a fault.
    NotOk,
    /// Not applicable, or another check must pass first.
    NotRun,
}

impl Outcome {
    fn label(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::NotOk => "NOT OK",
            Self::NotRun => "not run",
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::NotOk => "not_ok",
            Self::NotRun => "not_run",
        }
    }
}

/// One line of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// Name of the check; stable, for scripts.
    pub name: &'static str,
    /// Outcome.
    pub outcome: Outcome,
    /// Result with units, or why there is none.
    pub figure: String,
    /// The result as a number, in [`Check::unit`].
    pub value: Option<f64>,
    /// Unit of `value`.
    pub unit: &'static str,
    /// The limit.
    pub limit: String,
    /// Remedy; empty if the check passed.
    pub remedy: String,
}

impl Check {
    /// A check of a measured value against its limit.
    pub fn measured(name: &'static str, is_ok: bool, (value, unit): (f64, &'static str), figure: String) -> Self {
        let outcome = if is_ok { Outcome::Ok } else { Outcome::NotOk };
        Self { name, outcome, figure, value: Some(value), unit, limit: String::new(), remedy: String::new() }
    }

    /// A check whose result is not a number.
    pub fn stated(name: &'static str, outcome: Outcome, figure: impl Into<String>) -> Self {
        let figure = figure.into();
        Self { name, outcome, figure, value: None, unit: "", limit: String::new(), remedy: String::new() }
    }

    /// Adds the limit.
    pub fn limit(self, limit: impl Into<String>) -> Self {
        Self { limit: limit.into(), ..self }
    }

    /// Adds the remedy, unless the check passed.
    pub fn remedy(self, remedy: impl Into<String>) -> Self {
        let remedy = if self.outcome == Outcome::Ok { String::new() } else { remedy.into() };
        Self { remedy, ..self }
    }
}

/// The table as text.
pub fn table(checks: &[Check]) -> String {
    let rows: Vec<[&str; 5]> = checks
        .iter()
        .map(|check| [check.name, check.outcome.label(), &check.figure, &check.limit, &check.remedy])
        .collect();
    let head = ["check", "", "figure", "limit", "remedy"];
    let width =
        |column: usize| rows.iter().chain([&head]).map(|row| row[column].chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for row in [&head].into_iter().chain(&rows) {
        let line: Vec<String> =
            row.iter().enumerate().map(|(at, cell)| format!("{cell:<0$}", width(at))).collect();
        let _ = writeln!(text, "{}", line.join("  ").trim_end());
    }
    text
}

/// The table as JSON.
pub fn to_json(checks: &[Check]) -> Value {
    let rows: Vec<Value> = checks
        .iter()
        .map(|check| {
            json!({
                "name": check.name,
                "outcome": check.outcome.name(),
                "figure": check.figure,
                "value": check.value,
                "unit": check.unit,
                "limit": check.limit,
                "remedy": check.remedy,
            })
        })
        .collect();
    json!({ "ok": !checks.iter().any(|check| check.outcome == Outcome::NotOk), "checks": rows })
}
