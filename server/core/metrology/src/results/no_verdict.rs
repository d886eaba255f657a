//! Invalid and undecided results, and the reason in words.

use crate::interface::part_verdict::PartVerdict;
use crate::interface::request::MeasureError;
use crate::interface::verdict::Limits;
use crate::plan::characteristic::Characteristic;
use crate::plan::document::Plan;
use crate::results::evaluate::verdict_of;
use crate::results::result::{CharacteristicResult, PlanResult};

impl PlanResult {
    /// The result of a plan if nothing could be measured.
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

    /// This result with all verdicts invalid, for a scan that allows no verdict. `why` becomes the reason.
    pub fn invalidated(mut self, plan: &Plan, why: &str) -> Self {
        for characteristic in self.characteristics.iter_mut().filter(|result| result.verdict.is_some()) {
            characteristic.verdict = Some(PartVerdict::Invalid);
            characteristic.invalid_because = Some(why.to_owned());
        }
        self.verdict = verdict_of(plan, &self.characteristics);
        self
    }
}

pub(crate) fn not_measured(characteristic: &Characteristic, error: &MeasureError) -> CharacteristicResult {
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
        comparison: None,
        invalid_because: None,
        notes: Vec::new(),
        attributes: attributes.clone(),
    }
}

impl CharacteristicResult {
    /// Why it is undecided or invalid; `None` otherwise.
    pub fn reason(&self) -> Option<String> {
        match self.verdict? {
            PartVerdict::Ok | PartVerdict::NotOk => None,
            PartVerdict::Invalid => Some(self.why_invalid()),
            PartVerdict::Undecided => Some(self.why_undecided()),
        }
    }

    fn why_invalid(&self) -> String {
        match (&self.invalid_because, &self.failure) {
            (Some(why), _) => why.clone(),
            (None, Some(error)) => format!("not measured: {error}"),
            (None, None) => "the value or its uncertainty is not finite".to_owned(),
        }
    }

    fn why_undecided(&self) -> String {
        let missing = self.missing.iter().map(|missing| format!("U is incomplete: it lacks {missing}"));
        let findings = self.findings.iter().map(|(id, finding)| format!("{id}: {finding}"));
        let reasons: Vec<String> = missing.chain(findings).collect();
        if !reasons.is_empty() {
            return reasons.join("; ");
        }
        let unit = self.unit.symbol();
        match self.error.zip(self.expanded_uncertainty) {
            Some((error, u)) => {
                format!("the error of {error:+.4} {unit} is closer to a limit than U = {u:.4} {unit}")
            }
            None => "there is no error to compare with the limits".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::interface::request::MeasureError;
    use crate::*;

    fn plan(limits: &str) -> Plan {
        let text = format!(
            r#"{{"format":"sheaf-plan/1","features":[{{"id":"table","shape":{{"type":"plane"}}}},
                {{"id":"top","shape":{{"type":"plane"}}}}],
                "characteristics":[{{"id":"h","measure":{{"type":"step","base":"table","top":"top"}},"nominal_mm":9{limits}}},
                {{"id":"free","measure":{{"type":"step","base":"table","top":"top"}}}}]}}"#
        );
        Plan::from_json(&text).unwrap()
    }

    #[test]
    fn a_part_without_a_measurable_cloud_is_invalid_and_says_why() {
        let error = MeasureError::TooFewPoints { needed: 30, got: 2 };
        let result = PlanResult::not_measured(&plan(r#","upper":0.1"#), &error);
        assert_eq!(result.verdict, PartVerdict::Invalid);
        let [judged, free] = &result.characteristics[..] else { panic!("two") };
        assert_eq!(judged.reason().unwrap(), "not measured: 2 points to measure, at least 30 are needed");
        assert_eq!((free.verdict, free.reason()), (None, None));
        // Without limits no verdict is possible either.
        assert_eq!(PlanResult::not_measured(&plan(""), &error).verdict, PartVerdict::Invalid);
    }

    #[test]
    fn a_scan_without_a_verdict_overrules_what_was_measured() {
        let plan = plan(r#","upper":0.1"#);
        let mut result = PlanResult::not_measured(&plan, &MeasureError::NotDetermined { what: "step" });
        let judged = &mut result.characteristics[0];
        (judged.verdict, judged.failure) = (Some(PartVerdict::Undecided), None);
        (judged.error, judged.expanded_uncertainty) = (Some(0.095), Some(0.01));
        assert_eq!(judged.reason().unwrap(), "the error of +0.0950 mm is closer to a limit than U = 0.0100 mm");
        judged.verdict = Some(PartVerdict::Ok);
        assert_eq!(judged.reason(), None);
        let result = result.invalidated(&plan, "2 frames were lost");
        assert_eq!(result.verdict, PartVerdict::Invalid);
        assert_eq!(result.characteristics[0].reason().unwrap(), "2 frames were lost");
        assert_eq!(result.characteristics[1].verdict, None);
    }
}
