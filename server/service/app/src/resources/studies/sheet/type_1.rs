//! The report of a type-1 study.

use capability::params::{MIN_CAPABILITY_INDEX, MIN_TYPE_1_VALUES};
use capability::type_1::Study as Type1Study;
use report::study::{SheetChart, SheetTable, StudySheet};

use super::or_dash;
use crate::resources::studies::{Selected, Type1Plan};

pub(super) fn fill(
    sheet: StudySheet,
    plan: &Type1Plan,
    selected: Option<&Selected>,
    study: Option<&Result<Type1Study, String>>,
) -> StudySheet {
    let unit = selected.map_or("", |selected| selected.series.unit.as_str());
    let mut facts = sheet.facts;
    facts.extend([
        ("characteristic", format!("{} of {}@{}", plan.characteristic, plan.recipe, plan.version.unwrap_or(0))),
        ("part", format!("{}, reference value {} {unit}", plan.serial, plan.reference)),
    ]);
    let mut criteria = vec![format!(
        "Cg = 0.2 T / {0} s and Cgk = (0.1 T - |bias|) / {1} s are at least {MIN_CAPABILITY_INDEX}, from at least \
         {MIN_TYPE_1_VALUES} values (Bosch Booklet 10; with 4 s: VDA 5)",
        plan.n_sigmas,
        plan.n_sigmas / 2
    )];
    criteria.extend(study.and_then(|study| study.as_ref().err()).cloned());
    let readings: Vec<f64> =
        selected.iter().flat_map(|selected| selected.series.readings.iter().filter_map(|one| one.value)).collect();
    StudySheet {
        kind: "Type-1 study",
        criteria,
        facts,
        tables: study
            .and_then(|study| study.as_ref().ok())
            .map(|study| figures(study, unit))
            .into_iter()
            .collect(),
        charts: vec![SheetChart {
            title: plan.characteristic.clone(),
            x: "inspection",
            y: format!("value, {unit}"),
            values: readings,
            rules: vec![plan.reference],
        }],
        ..sheet
    }
}

fn figures(study: &Type1Study, unit: &str) -> SheetTable {
    let index = |value: Option<f64>| or_dash(value.map(|value| format!("{value:.2}")));
    let row = |name: String, value: String| vec![name, value];
    SheetTable {
        title: "Results".to_owned(),
        about: "Repeated inspections of one part with a known value.".to_owned(),
        head: vec!["figure", "value"],
        rows: vec![
            row("Cg".to_owned(), index(study.cg)),
            row("Cgk".to_owned(), index(study.cgk)),
            row("values".to_owned(), study.n.to_string()),
            row("values missing".to_owned(), study.n_missing.to_string()),
            row(format!("mean, {unit}"), format!("{:.5}", study.mean)),
            row(format!("bias, {unit}"), format!("{:.5}", study.bias)),
            row(format!("standard deviation, {unit}"), format!("{:.5}", study.std_dev)),
            row(
                "p-value of the bias".to_owned(),
                or_dash(study.bias_test.map(|test| format!("{:.3}", test.p_value))),
            ),
        ],
        marked: Vec::new(),
    }
}
