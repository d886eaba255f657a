use store::{Change, ScanState, StoreError};

use crate::common::{calibration, capture, first, measurement, scan};
use crate::stores;

#[tokio::test]
async fn a_scan_comes_back_and_is_replaced_by_its_resumed_self() {
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
        catalogue.commit(vec![Change::ReplaceScan(resumed.clone())]).await.unwrap();
        assert_eq!(catalogue.scans(&first(9)).await.unwrap(), [resumed]);
        let missing = catalogue.commit(vec![Change::ReplaceScan(scan("c1"))]).await.unwrap_err();
        assert!(matches!(missing, StoreError::NotFound { kind: "scan", .. }));
    }
}

#[tokio::test]
async fn a_scan_names_only_what_is_there() {
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
async fn a_deleted_scan_takes_its_measurements_along_and_leaves_its_recomputed_self() {
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
        assert_eq!(catalogue.measurements(&original.id, &first(9)).await.unwrap(), std::slice::from_ref(&gone));

        catalogue.commit(vec![Change::DeleteScan(original.id.clone())]).await.unwrap();
        assert!(matches!(catalogue.scan(&original.id).await.unwrap_err(), StoreError::NotFound { .. }));
        assert!(matches!(catalogue.measurement(&gone.id).await.unwrap_err(), StoreError::NotFound { .. }));
        assert_eq!(catalogue.measurement(&kept.id).await.unwrap(), kept);
        assert_eq!(catalogue.scan(&recomputed.id).await.unwrap().recomputed_from, None);
        let twice = catalogue.commit(vec![Change::DeleteScan(original.id)]).await.unwrap_err();
        assert!(matches!(twice, StoreError::NotFound { kind: "scan", .. }));
    }
}
