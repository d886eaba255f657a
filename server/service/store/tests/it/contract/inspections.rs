use store::{Change, InspectionFilter, InspectionRecord, Page, StoreError};

use super::stores;
use crate::common::{calibration, first, inspected, inspection, scan};

#[tokio::test]
async fn an_inspection_and_its_event_get_the_next_number_or_neither_is_stored() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let (one, dangling, two) = (inspection("S1", None), inspection("S2", Some("no")), inspection("S3", None));
        let stored = catalogue.commit(vec![inspected(&one)]).await.unwrap();
        assert_eq!((stored[0].seq, &stored[0].body["seq"]), (1, &1.into()));
        let error = catalogue.commit(vec![inspected(&two), inspected(&dangling)]).await.unwrap_err();
        assert!(matches!(error, StoreError::Refused { kind: "inspection", .. }), "{error}");
        let again = catalogue.commit(vec![inspected(&one)]).await.unwrap_err();
        assert!(matches!(again, StoreError::Exists { kind: "inspection", .. }), "{again}");
        assert_eq!(catalogue.last_event_seq().await.unwrap(), 1);
        catalogue.commit(vec![inspected(&two)]).await.unwrap();
        assert_eq!(catalogue.inspection(&two.id).await.unwrap(), InspectionRecord { seq: 2, ..two });
    }
}

#[tokio::test]
async fn an_inspection_outlives_its_scan() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let scan = scan("c1");
        let made = inspection("S1", Some(&scan.id));
        let scanned = Change::InsertScan(scan.clone());
        catalogue
            .commit(vec![Change::InsertCalibration(calibration("c1")), scanned, inspected(&made)])
            .await
            .unwrap();
        assert_eq!(catalogue.inspection(&made.id).await.unwrap().scan_id, Some(scan.id.clone()));
        catalogue.commit(vec![Change::DeleteScan(scan.id)]).await.unwrap();
        let kept = InspectionRecord { seq: 1, scan_id: None, ..made };
        assert_eq!(catalogue.inspection(&kept.id).await.unwrap(), kept);
    }
}

#[tokio::test]
async fn inspections_are_listed_by_part_recipe_verdict_and_time_from_both_ends() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let mut all: Vec<_> = ["S1", "S2", "S1", "S3"].map(|serial| inspection(serial, None)).into();
        (all[1].verdict, all[1].created_at_ms) = ("not_ok".into(), 20);
        (all[2].recipe_version, all[2].created_at_ms) = (3, 30);
        (all[3].recipe_id, all[3].created_at_ms, all[3].order_number) = ("hinge".into(), 40, None);
        for (idx, made) in all.iter_mut().enumerate() {
            catalogue.commit(vec![inspected(made)]).await.unwrap();
            made.seq = idx as i64 + 1;
        }
        let text = |text: &str| Some(text.to_owned());
        let none = InspectionFilter::default;
        let filters: [(InspectionFilter, &[usize]); 7] = [
            (none(), &[0, 1, 2, 3]),
            (InspectionFilter { serial: text("S1"), ..none() }, &[0, 2]),
            (InspectionFilter { order_number: text("4711"), verdict: text("ok"), ..none() }, &[0, 2]),
            (InspectionFilter { recipe_id: text("bracket"), ..none() }, &[0, 1, 2]),
            (InspectionFilter { recipe_id: text("bracket"), recipe_version: Some(3), ..none() }, &[2]),
            (InspectionFilter { from_ms: Some(20), to_ms: Some(40), ..none() }, &[1, 2]),
            (InspectionFilter { serial: text("S9"), ..none() }, &[]),
        ];
        for (filter, expected) in filters {
            let forth: Vec<_> = expected.iter().map(|idx| all[*idx].clone()).collect();
            let back: Vec<_> = forth.iter().rev().cloned().collect();
            assert_eq!(catalogue.inspections(&filter, &first(9)).await.unwrap().records, back, "{filter:?}");
            assert_eq!(catalogue.inspections_after(&filter, 0, 9).await.unwrap().records, forth, "{filter:?}");
        }
        let newest = catalogue.inspections(&none(), &first(3)).await.unwrap();
        let rest = Page { before: newest.next, limit: 9 };
        assert_eq!(catalogue.inspections(&none(), &rest).await.unwrap().records, [all[0].clone()]);
        let oldest = catalogue.inspections_after(&none(), 0, 3).await.unwrap();
        assert_eq!(oldest.next.as_deref(), Some("3"));
        assert_eq!(catalogue.inspections_after(&none(), 3, 9).await.unwrap().records, [all[3].clone()]);
    }
}
