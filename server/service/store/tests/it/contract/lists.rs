use store::{Change, Page, StoreError};

use super::stores;
use crate::common::{capture, first, session, study};

#[tokio::test]
async fn a_reader_that_pages_sees_every_record_once_while_others_arrive_and_go() {
    const N_RECORDS: usize = 60;
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let captures: Vec<_> = (0..N_RECORDS).map(|_| capture()).collect();
        catalogue.commit(captures.iter().cloned().map(Change::InsertCapture).collect()).await.unwrap();
        let mut seen = Vec::new();
        let mut page = first(7);
        loop {
            let records = catalogue.captures(&page).await.unwrap().records;
            let Some(last) = records.last() else { break };
            page.before = Some(last.id.clone());
            // The record the cursor stands on goes, and newer ones come.
            let changes = vec![Change::DeleteCapture(last.id.clone()), Change::InsertCapture(capture())];
            seen.extend(records.into_iter().map(|record| record.id));
            catalogue.commit(changes).await.unwrap();
        }
        let expected: Vec<_> = captures.into_iter().rev().map(|capture| capture.id).collect();
        assert_eq!(seen, expected);
    }
}

#[tokio::test]
async fn a_session_changes_one_version_after_the_other() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let mut session = session();
        catalogue.commit(vec![Change::InsertSession(session.clone())]).await.unwrap();
        (session.version, session.changed_at_ms, session.body) = (2, 50, serde_json::json!({"step": 2}));
        catalogue.commit(vec![Change::UpdateSession(session.clone())]).await.unwrap();
        let late = catalogue.commit(vec![Change::UpdateSession(session.clone())]).await.unwrap_err();
        assert!(matches!(late, StoreError::Changed { kind: "session", .. }));
        assert_eq!(catalogue.session(&session.id).await.unwrap(), session);
        assert_eq!(catalogue.sessions(&Page { before: None, limit: 1 }).await.unwrap().records, [session.clone()]);
        catalogue.commit(vec![Change::DeleteSession(session.id.clone())]).await.unwrap();
        let gone = catalogue.commit(vec![Change::UpdateSession(session)]).await.unwrap_err();
        assert!(matches!(gone, StoreError::NotFound { kind: "session", .. }));
    }
}

#[tokio::test]
async fn a_study_changes_one_version_after_the_other() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let mut study = study();
        catalogue.commit(vec![Change::InsertStudy(study.clone())]).await.unwrap();
        (study.version, study.changed_at_ms, study.body) = (2, 50, serde_json::json!({"name": "t"}));
        catalogue.commit(vec![Change::UpdateStudy(study.clone())]).await.unwrap();
        let late = catalogue.commit(vec![Change::UpdateStudy(study.clone())]).await.unwrap_err();
        assert!(matches!(late, StoreError::Changed { kind: "study", .. }));
        assert_eq!(catalogue.study(&study.id).await.unwrap(), study);
        assert_eq!(catalogue.studies(&Page { before: None, limit: 1 }).await.unwrap().records, [study.clone()]);
        catalogue.commit(vec![Change::DeleteStudy(study.id.clone())]).await.unwrap();
        let gone = catalogue.commit(vec![Change::UpdateStudy(study)]).await.unwrap_err();
        assert!(matches!(gone, StoreError::NotFound { kind: "study", .. }));
    }
}
