//! Inspections on the small simulated station: one transaction for scan, inspection and event; nothing for a part whose
//! scan was stopped; invalid where the scan allows no verdict.

use metrology::{Models, PartVerdict};
use serde_json::json;
use store::{Change, InspectionFilter, InspectionRecord, Page, ScanState};
use twin::SceneKind;

use crate::jobs::scan::tests::bench::{Bench, true_document};
use crate::jobs::tests::as_if_elsewhere;
use crate::jobs::{Done, InspectInput, JobEnd, JobInput, ReEvaluateInput, ScanSource, StationContext};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::inspections::{InspectedPart, InspectionBody, inspection_changes, judged};
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
        "attributes": { "a": "of the recipe", "customer": "C" },
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
    inspect_from(ScanSource::Station, recipe_version, ctx)
}

fn inspect_from(source: ScanSource, recipe_version: i64, ctx: &StationContext) -> Result<Done, JobEnd> {
    let part = InspectedPart { serial: "S1".into(), order: None, attributes: [("a".into(), "b".into())].into() };
    let input = InspectInput { recipe_id: "gauge".into(), recipe_version, part, source };
    as_if_elsewhere(JobInput::Inspection(input), ctx)
}

/// A re-evaluation with a version of the recipe, and with a calibration if it is not that of the scan.
fn anew(inspection_id: &str, recipe_version: i64, calibration_id: Option<&str>) -> JobInput {
    JobInput::ReEvaluation(ReEvaluateInput {
        inspection_id: inspection_id.to_owned(),
        recipe_id: "gauge".to_owned(),
        recipe_version,
        calibration_id: calibration_id.map(str::to_owned),
    })
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
    assert_eq!(stored.attributes["customer"], "C");
    assert_eq!(stored.recipe_digest, gauge(8.9).digest());
    let events = bench.runtime.block_on(bench.catalogue.read().events_after(0, 99)).unwrap().records;
    let finished = events.iter().find(|event| event.kind == "inspection.finished").unwrap();
    assert_eq!(
        (&finished.subject, &finished.body["seq"], &finished.body["recipe"]),
        (&id, &1.into(), &"gauge@1".into())
    );

    // The nominal was wrong: the same scan is rejected, and the first verdict stays.
    bench.publish(2, gauge(10.5));
    let second = bench.finish(as_if_elsewhere(anew(&id, 2, None), &bench.job().ctx));
    let second = bench.inspection(&second);
    assert_eq!(
        (second.verdict.as_str(), second.seq, second.re_evaluated_from.as_deref()),
        ("not_ok", 2, Some(id.as_str()))
    );
    let [change] = &body(&second).changed[..] else { panic!("one verdict changed") };
    assert_eq!(
        (change.id.as_str(), change.before.as_deref(), change.after.as_deref()),
        ("height", Some("ok"), Some("not_ok"))
    );
    assert_eq!((bench.inspection(&id), bench.scans().len()), (first, 1));

    // Without its scan nothing can be judged anew.
    bench.runtime.block_on(bench.catalogue.commit(vec![Change::DeleteScan(scan.id)])).unwrap();
    let Err(JobEnd::Failed(problem)) = as_if_elsewhere(anew(&id, 2, None), &bench.job().ctx) else {
        panic!("its scan is gone")
    };
    assert!(problem.detail.ends_with("was deleted"), "{problem:?}");
}

#[test]
fn another_calibration_triangulates_the_points_again_and_changes_nothing_that_is_stored() {
    let bench = bench();
    let id = bench.finish(inspect(1, &bench.job().ctx));
    let first = bench.inspection(&id);
    let scan = bench.record(first.scan_id.as_deref().unwrap());
    // With its own calibration: the same scan.
    let own = scan.calibration_id.as_str();
    let same = bench.finish(as_if_elsewhere(anew(&id, 1, Some(own)), &bench.job().ctx));
    assert_eq!((bench.inspection(&same).scan_id, bench.scans().len()), (first.scan_id.clone(), 1));
    // With a camera of longer focal length, the block is flatter.
    let mut model = (*bench.operator.model()).clone();
    (model.camera.fx_px, model.camera.fy_px) = (1.1 * model.camera.fx_px, 1.1 * model.camera.fy_px);
    bench.add_calibration(&true_document(&model, "other000"), false);
    let other = bench.finish(as_if_elsewhere(anew(&id, 1, Some("other000")), &bench.job().ctx));
    let other = bench.inspection(&other);
    let rescanned = bench.record(other.scan_id.as_deref().unwrap());
    assert_eq!(
        (rescanned.recomputed_from.as_deref(), rescanned.calibration_id.as_str(), &rescanned.peaks),
        (Some(scan.id.as_str()), "other000", &scan.peaks)
    );
    let stored = body(&other);
    assert_eq!(
        (other.re_evaluated_from.as_deref(), stored.calibration_id.as_str()),
        (Some(id.as_str()), "other000")
    );
    let height = |inspection: &InspectionRecord| body(inspection).result["characteristics"][0]["value"].clone();
    assert_ne!(height(&other), height(&first));
    let [change] = &stored.changed[..] else { panic!("one verdict changed: {stored:?}") };
    assert_eq!(
        (change.before.as_deref(), change.after.as_deref()),
        (Some("ok"), Some(other.verdict.as_str())),
        "{stored:?}"
    );
    assert_eq!((bench.inspection(&id), bench.record(&scan.id)), (first, scan));
}

