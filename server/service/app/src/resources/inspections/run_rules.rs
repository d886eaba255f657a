//! Run rules of control charts: an inspection that completes a pattern in the chart of a characteristic announces it,
//! once per pattern.

use capability::spc::{Rule, individuals_chart, violations};
use store::{Catalogue, InspectionFilter, InspectionRecord, Page};

use crate::error::AppError;
use crate::events::ViolatedRule;
use crate::resources::inspections::{CharacteristicMessage, InspectionBody};
use crate::resources::statistics::CHART_VALUES;

/// The rules that a new inspection is the first to violate, in the order of its characteristics.
///
/// The chart is that of the API: the newest [`CHART_VALUES`] inspections by the recipe in any version, the new one included,
/// re-evaluations left out. Limits from fewer than 25 values are preliminary and announce nothing. A pattern that an earlier
/// inspection has announced is not announced again while it lasts.
///
/// # Errors
/// The store cannot be read. Damaged inspections are left out.
pub async fn newly_violated(
    read: &dyn Catalogue,
    record: &InspectionRecord,
    body: &InspectionBody,
) -> Result<Vec<ViolatedRule>, AppError> {
    let filter = InspectionFilter { recipe_id: Some(record.recipe_id.clone()), ..InspectionFilter::default() };
    let page = Page { before: None, limit: CHART_VALUES - 1 };
    let earlier = read.inspections(&filter, &page).await?.records.into_iter().rev();
    let measured = earlier.filter(|earlier| earlier.re_evaluated_from.is_none()).filter_map(|earlier| {
        let body: InspectionBody = serde_json::from_value(earlier.body).ok()?;
        Inspected::of(earlier.id, &body)
    });
    let all: Vec<Inspected> = measured.chain(Inspected::of(record.id.clone(), body)).collect();
    let of_newest = all.last().map_or(&[][..], |newest| &newest.results);
    Ok(of_newest.iter().flat_map(|result| violated_by_last(result, &all)).collect())
}

/// What an inspection contributes to control charts.
struct Inspected {
    id: String,
    results: Vec<CharacteristicMessage>,
    violated: Vec<ViolatedRule>,
}

impl Inspected {
    fn of(id: String, body: &InspectionBody) -> Option<Self> {
        let results = serde_json::from_value(body.result["characteristics"].clone()).ok()?;
        Some(Self { id, results, violated: body.violated_rules.clone() })
    }

    fn has_announced(&self, characteristic: &str, rule: u8) -> bool {
        self.violated.iter().any(|violated| violated.characteristic == characteristic && violated.rule == rule)
    }
}

/// The rules that the last inspection is the first to violate with this characteristic.
fn violated_by_last(characteristic: &CharacteristicMessage, all: &[Inspected]) -> Vec<ViolatedRule> {
    let CharacteristicMessage { id, unit, .. } = characteristic;
    let (of, values): (Vec<&Inspected>, Vec<Option<f64>>) = all
        .iter()
        .filter_map(|one| one.results.iter().find(|result| result.id == *id).map(|result| (one, result.charted())))
        .unzip();
    let Some(chart) = individuals_chart(&values).ok().filter(|chart| !chart.preliminary) else {
        return Vec::new();
    };
    let (centre, sigma, newest) = (chart.individuals.centre, chart.sigma.sigma, values.len() - 1);
    let violated = |(rule, nelson): (u8, Rule)| {
        let pattern =
            violations(&values, centre, sigma, &[nelson]).pop().filter(|last| last.last_idx == newest)?;
        let earlier = &of[pattern.first_idx..newest];
        if earlier.iter().any(|one| one.has_announced(id, rule)) {
            return None;
        }
        Some(ViolatedRule {
            characteristic: id.clone(),
            rule,
            first_inspection_id: of[pattern.first_idx].id.clone(),
            n_points: newest + 1 - pattern.first_idx,
            value: values[newest]?,
            centre,
            sigma,
            unit: unit.clone(),
        })
    };
    (1..).zip(Rule::NELSON).filter_map(violated).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::resources::inspections::sample::inspection;

    /// Announces as inspections would, one after the other; returns the number of the value and the rule.
    fn announced(values: &[Option<f64>]) -> Vec<(usize, u8)> {
        let (mut all, mut found): (Vec<Inspected>, Vec<(usize, u8)>) = Default::default();
        for (idx, value) in values.iter().enumerate() {
            let of = CharacteristicMessage { value: *value, ..inspection().results.remove(0) };
            all.push(Inspected { id: idx.to_string(), results: vec![of.clone()], violated: Vec::new() });
            let violated = violated_by_last(&of, &all);
            found.extend(violated.iter().map(|violated| (idx, violated.rule)));
            all[idx].violated = violated;
        }
        found
    }

    /// Values that violate no rule: deviations in σ, repeated.
    fn stable(n: usize) -> Vec<Option<f64>> {
        let deviations = [0.3, -1.2, 0.9, 0.1, -0.4, 1.3, -0.8, -1.1, 0.5, -0.2, 1.5, -0.6, 0.7, -1.4, 0.2];
        (0..n).map(|idx| Some(8.9 + 0.001 * deviations[idx % deviations.len()])).collect()
    }

    #[test]
    fn a_shift_is_announced_once_while_it_lasts_and_again_when_it_returns() {
        assert_eq!(announced(&stable(90)), []);
        let mut values = stable(60);
        values.extend((0..14).map(|idx| Some(8.9 + 0.0006 + 0.0001 * f64::from(idx % 2))));
        let of_rule_2 = |values: &[Option<f64>]| -> Vec<usize> {
            announced(values).into_iter().filter(|(_, rule)| *rule == 2).map(|(idx, _)| idx).collect()
        };
        // The last stable value is on the same side.
        assert_eq!(of_rule_2(&values), [67]);
        values.extend(stable(15));
        values.extend((0..14).map(|_| Some(8.9 + 0.0006)));
        assert_eq!(of_rule_2(&values), [67, 96]);
    }

    #[test]
    fn a_point_beyond_three_sigma_is_announced_with_chart_and_pattern() {
        let mut values = stable(40);
        values.push(Some(8.92));
        assert_eq!(announced(&values).into_iter().filter(|(_, rule)| *rule == 1).collect::<Vec<_>>(), [(40, 1)]);
        values.push(Some(8.921));
        values.extend(stable(3));
        let all = announced(&values);
        assert_eq!(all.iter().filter(|(_, rule)| *rule == 1).count(), 1, "one run: {all:?}");
    }

    #[test]
    fn preliminary_limits_announce_nothing_and_gaps_neither() {
        let mut values = stable(24);
        values[23] = Some(8.95);
        assert_eq!(announced(&values), []);
        let mut values = stable(40);
        values.push(None);
        assert_eq!(announced(&values), []);
    }
}
