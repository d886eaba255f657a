//! What the metrics say.

use app::doors::{CharacteristicMessage, InspectionMessage, MachineState, now_ms};

use crate::sparkplug::payload::{Metric, Payload, Value};
use crate::station::Condition;

/// The metric by which a host asks for a birth.
const REBIRTH: &str = "Node Control/Rebirth";

/// Of the birth of the node alone.
pub fn of_birth(bd_seq: u8) -> Vec<Metric> {
    let now = now_ms();
    vec![
        bd_seq_metric(bd_seq),
        Metric::boolean(REBIRTH, now, Some(false)),
        Metric::text("Properties/Software", now, Some(concat!("sheaf ", env!("CARGO_PKG_VERSION")))),
    ]
}

/// Number of the connection: the whole death, and part of the birth.
pub fn bd_seq_metric(bd_seq: u8) -> Metric {
    Metric::integer("bdSeq", now_ms(), Some(bd_seq.into()))
}

/// Whether a command asks for a birth.
pub fn is_rebirth(command: &Payload) -> bool {
    let asks =
        |metric: &Metric| metric.name.as_deref() == Some(REBIRTH) && metric.value == Some(Value::Boolean(true));
    command.metrics.iter().any(asks)
}

/// Of the station, always the same names. `state`: the one entered, if known.
pub fn of_station(condition: &Condition, state: Option<MachineState>) -> Vec<Metric> {
    let now = now_ms();
    let newest = condition.faults.last().map(|fault| format!("{}; {}", fault.detail, fault.remedy));
    let n_faults = i64::try_from(condition.faults.len()).ok();
    vec![
        Metric::text("State/Name", now, state.map(MachineState::name)),
        Metric::integer("State/Number", now, state.map(|state| state.number().into())),
        Metric::text("Simulated", now, condition.simulated),
        Metric::integer("Faults/Count", now, n_faults),
        Metric::text("Faults/Newest", now, newest.as_deref()),
    ]
}

/// Of a result. The names depend on the characteristics of the recipe.
pub fn of_inspection(inspection: &InspectionMessage) -> Vec<Metric> {
    let at_ms = inspection.inspected_at_ms;
    let mut metrics = vec![
        Metric::integer("Inspection/Seq", at_ms, Some(inspection.seq)),
        Metric::text("Inspection/Id", at_ms, Some(&inspection.id)),
        Metric::text("Inspection/Serial", at_ms, Some(&inspection.serial)),
        Metric::text("Inspection/Order", at_ms, inspection.order.as_deref()),
        Metric::integer("Inspection/Recipe Version", at_ms, Some(inspection.recipe.version)),
        Metric::text("Inspection/Verdict", at_ms, Some(&inspection.verdict)),
        Metric::boolean("Inspection/Simulated", at_ms, Some(inspection.simulated)),
        Metric::text("Inspection/Re-evaluated From", at_ms, inspection.re_evaluated_from.as_deref()),
    ];
    metrics.extend(inspection.results.iter().flat_map(|one| of_characteristic(one, at_ms)));
    metrics
}

fn of_characteristic(one: &CharacteristicMessage, at_ms: i64) -> [Metric; 6] {
    let name = |of: &str| format!("Characteristics/{}/{of}", one.id);
    let (lower, upper) = one.limits();
    // A host that looks at the value alone must not use one that is invalid.
    let value = one.value.filter(|_| one.verdict.as_deref() != Some("invalid"));
    [
        Metric::number(&name("Value"), at_ms, value),
        Metric::number(&name("U"), at_ms, one.expanded_uncertainty),
        Metric::text(&name("Verdict"), at_ms, one.verdict.as_deref()),
        Metric::text(&name("Unit"), at_ms, Some(&one.unit)),
        Metric::number(&name("Lower Limit"), at_ms, lower),
        Metric::number(&name("Upper Limit"), at_ms, upper),
    ]
}

/// The metrics that have another value than in `known`.
pub fn changed(metrics: &[Metric], known: &[Metric]) -> Vec<Metric> {
    let is_known = |metric: &Metric| known.iter().any(|one| one.name == metric.name && one.value == metric.value);
    metrics.iter().filter(|metric| !is_known(metric)).cloned().collect()
}

/// Whether two lists have the same names in the same order.
pub fn have_the_same_names(some: &[Metric], others: &[Metric]) -> bool {
    some.iter().map(|metric| &metric.name).eq(others.iter().map(|metric| &metric.name))
}
