use store::{Change, EventRecord, StoreError};

use super::stores;
use crate::common::{event, idempotency, job};

fn append(subject: &str) -> Change {
    Change::AppendEvent(event(subject))
}

#[tokio::test]
async fn events_are_numbered_without_gaps_also_after_a_refused_commit() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        assert_eq!(catalogue.last_event_seq().await.unwrap(), 0);
        let stored = catalogue.commit(vec![append("a"), append("b")]).await.unwrap();
        assert_eq!(stored, [EventRecord { seq: 1, ..event("a") }, EventRecord { seq: 2, ..event("b") }]);
        catalogue.commit(vec![append("lost"), Change::DeleteScan("no".into())]).await.unwrap_err();
        catalogue.commit(vec![append("c")]).await.unwrap();
        let read = catalogue.events_after(1, 9).await.unwrap().records;
        assert_eq!(read, [EventRecord { seq: 2, ..event("b") }, EventRecord { seq: 3, ..event("c") }]);
        assert_eq!(catalogue.events_after(0, 1).await.unwrap().records, stored[..1]);
    }
}

#[tokio::test]
async fn numbers_of_pruned_events_are_not_reused() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        catalogue.commit(vec![append("a"), append("b")]).await.unwrap();
        catalogue.commit(vec![Change::PruneEventsThrough { seq: 2 }]).await.unwrap();
        assert!(catalogue.events_after(0, 9).await.unwrap().records.is_empty());
        assert_eq!(catalogue.last_event_seq().await.unwrap(), 2);
        assert_eq!(catalogue.commit(vec![append("c")]).await.unwrap()[0].seq, 3);
    }
}

#[tokio::test]
async fn a_key_is_used_once_until_it_is_deleted() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let (old, new) = (idempotency("POST /scans k1", 100), idempotency("POST /scans k2", 200));
        let both = [&old, &new].map(|record| Change::InsertIdempotency(record.clone()));
        catalogue.commit(both.to_vec()).await.unwrap();
        let (job, used) = (job(), Change::InsertIdempotency(old.clone()));
        let twice = catalogue.commit(vec![Change::InsertJob(job.clone()), used]).await.unwrap_err();
        assert!(matches!(twice, StoreError::Exists { kind: "idempotency key", .. }));
        assert!(catalogue.job(&job.id).await.is_err(), "the job of a refused request does not exist");

        catalogue.commit(vec![Change::PruneIdempotencyKeys { at_ms: 200 }]).await.unwrap();
        assert_eq!(catalogue.idempotency(&old.key).await.unwrap(), None);
        assert_eq!(catalogue.idempotency(&new.key).await.unwrap(), Some(new));
    }
}
