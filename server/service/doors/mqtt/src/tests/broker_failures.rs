//! Brokers that fail in the middle of deliveries.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant};

use app::doors::Door as _;

use crate::params::Times;
use crate::tests::bench::{Running, result, settings, times, unreachable};
use crate::tests::broker::{Broker, free_port};
use crate::tests::subscriber::{Arrived, Subscriber};

const N_RESULTS: i64 = 200;
const OUTAGE: Duration = Duration::from_secs(2);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_is_lost_when_a_broker_without_memory_is_killed() {
    outage("allow_anonymous true", Broker::kill).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_is_lost_when_a_broker_that_stores_its_sessions_is_restarted() {
    let folder = tempfile::tempdir().unwrap();
    let lines =
        format!("allow_anonymous true\npersistence true\npersistence_location {}/", folder.path().display());
    outage(&lines, Broker::stop).await;
}

/// Delivers while the broker ends and, after a while, starts again. After a failure, deliveries go on once the
/// subscriber is back: what a broker does with messages for absent subscribers is not the matter of this test.
async fn outage(lines: &str, end: fn(&mut Broker)) {
    let broker = Broker::start_with(lines);
    let subscriber = Arc::new(Subscriber::of(&broker));
    let running = Running::start(settings(&broker.url()));
    let n_delivered = Arc::new(AtomicI64::new(0));
    let (n_seen, returning) = (n_delivered.clone(), subscriber.clone());
    let mut failing = Some(tokio::task::spawn_blocking(move || {
        let mut broker = broker;
        while n_seen.load(Ordering::SeqCst) < N_RESULTS / 3 {
            std::thread::sleep(Duration::from_micros(100));
        }
        end(&mut broker);
        std::thread::sleep(OUTAGE);
        broker.start_again();
        returning.ready(&broker, &[]);
        broker
    }));
    let (mut broker, mut n_failures) = (None, 0);
    for seq in 1..=N_RESULTS {
        if let Err(why) = running.deliver(&result(seq)).await {
            unreachable(Err(why));
            // While the broker is away, attempts fail one after the other.
            while !failing.as_ref().is_none_or(|failing| failing.is_finished()) {
                let begun = Instant::now();
                if running.deliver(&result(seq)).await.is_err() {
                    n_failures += 1;
                }
                assert!(begun.elapsed() < OUTAGE, "a delivery waits for the broker");
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
            if let Some(failing) = failing.take() {
                broker = Some(failing.await.unwrap());
            }
            running.deliver_at_last(&result(seq)).await;
        }
        n_delivered.store(seq, Ordering::SeqCst);
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    assert!(broker.is_some() && n_failures > 3, "the broker was not missed: {n_failures} failures");
    let arrived = subscriber.until("/result", |arrived| ids(arrived).len() as i64 == N_RESULTS);
    let first_seen = first_seen(&arrived);
    assert_eq!(first_seen, (1..=N_RESULTS).collect::<Vec<_>>(), "lost, or out of order");
    let n_repeated = arrived.len() as i64 - N_RESULTS;
    assert!(n_repeated < 100, "{n_repeated} duplicates");
}

fn ids(arrived: &[Arrived]) -> BTreeSet<&str> {
    arrived.iter().filter_map(|one| one.payload["id"].as_str()).collect()
}

/// Numbers in order of their first arrival; a repeated id is the same event.
fn first_seen(arrived: &[Arrived]) -> Vec<i64> {
    let mut seen = BTreeSet::new();
    let is_new = |one: &&Arrived| seen.insert(one.payload["id"].as_str().unwrap().to_owned());
    arrived.iter().filter(is_new).map(|one| one.payload["seq"].as_i64().unwrap()).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_a_broker_a_delivery_fails_at_once_with_the_reason() {
    let running = Running::start(settings(&format!("mqtt://127.0.0.1:{}", free_port())));
    for _ in 0..3 {
        let begun = Instant::now();
        let reason = unreachable(running.deliver(&result(1)).await);
        assert!(reason.contains("is not connected: Connection refused"), "{reason}");
        assert!(begun.elapsed() < Duration::from_secs(2));
    }
    running.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_that_starts_later_is_found_by_the_next_delivery() {
    let mut broker = Broker::start();
    broker.kill();
    let never = Duration::from_secs(3600);
    let times = Times { reconnect_first: never, reconnect_last: never, ..times() };
    let running = Running::start_with(settings(&broker.url()), times);
    unreachable(running.deliver(&result(1)).await);
    broker.start_again();
    running.deliver(&result(1)).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_door_reconnects_without_deliveries_too() {
    let mut broker = Broker::start();
    let running = Running::start(settings(&broker.url()));
    running.deliver(&result(1)).await.unwrap();
    broker.kill();
    broker.start_again();
    let subscriber = Subscriber::of(&broker);
    subscriber.until("/state", |arrived| arrived.iter().any(|one| one.payload["online"] == true));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn after_the_end_a_delivery_fails_at_once() {
    let broker = Broker::start();
    let running = Running::start(settings(&broker.url()));
    running.deliver(&result(1)).await.unwrap();
    let door = running.door.clone();
    running.close().await;
    let begun = Instant::now();
    let reason = unreachable(door.deliver(&result(2)).await);
    assert!(reason.contains("is being shut down"), "{reason}");
    assert!(begun.elapsed() < Duration::from_secs(1));
}
