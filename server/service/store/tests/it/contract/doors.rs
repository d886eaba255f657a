use store::{
    Change, DeliveryFilter, DeliveryRecord, DeliveryState, DoorRecord, EventRecord, SetAside, StoreError,
};

use super::stores;
use crate::common::event;

fn door(seq: i64) -> DoorRecord {
    DoorRecord { name: "mes".to_owned(), seq, n_delivered: 2, delivered_seq: Some(1), delivered_at_ms: Some(9) }
}

fn delivery(seq: i64, state: DeliveryState, next_at_ms: i64) -> DeliveryRecord {
    let event = EventRecord { seq, ..event("7") };
    DeliveryRecord { door: "mes".to_owned(), event, state, n_attempts: 3, next_at_ms, reason: "503".to_owned() }
}

fn set_aside(state: Option<DeliveryState>, due_at_ms: Option<i64>) -> DeliveryFilter {
    DeliveryFilter { door: "mes".to_owned(), state, due_at_ms }
}

#[tokio::test]
async fn a_door_resumes_where_it_was() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        assert_eq!(catalogue.door("mes").await.unwrap(), None);
        for seq in [4, 5] {
            catalogue.commit(vec![Change::PutDoor(door(seq))]).await.unwrap();
            assert_eq!(catalogue.door("mes").await.unwrap(), Some(door(seq)));
        }
        assert_eq!(catalogue.door("plc").await.unwrap(), None);
    }
}

#[tokio::test]
async fn deliveries_set_aside_are_listed_by_state_and_due_time_until_they_are_done() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let all = [
            delivery(3, DeliveryState::Waiting, 100),
            delivery(20, DeliveryState::Waiting, 50),
            delivery(21, DeliveryState::Dead, 0),
        ];
        let other = DeliveryRecord { door: "plc".to_owned(), ..all[0].clone() };
        let put = all.iter().cloned().chain([other]).map(Change::PutDelivery).collect();
        catalogue.commit(put).await.unwrap();

        let listed = async |filter: DeliveryFilter, seq, limit| {
            catalogue.deliveries(&filter, seq, limit).await.unwrap().records
        };
        assert_eq!(listed(set_aside(None, None), 0, 9).await, all);
        assert_eq!(listed(set_aside(None, None), 3, 1).await, all[1..2]);
        assert_eq!(listed(set_aside(Some(DeliveryState::Dead), None), 0, 9).await, all[2..]);
        assert_eq!(listed(set_aside(Some(DeliveryState::Waiting), Some(50)), 0, 9).await, all[1..2]);
        let counted = SetAside { n_waiting: 2, n_dead: 1, next_at_ms: Some(50) };
        assert_eq!(catalogue.set_aside("mes").await.unwrap(), counted);
        assert_eq!(catalogue.set_aside("none").await.unwrap(), SetAside::default());

        let dead = delivery(3, DeliveryState::Dead, 0);
        catalogue.commit(vec![Change::PutDelivery(dead.clone())]).await.unwrap();
        assert_eq!(catalogue.delivery("mes", 3).await.unwrap(), dead);
        let done = Change::DeleteDelivery { door: "mes".to_owned(), seq: 3 };
        catalogue.commit(vec![done.clone()]).await.unwrap();
        let twice = catalogue.commit(vec![done]).await.unwrap_err();
        assert!(matches!(twice, StoreError::NotFound { kind: "delivery", .. }));
        let missing = catalogue.delivery("mes", 3).await.unwrap_err();
        assert!(matches!(missing, StoreError::NotFound { kind: "delivery", .. }));
        assert_eq!(catalogue.delivery("plc", 3).await.unwrap().door, "plc");
    }
}
