use store::{Change, Page, StoreError};

use super::stores;
use crate::common::{activate, calibration, capture, first, scan};

#[tokio::test]
async fn a_stored_calibration_is_returned_and_equal_content_is_stored_once() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let (capture, mut made) = (capture(), calibration("c1"));
        made.capture_id = Some(capture.id.clone());
        let insert = Change::InsertCalibration(made.clone());
        catalogue.commit(vec![Change::InsertCapture(capture.clone()), insert.clone()]).await.unwrap();
        catalogue.commit(vec![insert]).await.unwrap();
        assert_eq!(catalogue.calibrations(&first(9)).await.unwrap().records, [made.clone()]);
        assert_eq!(catalogue.calibration("c1").await.unwrap(), made);
        assert_eq!(catalogue.capture(&capture.id).await.unwrap(), capture);

        catalogue.commit(vec![Change::DeleteCapture(capture.id.clone())]).await.unwrap();
        assert_eq!(catalogue.calibration("c1").await.unwrap().capture_id, None, "nothing names what is gone");
        let gone = catalogue.capture(&capture.id).await.unwrap_err();
        assert!(matches!(gone, StoreError::NotFound { kind: "capture", .. }));
    }
}

#[tokio::test]
async fn calibrations_are_listed_by_arrival_though_their_ids_are_hashes() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        for id in ["m", "z", "a", "k"] {
            catalogue.commit(vec![Change::InsertCalibration(calibration(id))]).await.unwrap();
        }
        let page = async |before: Option<&str>| {
            let page = Page { before: before.map(str::to_owned), limit: 2 };
            catalogue
                .calibrations(&page)
                .await
                .map(|page| page.records.into_iter().map(|c| c.id).collect::<Vec<_>>())
        };
        assert_eq!(page(None).await.unwrap(), ["k", "a"]);
        assert_eq!(page(Some("a")).await.unwrap(), ["z", "m"]);
        assert!(matches!(page(Some("?")).await.unwrap_err(), StoreError::NotFound { .. }));
    }
}

#[tokio::test]
async fn activations_are_a_log_whose_last_entry_counts() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        assert_eq!(catalogue.active().await.unwrap(), None);
        let both = ["c1", "c2"].map(|id| Change::InsertCalibration(calibration(id)));
        catalogue.commit(both.to_vec()).await.unwrap();
        for id in [Some("c1"), Some("c2"), None] {
            catalogue.commit(vec![activate(id, None)]).await.unwrap();
            assert_eq!(catalogue.active().await.unwrap().unwrap().calibration_id.as_deref(), id);
        }
        let log = catalogue.activations(&first(9)).await.unwrap().records;
        let listed: Vec<_> =
            log.iter().map(|a| (a.seq, a.previous_id.as_deref(), a.calibration_id.as_deref())).collect();
        assert_eq!(listed, [(3, Some("c2"), None), (2, Some("c1"), Some("c2")), (1, None, Some("c1"))]);
        let older = Page { before: Some("2".into()), limit: 9 };
        assert_eq!(catalogue.activations(&older).await.unwrap().records, log[2..]);
    }
}

#[tokio::test]
async fn an_activation_checks_the_expected_calibration_and_its_reference() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let both = ["c1", "c2"].map(|id| Change::InsertCalibration(calibration(id)));
        catalogue.commit(both.to_vec()).await.unwrap();
        catalogue.commit(vec![activate(Some("c1"), Some(None))]).await.unwrap();
        for stale in [None, Some("c2")] {
            let error = catalogue.commit(vec![activate(Some("c2"), Some(stale))]).await.unwrap_err();
            assert!(matches!(error, StoreError::Changed { .. }), "{error}");
        }
        let missing = catalogue.commit(vec![activate(Some("c9"), None)]).await.unwrap_err();
        assert!(matches!(missing, StoreError::NotFound { kind: "calibration", .. }));
        assert_eq!(catalogue.activations(&first(9)).await.unwrap().records.len(), 1);
        catalogue.commit(vec![activate(Some("c2"), Some(Some("c1")))]).await.unwrap();
        assert_eq!(catalogue.active().await.unwrap().unwrap().calibration_id.as_deref(), Some("c2"));
    }
}

#[tokio::test]
async fn a_calibration_that_is_active_or_needed_stays() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let all = ["c1", "c2", "c3"].map(|id| Change::InsertCalibration(calibration(id)));
        catalogue.commit(all.to_vec()).await.unwrap();
        catalogue.commit(vec![activate(Some("c1"), None), Change::InsertScan(scan("c2"))]).await.unwrap();
        for id in ["c1", "c2"] {
            let error = catalogue.commit(vec![Change::DeleteCalibration(id.into())]).await.unwrap_err();
            assert!(matches!(error, StoreError::Refused { kind: "calibration", .. }), "{error}");
        }
        catalogue.commit(vec![Change::DeleteCalibration("c3".into())]).await.unwrap();
        let gone = catalogue.commit(vec![Change::DeleteCalibration("c3".into())]).await.unwrap_err();
        assert!(matches!(gone, StoreError::NotFound { kind: "calibration", .. }));
    }
}
