//! The report of a gauge R&R study.

use capability::gauge_rr::{Component, GaugeRr};
use capability::params::{ACCEPTABLE_PERCENT, MIN_NDC, UNACCEPTABLE_PERCENT};
use report::study::{SheetChart, SheetTable, StudySheet};

use super::or_dash;
use crate::resources::studies::{GaugeRrPlan, Selected};

pub(super) fn fill(
    sheet: StudySheet,
    plan: &GaugeRrPlan,
    selected: Option<&Selected>,
    study: Option<&Result<GaugeRr, String>>,
) -> StudySheet {
    let unit = selected.map_or("", |selected| selected.series.unit.as_str());
    let mut facts = sheet.facts;
    let operators =
        if plan.operators.is_empty() { "the station alone".to_owned() } else { plan.operators.join(", ") };
    facts.extend([
        ("characteristic", format!("{} of {}@{}", plan.characteristic, plan.recipe, plan.version.unwrap_or(0))),
        ("parts", plan.parts.join(", ")),
        ("operators", operators),
        ("inspections of each", plan.n_trials.to_string()),
    ]);
    let mut criteria = vec![format!(
        "%GRR of the tolerance (without two limits: of the total variation) is OK up to {ACCEPTABLE_PERCENT} %, UNDECIDED up \
         to {UNACCEPTABLE_PERCENT} % (acceptable for some applications), NOT OK above; at least {MIN_NDC} distinct categories \
         (AIAG MSA 4, analysis of variance)"
    )];
    criteria.extend(study.and_then(|study| study.as_ref().err()).cloned());
    let mut tables = Vec::new();
    if let Some(Ok(study)) = study {
        tables.push(components(study, unit));
    }
    tables.extend(selected.map(|selected| cells(selected, unit)));
    StudySheet {
        kind: "Gauge R&R study",
        criteria,
        facts,
        tables,
        charts: selected.map(|selected| chart(plan, selected)).into_iter().collect(),
        ..sheet
    }
}

fn components(study: &GaugeRr, unit: &str) -> SheetTable {
    let row = |name: &str, part: &Component| {
        vec![
            format!("{name}, {unit}"),
            format!("{:.6}", part.std_dev),
            format!("{:.1}", part.percent_of_total),
            or_dash(part.percent_of_tolerance.map(|percent| format!("{percent:.1}"))),
        ]
    };
    let mut rows = vec![row("repeatability EV", &study.repeatability)];
    rows.extend(study.reproducibility.as_ref().map(|part| row("reproducibility AV", part)));
    rows.extend(study.interaction.as_ref().map(|part| row("interaction", part)));
    rows.extend([
        row("gauge R&R", &study.gauge_rr),
        row("part variation PV", &study.part_variation),
        row("total variation TV", &study.total_variation),
    ]);
    let ndc = or_dash(study.ndc.map(|ndc| ndc.to_string()));
    rows.push(vec!["distinct categories ndc".to_owned(), ndc, String::new(), String::new()]);
    SheetTable {
        title: "Results".to_owned(),
        about: "Standard deviations; percentages add in quadrature.".to_owned(),
        head: vec!["component", "std. deviation", "% of total", "% of tolerance"],
        rows,
        marked: Vec::new(),
    }
}

/// Mean and range of every part by every operator.
fn cells(selected: &Selected, unit: &str) -> SheetTable {
    let row = |(part, operator, n_present): &(String, Option<String>, usize)| {
        let values: Vec<f64> = values_of(selected, part, operator.as_deref()).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let (low, high) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
        let shown = |value: f64| or_dash((!values.is_empty()).then(|| format!("{value:.5}")));
        vec![part.clone(), or_dash(operator.clone()), n_present.to_string(), shown(mean), shown(high - low)]
    };
    SheetTable {
        title: "Parts and operators".to_owned(),
        about: format!("Mean and range in {unit}."),
        head: vec!["part", "operator", "inspections", "mean", "range"],
        rows: selected.cells.iter().map(row).collect(),
        marked: Vec::new(),
    }
}

fn values_of(selected: &Selected, part: &str, operator: Option<&str>) -> impl Iterator<Item = f64> {
    let readings = selected.series.readings.iter().filter(move |reading| {
        reading.serial == part && (operator.is_none() || reading.operator.as_deref() == operator)
    });
    readings.filter_map(|reading| reading.value)
}

/// All values, part by part in the order of the plan.
fn chart(plan: &GaugeRrPlan, selected: &Selected) -> SheetChart {
    SheetChart {
        title: format!("{}, part by part", plan.characteristic),
        x: "inspection",
        y: format!("value, {}", selected.series.unit),
        values: plan.parts.iter().flat_map(|part| values_of(selected, part, None).collect::<Vec<_>>()).collect(),
        rules: Vec::new(),
    }
}
