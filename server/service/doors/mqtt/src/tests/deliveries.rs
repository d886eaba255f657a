//! Events on their way to subscribers.

use app::doors::{Delivery, Door as _};
use serde_json::json;

use crate::tests::bench::{Running, event, large, result, settings};
use crate::tests::broker::Broker;
use crate::tests::subscriber::Subscriber;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_hundred_results_arrive_once_in_order_and_nothing_else() {
    let broker = Broker::start();
    let subscriber = Subscriber::of(&broker);
    let running = Running::start(settings(&broker.url()));
    for seq in 1..=600 {
        let delivery = match seq % 3 {
            0 => result(seq),
            1 => Delivery::new(event(seq, "inspection.held"), None),
            _ => Delivery::new(event(seq, "scan.created"), None),
        };
        if running.door.wants(&delivery.event) {
            running.deliver(&delivery).await.unwrap();
        }
    }
    running.deliver(&Delivery::test("mes")).await.unwrap();
    subscriber.until("sheaf/station/event", |arrived| !arrived.is_empty());
    let seqs = |topic| -> Vec<_> {
        subscriber.on(topic).iter().map(|one| one.payload["seq"].as_i64().unwrap()).collect()
    };
    assert_eq!(seqs("sheaf/station/result"), (1..=200).map(|n| 3 * n).collect::<Vec<i64>>());
    assert_eq!(seqs("sheaf/station/event"), [0]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_result_carries_the_message_of_all_doors_and_expires_after_a_day() {
    let broker = Broker::start();
    let subscriber = Subscriber::of(&broker);
    let running = Running::start(settings(&broker.url()));
    let delivery = result(812);
    running.deliver(&delivery).await.unwrap();
    let arrived = subscriber.until("/result", |arrived| !arrived.is_empty()).remove(0);
    assert_eq!(arrived.payload, delivery.message());
    assert_eq!((&arrived.payload["id"], &arrived.payload["seq"]), (&json!(delivery.id()), &json!(812)));
    assert_eq!(arrived.payload["data"]["verdict"], "not_ok");
    assert_eq!((arrived.qos, arrived.retained), (1, false));
    assert_eq!(arrived.content_type, "application/json");
    assert!((86_390..=86_400).contains(&arrived.expiry_s.unwrap()), "{arrived:?}");
    let late = Subscriber::late(&broker);
    assert_eq!(late.on("/result"), []);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn prefix_and_station_make_the_topic_and_recipes_select() {
    let broker = Broker::start();
    let subscriber = Subscriber::of(&broker);
    let mut settings = settings(&broker.url());
    settings.prefix = "plant/hall3".to_owned();
    settings.station = "cell 4".to_owned();
    settings.events = vec!["*".to_owned()];
    settings.recipes = vec!["bracket".to_owned()];
    let running = Running::start(settings);
    assert_eq!(running.door.target(), format!("{}, topics plant/hall3/cell 4/#", broker.url()));
    let mut other = event(3, "inspection.finished");
    assert!(running.door.wants(&other) && running.door.wants(&event(4, "station.stopped")));
    other.body = json!({ "recipe": "flange@1" });
    assert!(!running.door.wants(&other));
    running.deliver(&Delivery::new(event(4, "station.stopped"), None)).await.unwrap();
    subscriber.until("plant/hall3/cell 4/event", |arrived| arrived.len() == 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_megabyte_passes_also_without_any_subscriber() {
    const MEGABYTE: usize = 1 << 20;
    let broker = Broker::start();
    let running = Running::start(settings(&broker.url()));
    running.deliver(&large(1, MEGABYTE)).await.unwrap();
    let subscriber = Subscriber::of(&broker);
    running.deliver(&large(2, MEGABYTE)).await.unwrap();
    let arrived = subscriber.until("/result", |arrived| !arrived.is_empty());
    assert_eq!(arrived[0].payload["data"]["serial"].as_str().unwrap().len(), MEGABYTE);
}
