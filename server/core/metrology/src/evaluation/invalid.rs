//! Results of parts on which no verdict is possible.

use crate::evaluation::evaluate::verdict_of;
use crate::evaluation::result::{CharacteristicResult, PlanResult};
use crate::interface::part_verdict::PartVerdict;
use crate::interface::request::MeasureError;
use crate::interface::verdict::Limits;
use crate::plan::characteristic::Characteristic;
use crate::plan::document::Plan;

impl PlanResult {
    /// The result of a plan of which nothing could be measured.
    pub fn not_measured(plan: &Plan, error: &MeasureError) -> Self {
        let characteristics: Vec<CharacteristicResult> =
            plan.characteristics.iter().map(|characteristic| not_measured(characteristic, error)).collect();
        Self {
            features: Vec::new(),
            datum_from_part: None,
            alignment_failure: None,
            verdict: verdict_of(plan, &characteristics),
            characteristics,
        }
    }

    /// The same with the verdict invalid on everything that is judged: the scan allows none, whatever was measured.
    pub fn invalidated(mut self, plan: &Plan, why: &str) -> Self {
        for characteristic in self.characteristics.iter_mut().filter(|result| result.verdict.is_some()) {
            characteristic.verdict = Some(PartVerdict::Invalid);
            characteristic.invalid_because = Some(why.to_owned());
        }
        self.verdict = verdict_of(plan, &self.characteristics);
        self
    }
}

fn not_measured(characteristic: &Characteristic, error: &MeasureError) -> CharacteristicResult {
    let Characteristic { id, measure, nominal_mm, nominal_deg, lower, upper, attributes } = characteristic;
    let limits = Limits { lower: *lower, upper: *upper };
    CharacteristicResult {
        id: id.clone(),
        measure: measure.name(),
        unit: measure.unit(),
        value: None,
        components: None,
        nominal: nominal_mm.or(*nominal_deg).or(measure.is_deviation().then_some(0.0)),
        limits,
        error: None,
        u_noise: None,
        u_systematic: None,
        expanded_uncertainty: None,
        missing: Vec::new(),
        findings: Vec::new(),
        verdict: limits.width().map(|_| PartVerdict::Invalid),
        failure: Some(error.clone()),
        invalid_because: None,
        notes: Vec::new(),
        attributes: attributes.clone(),
    }
}
