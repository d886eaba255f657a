//! A check and its table.

use std::fmt::Write as _;

use serde_json::{Value, json};

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Within its limit.
    Ok,
    /// Beyond its limit, or broken off by a fault.
    NotOk,
    /// There was nothing to check, or something else has to be put right first.
    NotRun,
}

impl Outcome {
    fn word(self) -> &'static str {
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
    /// What was checked; stable, for scripts.
    pub name: &'static str,
    /// How it ended.
    pub outcome: Outcome,
    /// What was found, with units; or why nothing was.
    pub figure: String,
    /// The figure as a number, in the unit of its name in [`Check::unit`].
    pub value: Option<f64>,
    /// Unit of `value`.
    pub unit: &'static str,
    /// What it was held to.
    pub limit: String,
    /// What to do; empty if it is well.
    pub remedy: String,
}

impl Check {
    /// A figure held to a limit.
    pub fn held(name: &'static str, is_ok: bool, (value, unit): (f64, &'static str), figure: String) -> Self {
        let outcome = if is_ok { Outcome::Ok } else { Outcome::NotOk };
        Self { name, outcome, figure, value: Some(value), unit, limit: String::new(), remedy: String::new() }
    }

    /// A check without a number.
    pub fn said(name: &'static str, outcome: Outcome, figure: impl Into<String>) -> Self {
        let figure = figure.into();
        Self { name, outcome, figure, value: None, unit: "", limit: String::new(), remedy: String::new() }
    }

    /// With what it was held to.
    pub fn limit(self, limit: impl Into<String>) -> Self {
        Self { limit: limit.into(), ..self }
    }

    /// With what to do, unless it is well.
    pub fn remedy(self, remedy: impl Into<String>) -> Self {
        let remedy = if self.outcome == Outcome::Ok { String::new() } else { remedy.into() };
        Self { remedy, ..self }
    }
}

/// The table for a person.
pub fn table(checks: &[Check]) -> String {
    let rows: Vec<[&str; 5]> = checks
        .iter()
        .map(|check| [check.name, check.outcome.word(), &check.figure, &check.limit, &check.remedy])
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

/// The table for a machine.
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
