//! The record of an inspection, and the event that announces it.

use std::collections::BTreeMap;

use metrology::PlanResult;
use report::tables::plan_json;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use station::wall_clock::now_ms;
use store::{Change, InspectionRecord, ScanRecord};

use crate::events::{Event, InspectionFinished, RuleViolated, event, event_record};
use crate::resources::inspections::{InspectedPart, InspectionBody};
use crate::resources::recipes::RecipeVersion;
use crate::resources::stored_scan::new_id;

/// A characteristic whose verdict differs from that of an earlier inspection.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct VerdictChange {
    /// Its id in the plan.
    pub id: String,
    /// Earlier verdict; `None`: none.
    pub before: Option<String>,
    /// New verdict; `None`: none.
    pub after: Option<String>,
}

/// The record of a finished inspection; its number is assigned by the store.
pub fn new_inspection(
    part: &InspectedPart,
    version: &RecipeVersion,
    scan: &ScanRecord,
    result: &PlanResult,
    (job_id, simulated): (&str, bool),
) -> (InspectionRecord, InspectionBody) {
    let record = InspectionRecord {
        id: new_id(),
        seq: 0,
        serial: part.serial.clone(),
        order_number: part.order.clone(),
        recipe_id: version.id.clone(),
        recipe_version: version.version,
        verdict: result.verdict.name().to_owned(),
        scan_id: Some(scan.id.clone()),
        re_evaluated_from: None,
        job_id: Some(job_id.to_owned()),
        body: Value::Null,
        created_at_ms: now_ms(),
    };
    let body = InspectionBody {
        recipe_digest: version.digest.clone(),
        recipe_number: version.recipe.number,
        calibration_id: scan.calibration_id.clone(),
        simulated,
        attributes: merged(&version.recipe.attributes, &part.attributes),
        outputs: version.recipe.outputs.clone(),
        result: plan_json(result),
        changed: Vec::new(),
        violated_rules: Vec::new(),
    };
    (record, body)
}

/// The attributes of the recipe, and those of the part, which take precedence.
fn merged(recipe: &BTreeMap<String, String>, part: &BTreeMap<String, String>) -> BTreeMap<String, String> {
    recipe.iter().chain(part).map(|(name, value)| (name.clone(), value.clone())).collect()
}

/// The changes that store an inspection with its events.
pub fn inspection_changes(record: InspectionRecord, body: &InspectionBody) -> Vec<Change> {
    let record = InspectionRecord { body: json!(body), ..record };
    let recipe = format!("{}@{}", record.recipe_id, record.recipe_version);
    let violated = body.violated_rules.iter().map(|violated| RuleViolated {
        recipe: recipe.clone(),
        serial: record.serial.clone(),
        violated: violated.clone(),
        outputs: body.outputs.clone(),
    });
    let announced: Vec<Change> =
        violated.map(|violated| event(&record.id, Event::ControlChartRuleViolated(violated))).collect();
    let finished = InspectionFinished {
        seq: 0,
        serial: record.serial.clone(),
        order: record.order_number.clone(),
        recipe,
        recipe_number: body.recipe_number,
        recipe_digest: body.recipe_digest.clone(),
        verdict: record.verdict.clone(),
        scan_id: record.scan_id.clone(),
        calibration_id: body.calibration_id.clone(),
        simulated: body.simulated,
        re_evaluated_from: record.re_evaluated_from.clone(),
        outputs: body.outputs.clone(),
    };
    let event = event_record(&record.id, Event::InspectionFinished(finished));
    std::iter::once(Change::InsertInspection { inspection: record, event }).chain(announced).collect()
}

/// The characteristics whose verdict differs between two results as stored.
pub fn changed_verdicts(before: &Value, after: &Value) -> Vec<VerdictChange> {
    let ids = |result: &Value| -> Vec<(String, Option<String>)> {
        let characteristics = result["characteristics"].as_array().into_iter().flatten();
        let text = |value: &Value| value.as_str().map(str::to_owned);
        characteristics.filter_map(|one| Some((text(&one["id"])?, text(&one["verdict"])))).collect()
    };
    let (before, after) = (ids(before), ids(after));
    let verdict_in = |all: &[(String, Option<String>)], id: &str| {
        all.iter().find(|(known, _)| known == id).and_then(|(_, verdict)| verdict.clone())
    };
    let gone = before.iter().filter(|(id, _)| after.iter().all(|(known, _)| known != id));
    let all = after.iter().chain(gone).map(|(id, _)| VerdictChange {
        id: id.clone(),
        before: verdict_in(&before, id),
        after: verdict_in(&after, id),
    });
    all.filter(|change| change.before != change.after).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_that_differ_are_listed_by_id_whatever_their_order() {
        let result = |pairs: &[(&str, Option<&str>)]| {
            let of = |(id, verdict): &(&str, Option<&str>)| json!({ "id": id, "verdict": verdict });
            json!({ "characteristics": pairs.iter().map(of).collect::<Vec<_>>() })
        };
        let before = result(&[("a", Some("ok")), ("b", Some("ok")), ("c", None), ("d", Some("invalid"))]);
        let after = result(&[("b", Some("not_ok")), ("a", Some("ok")), ("c", Some("ok")), ("e", None)]);
        let named = |id: &str, before: Option<&str>, after: Option<&str>| {
            let [before, after] = [before, after].map(|word| word.map(str::to_owned));
            VerdictChange { id: id.to_owned(), before, after }
        };
        let expected = [
            named("b", Some("ok"), Some("not_ok")),
            named("c", None, Some("ok")),
            named("d", Some("invalid"), None),
        ];
        assert_eq!(changed_verdicts(&before, &after), expected);
    }
}
