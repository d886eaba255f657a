use serde_json::json;
use store::{Change, MeasurementFilter, Page, ScanFilter, ScanState, StoreError};

use super::stores;
use crate::common::{calibration, capture, first, measurement, scan};

#[tokio::test]
async fn a_stored_scan_is_returned_and_replaced_by_its_resumed_version() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let mut partial = scan("c1");
        (partial.state, partial.cloud) = (ScanState::Partial, None);
        let insert = Change::InsertScan(partial.clone());
        catalogue.commit(vec![Change::InsertCalibration(calibration("c1")), insert.clone()]).await.unwrap();
        assert_eq!(catalogue.scan(&partial.id).await.unwrap(), partial);
        let again = catalogue.commit(vec![insert]).await.unwrap_err();
        assert!(matches!(again, StoreError::Exists { kind: "scan", .. }));

        let mut resumed = scan("c1");
        resumed.id = partial.id;
        let all = ScanFilter::default();
        catalogue.commit(vec![Change::ReplaceScan(resumed.clone())]).await.unwrap();
        assert_eq!(catalogue.scans(&all, &first(9)).await.unwrap().records, [resumed]);
        let missing = catalogue.commit(vec![Change::ReplaceScan(scan("c1"))]).await.unwrap_err();
        assert!(matches!(missing, StoreError::NotFound { kind: "scan", .. }));
    }
}

#[tokio::test]
async fn a_scan_refers_only_to_existing_records() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        catalogue.commit(vec![Change::InsertCalibration(calibration("c1"))]).await.unwrap();
        let mut dangling = [scan("c9"), scan("c1"), scan("c1")];
        dangling[1].capture_id = Some("no".into());
        dangling[2].recomputed_from = Some("no".into());
        for scan in dangling {
            let error = catalogue.commit(vec![Change::InsertScan(scan)]).await.unwrap_err();
            assert!(matches!(error, StoreError::Refused { kind: "scan", .. }), "{error}");
        }
        let error = catalogue.commit(vec![Change::InsertMeasurement(measurement("no"))]).await.unwrap_err();
        assert!(matches!(error, StoreError::Refused { kind: "measurement", .. }), "{error}");
    }
}

#[tokio::test]
async fn deleting_a_scan_deletes_its_measurements_and_keeps_its_recomputed_scan() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let capture = capture();
        let (mut original, mut recomputed) = (scan("c1"), scan("c1"));
        original.capture_id = Some(capture.id.clone());
        recomputed.recomputed_from = Some(original.id.clone());
        let (gone, kept) = (measurement(&original.id), measurement(&recomputed.id));
        let changes = vec![
            Change::InsertCapture(capture),
            Change::InsertCalibration(calibration("c1")),
            Change::InsertScan(original.clone()),
            Change::InsertScan(recomputed.clone()),
            Change::InsertMeasurement(gone.clone()),
            Change::InsertMeasurement(kept.clone()),
        ];
        catalogue.commit(changes).await.unwrap();
        let on_original = MeasurementFilter { scan_id: Some(original.id.clone()), ..MeasurementFilter::default() };
        assert_eq!(
            catalogue.measurements(&on_original, &first(9)).await.unwrap().records,
            std::slice::from_ref(&gone)
        );

        catalogue.commit(vec![Change::DeleteScan(original.id.clone())]).await.unwrap();
        assert!(matches!(catalogue.scan(&original.id).await.unwrap_err(), StoreError::NotFound { .. }));
        assert!(matches!(catalogue.measurement(&gone.id).await.unwrap_err(), StoreError::NotFound { .. }));
        assert_eq!(catalogue.measurement(&kept.id).await.unwrap(), kept);
        assert_eq!(catalogue.scan(&recomputed.id).await.unwrap().recomputed_from, None);
        let twice = catalogue.commit(vec![Change::DeleteScan(original.id)]).await.unwrap_err();
        assert!(matches!(twice, StoreError::NotFound { kind: "scan", .. }));
    }
}

#[tokio::test]
async fn scans_are_listed_by_state_and_calibration() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let mut scans = [scan("c1"), scan("c1"), scan("c2"), scan("c1")];
        scans[1].state = ScanState::Invalid;
        let mut changes = ["c1", "c2"].map(|id| Change::InsertCalibration(calibration(id))).to_vec();
        changes.extend(scans.iter().cloned().map(Change::InsertScan));
        catalogue.commit(changes).await.unwrap();
        let list = async |state, calibration: Option<&str>, page: Page| {
            let calibration_id = calibration.map(str::to_owned);
            let filter = ScanFilter { state, calibration_id, ..ScanFilter::default() };
            let list = catalogue.scans(&filter, &page).await.unwrap();
            (list.records.into_iter().map(|scan| scan.id).collect::<Vec<_>>(), list.next)
        };
        let ids = |which: &[usize]| which.iter().map(|idx| scans[*idx].id.clone()).collect::<Vec<_>>();
        assert_eq!(list(None, None, first(9)).await, (ids(&[3, 2, 1, 0]), None));
        assert_eq!(list(Some(ScanState::Invalid), None, first(9)).await, (ids(&[1]), None));
        assert_eq!(list(Some(ScanState::Complete), Some("c1"), first(9)).await, (ids(&[3, 0]), None));
        // A page of a filtered list leads on to the next one that fits.
        let (newest, next) = list(None, Some("c1"), first(1)).await;
        assert_eq!((newest, &next), (ids(&[3]), &Some(scans[3].id.clone())));
        assert_eq!(list(None, Some("c1"), Page { before: next, limit: 1 }).await.0, ids(&[1]));
    }
}