#[test]
fn a_scan_of_another_camera_or_without_its_centrelines_is_not_triangulated_again() {
    let bench = bench();
    let id = bench.finish(inspect(1, &bench.job().ctx));
    let scan = bench.record(bench.inspection(&id).scan_id.as_deref().unwrap());
    let refused = || match as_if_elsewhere(anew(&id, 1, Some("other000")), &bench.job().ctx) {
        Err(JobEnd::Failed(problem)) => problem,
        other => panic!("{other:?}"),
    };
    let mut model = (*bench.operator.model()).clone();
    model.camera.width_px *= 2;
    bench.add_calibration(&true_document(&model, "other000"), false);
    let problem = refused();
    assert!(problem.detail.contains("640") && problem.remedy.is_some(), "{problem:?}");
    std::fs::remove_file(bench.file_of(&scan.peaks)).unwrap();
    let problem = refused();
    assert!(problem.detail.contains(&format!("the peaks of scan {}", scan.id)), "{problem:?}");
    assert!(problem.remedy.is_some(), "{problem:?}");
    assert_eq!((bench.inspections().len(), bench.scans().len()), (1, 1));
}

#[test]
fn the_frames_of_a_capture_are_judged_without_the_station_like_those_from_it() {
    let bench = bench();
    let mut recipe = gauge(8.9);
    recipe.scan.keep_frames = true;
    bench.publish(2, recipe);
    let first = bench.inspection(&bench.finish(inspect(2, &bench.job().ctx)));
    let scan = bench.record(first.scan_id.as_deref().unwrap());
    let source = ScanSource::Capture { capture_id: scan.capture_id.clone().unwrap(), scan: None };
    bench.station.shut_down();
    let recorded = bench.inspection(&bench.finish(inspect_from(source, 2, &bench.job().ctx)));
    assert_eq!((recorded.verdict.as_str(), recorded.seq, recorded.serial.as_str()), ("ok", 2, "S1"));
    assert_eq!(bench.cloud(&bench.record(recorded.scan_id.as_deref().unwrap())), bench.cloud(&scan));
    let (first, recorded) = (body(&first), body(&recorded));
    assert_eq!(recorded.result["characteristics"], first.result["characteristics"]);
    assert_eq!((recorded.simulated, &recorded.attributes), (true, &first.attributes));
}

#[test]
fn an_inspection_that_violates_a_run_rule_announces_it_once() {
    let bench = bench();
    let first = bench.inspection(&bench.finish(inspect(1, &bench.job().ctx)));
    // Thirty earlier blocks, 0.2 mm higher.
    for idx in 0..30 {
        let mut earlier = body(&first);
        earlier.result["characteristics"][0]["value"] = json!(9.1 + 0.002 * f64::from(idx % 3));
        let record = InspectionRecord { id: format!("0000-{idx:02}"), ..first.clone() };
        bench.runtime.block_on(bench.catalogue.commit(inspection_changes(record, &earlier))).unwrap();
    }
    let announced = || {
        let events = bench.runtime.block_on(bench.catalogue.read().events_after(0, 200)).unwrap().records;
        events.into_iter().filter(|event| event.kind == "control_chart.rule_violated").collect::<Vec<_>>()
    };
    assert_eq!(announced(), []);
    // The first block is newer than they are: with the next one, two are beyond 3 sigma.
    let low = bench.finish(inspect(1, &bench.job().ctx));
    let all = announced();
    let event = all.iter().find(|event| event.body["rule"] == 1).unwrap();
    assert_eq!((&event.subject, &event.body["recipe"]), (&low, &json!("gauge@1")));
    assert_eq!(
        (&event.body["characteristic"], &event.body["n_points"], &event.body["first_inspection_id"]),
        (&json!("height"), &json!(2), &json!(first.id))
    );
    assert_eq!(body(&bench.inspection(&low)).violated_rules.len(), all.len());
    // The third one belongs to the same run.
    bench.finish(inspect(1, &bench.job().ctx));
    assert_eq!(announced().iter().filter(|event| event.body["rule"] == 1).count(), 1);
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
    assert_eq!(judged(&plan, &scan, &cloud, &calibration, &Models::new()).unwrap().verdict, PartVerdict::Ok);
    scan.state = ScanState::Invalid;
    let result = judged(&plan, &scan, &cloud, &calibration, &Models::new()).unwrap();
    assert_eq!(
        (result.verdict, result.characteristics[0].verdict),
        (PartVerdict::Invalid, Some(PartVerdict::Invalid))
    );
    assert_eq!(result.characteristics[0].reason().unwrap(), "the scan is invalid: frames were lost");
    assert!(result.characteristics[0].value.is_some(), "what was measured is shown");
}
