//! Inspections on the small simulated station: one transaction for scan, inspection and event; nothing for a part whose
//! scan was stopped; invalid where the scan allows no verdict.

use metrology::PartVerdict;
use serde_json::json;
use store::{Change, InspectionFilter, InspectionRecord, Page, ScanState};
use twin::SceneKind;

use crate::jobs::scan::tests::bench::Bench;
use crate::jobs::tests::as_if_elsewhere;
use crate::jobs::{Done, InspectInput, JobEnd, JobInput, ReEvaluateInput, StationContext};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::inspections::{InspectedPart, InspectionBody, judged};
use crate::resources::recipes::{Recipe, RecipeVersion};
use crate::resources::stored_scan::stored_cloud;

/// A recipe for the height of the gauge block on the table.
fn gauge(nominal_mm: f64) -> Recipe {
    let recipe = json!({
        "name": "gauge",
        "scan": { "from_mm": -8.0, "to_mm": 8.0, "step_mm": 0.5 },
        "plan": {
            "format": "sheaf-plan/1",
            "features": [
                { "id": "table", "shape": { "type": "plane" } },
                { "id": "top", "shape": { "type": "plane", "select": { "region": {
                    "type": "box", "min_mm": [-8.0, -6.0, 380.0], "max_mm": [8.0, 6.0, 396.0] } } } },
            ],
            "characteristics": [{ "id": "height", "measure": { "type": "step", "base": "table", "top": "top" },
                "nominal_mm": nominal_mm, "lower": -0.5, "upper": 0.5 }],
        },
    });
    serde_json::from_value(recipe).unwrap()
}

/// The station with a gauge block of 8.9 mm, and the recipe of it.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.operator.place_part(&SceneKind::Gauge { height_mm: 8.9 });
    bench.publish(1, gauge(8.9));
    bench
}

impl Bench {
    fn publish(&self, version: i64, recipe: Recipe) {
        let version = RecipeVersion {
            id: "gauge".into(),
            version,
            digest: recipe.digest(),
            author: "test".into(),
            reason: "test".into(),
            restored_from: None,
            created_at_ms: 1,
            recipe,
        };
        let publish = Change::PublishRecipe { version: version.to_record(), number: None };
        self.runtime.block_on(self.catalogue.commit(vec![publish])).unwrap();
    }

    fn inspection(&self, id: &str) -> InspectionRecord {
        self.runtime.block_on(self.catalogue.read().inspection(id)).unwrap()
    }

    fn inspections(&self) -> Vec<InspectionRecord> {
        let page = Page { before: None, limit: 100 };
        let all = InspectionFilter::default();
        self.runtime.block_on(self.catalogue.read().inspections(&all, &page)).unwrap().records
    }
}

fn inspect(recipe_version: i64, ctx: &StationContext) -> Result<Done, JobEnd> {
    let part = InspectedPart { serial: "S1".into(), order: None, attributes: [("a".into(), "b".into())].into() };
    as_if_elsewhere(JobInput::Inspection(InspectInput { recipe_id: "gauge".into(), recipe_version, part }), ctx)
}

fn body(inspection: &InspectionRecord) -> InspectionBody {
    serde_json::from_value(inspection.body.clone()).unwrap()
}

#[test]
fn a_part_is_inspected_in_one_job_and_re_evaluated_with_another_version() {
    let bench = bench();
    let id = bench.finish(inspect(1, &bench.job().ctx));
    let first = bench.inspection(&id);
    assert_eq!((first.verdict.as_str(), first.seq, first.recipe_version), ("ok", 1, 1));
    let scan = bench.record(first.scan_id.as_deref().unwrap());
    assert_eq!((scan.state, scan.name.as_str()), (ScanState::Complete, "S1"));
    let stored = body(&first);
    assert_eq!((stored.simulated, stored.attributes["a"].as_str()), (true, "b"));
    assert_eq!(stored.recipe_digest, gauge(8.9).digest());
    let events = bench.runtime.block_on(bench.catalogue.read().events_after(0, 99)).unwrap().records;
    let finished = events.iter().find(|event| event.kind == "inspection.finished").unwrap();
    assert_eq!(
        (&finished.subject, &finished.body["seq"], &finished.body["recipe"]),
        (&id, &1.into(), &"gauge@1".into())
    );

    // The nominal was wrong: the same scan is rejected, and the first verdict stays.
    bench.publish(2, gauge(10.5));
    let anew = ReEvaluateInput { inspection_id: id.clone(), recipe_id: "gauge".into(), recipe_version: 2 };
    let anew = bench.finish(as_if_elsewhere(JobInput::ReEvaluation(anew), &bench.job().ctx));
    let anew = bench.inspection(&anew);
    assert_eq!(
        (anew.verdict.as_str(), anew.seq, anew.re_evaluated_from.as_deref()),
        ("not_ok", 2, Some(id.as_str()))
    );
    let [change] = &body(&anew).changed[..] else { panic!("one verdict changed") };
    assert_eq!(
        (change.id.as_str(), change.before.as_deref(), change.after.as_deref()),
        ("height", Some("ok"), Some("not_ok"))
    );
    assert_eq!((bench.inspection(&id), bench.scans().len()), (first, 1));

    // Without its scan nothing can be judged anew.
    bench.runtime.block_on(bench.catalogue.commit(vec![Change::DeleteScan(scan.id)])).unwrap();
    let anew = ReEvaluateInput { inspection_id: id, recipe_id: "gauge".into(), recipe_version: 2 };
    let Err(JobEnd::Failed(problem)) = as_if_elsewhere(JobInput::ReEvaluation(anew), &bench.job().ctx) else {
        panic!("its scan is gone")
    };
    assert!(problem.detail.ends_with("was deleted"), "{problem:?}");
}

#[test]
fn a_part_whose_scan_was_stopped_is_not_inspected() {
    let bench = bench();
    let job = bench.job_cancelled_at(|words| words.starts_with("row 20 of"));
    assert!(matches!(inspect(1, &job.ctx), Err(JobEnd::Cancelled)));
    assert_eq!((bench.scans()[0].state, bench.inspections().len()), (ScanState::Partial, 0));
}

#[test]
fn a_scan_without_a_verdict_makes_every_result_invalid() {
    let bench = bench();
    let id = bench.finish(inspect(1, &bench.job().ctx));
    let mut scan = bench.record(bench.inspection(&id).scan_id.as_deref().unwrap());
    let calibration = bench
        .runtime
        .block_on(stored_document(&bench.catalogue, &*bench.store.artifacts, None))
        .unwrap()
        .calibration();
    let cloud = bench.runtime.block_on(stored_cloud(&*bench.store.artifacts, &scan)).unwrap();
    let plan = gauge(8.9).plan;
    assert_eq!(judged(&plan, &scan, &cloud, &calibration).unwrap().verdict, PartVerdict::Ok);
    scan.state = ScanState::Invalid;
    let result = judged(&plan, &scan, &cloud, &calibration).unwrap();
    assert_eq!(
        (result.verdict, result.characteristics[0].verdict),
        (PartVerdict::Invalid, Some(PartVerdict::Invalid))
    );
    assert_eq!(result.characteristics[0].reason().unwrap(), "the scan is invalid: frames were lost");
    assert!(result.characteristics[0].value.is_some(), "what was measured is shown");
}