#[tokio::test]
async fn scans_are_found_by_a_part_of_their_name_and_by_their_time() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let names = ["Träger 100%", "TRÄGER_2", "bracket-3", "Bracket 13"];
        let mut changes = vec![Change::InsertCalibration(calibration("c1"))];
        changes.extend(names.iter().enumerate().map(|(idx, name)| {
            let mut scan = scan("c1");
            (scan.name, scan.created_at_ms) = ((*name).to_owned(), 1_000 * idx as i64);
            Change::InsertScan(scan)
        }));
        catalogue.commit(changes).await.unwrap();
        let list = async |filter: ScanFilter, page: Page| {
            let list = catalogue.scans(&filter, &page).await.unwrap();
            (list.records.into_iter().map(|scan| scan.name).collect::<Vec<_>>(), list.next)
        };
        let named = |name: &str| ScanFilter { name: Some(name.to_owned()), ..ScanFilter::default() };
        let none = [""; 0];
        assert_eq!(list(named("BRACK"), first(9)).await.0, ["Bracket 13", "bracket-3"]);
        assert_eq!(list(named("träger"), first(9)).await.0, ["TRÄGER_2", "Träger 100%"]);
        assert_eq!(list(named("trüger"), first(9)).await.0, none);
        // These are letters like others.
        assert_eq!(list(named("%"), first(9)).await.0, ["Träger 100%"]);
        assert_eq!(list(named("_"), first(9)).await.0, ["TRÄGER_2"]);
        assert_eq!(list(named("\\"), first(9)).await.0, none);
        let between = ScanFilter { from_ms: Some(1_000), to_ms: Some(3_000), ..ScanFilter::default() };
        assert_eq!(list(between, first(9)).await.0, ["bracket-3", "TRÄGER_2"]);
        // A page leads on to the next one that fits.
        let (newest, next) = list(named("bracket"), first(1)).await;
        assert_eq!(newest, ["Bracket 13"]);
        let (older, next) = list(named("bracket"), Page { before: next, limit: 1 }).await;
        assert_eq!(older, ["bracket-3"]);
        assert_eq!(list(named("bracket"), Page { before: next, limit: 1 }).await, (Vec::new(), None));
    }
}

#[tokio::test]
async fn measurements_are_listed_over_all_scans_by_tool_and_verdict() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let scans = [scan("c1"), scan("c1")];
        let made = |scan_idx: usize, tool: &str, verdict: Option<&str>| {
            let mut made = measurement(&scans[scan_idx].id);
            made.request = json!({ "tool": tool });
            // A verdict of an inner table is not the measurement's.
            made.result = json!({ "verdict": verdict, "tables": [{ "verdict": "not_ok" }] });
            made
        };
        let all = [
            made(0, "sphere", Some("ok")),
            made(1, "sphere", Some("not_ok")),
            made(0, "plane", None),
            made(1, "plane", Some("ok")),
        ];
        let mut changes = vec![Change::InsertCalibration(calibration("c1"))];
        changes.extend(scans.iter().cloned().map(Change::InsertScan));
        changes.extend(all.iter().cloned().map(Change::InsertMeasurement));
        catalogue.commit(changes).await.unwrap();
        let list = async |tool: Option<&str>, verdict: Option<&str>| {
            let tool = tool.map(str::to_owned);
            let filter = MeasurementFilter {
                scan_id: None,
                tool,
                verdicts: verdict.map(str::to_owned).into_iter().collect(),
            };
            catalogue.measurements(&filter, &first(9)).await.unwrap().records
        };
        let newest_first: Vec<_> = all.iter().rev().cloned().collect();
        assert_eq!(list(None, None).await, newest_first);
        assert_eq!(list(Some("sphere"), None).await, [all[1].clone(), all[0].clone()]);
        assert_eq!(list(None, Some("ok")).await, [all[3].clone(), all[0].clone()]);
        assert_eq!(list(Some("plane"), Some("not_ok")).await, []);
        let either = vec!["not_ok".to_owned(), "ok".to_owned()];
        let filter = MeasurementFilter { verdicts: either, ..MeasurementFilter::default() };
        let judged = catalogue.measurements(&filter, &first(9)).await.unwrap().records;
        assert_eq!(judged, [all[3].clone(), all[1].clone(), all[0].clone()]);
    }
}
