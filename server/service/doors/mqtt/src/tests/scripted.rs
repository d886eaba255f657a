//! Deliveries to brokers that answer in unusual ways.

use std::time::{Duration, Instant};

use app::doors::Delivery;

use crate::params::Times;
use crate::tests::bench::{Running, refused, result, settings, times, unreachable};
use crate::tests::scripted_broker::{Reply, ScriptedBroker, puback};

type Answer = fn([u8; 2], &str) -> Reply;

/// Acknowledges all but results, for which the answer is given.
fn results(answer: Answer) -> impl Fn([u8; 2], &str) -> Reply {
    move |packet_id, topic| match topic.ends_with("/result") {
        true => answer(packet_id, topic),
        false => Reply::Bytes(puback(packet_id, 0)),
    }
}

fn start(broker: &ScriptedBroker) -> Running {
    Running::start_with(settings(&broker.url()), Times { acknowledged_within: Duration::from_secs(1), ..times() })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_message_without_acknowledgement_is_not_delivered() {
    for session_present in [false, true] {
        let broker = ScriptedBroker::start(session_present, &[], results(|_, _| Reply::Bytes(Vec::new())));
        let running = start(&broker);
        let begun = Instant::now();
        let reason = unreachable(running.deliver(&result(1)).await);
        assert!(reason.contains("did not acknowledge within 1 s"), "{reason}");
        assert!(begun.elapsed() < Duration::from_secs(3));
        // Over a new connection, others are acknowledged.
        running.deliver_at_last(&Delivery::test("mes")).await;
        running.close().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_acknowledgement_of_another_message_does_not_count() {
    let other = |[high, low]: [u8; 2], _: &str| Reply::Bytes(puback([high, low ^ 8], 0));
    let broker = ScriptedBroker::start(true, &[], results(other));
    let running = start(&broker);
    unreachable(running.deliver(&result(1)).await);
    running.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_connection_that_breaks_before_the_acknowledgement_delivers_nothing() {
    for session_present in [false, true] {
        let broker = ScriptedBroker::start(session_present, &[], results(|_, _| Reply::Closed));
        let running = start(&broker);
        for _ in 0..3 {
            let reason = unreachable(running.deliver(&result(1)).await);
            assert!(reason.contains("did not acknowledge"), "{reason}");
        }
        // Nothing of it is left to be acknowledged instead of this.
        running.deliver(&Delivery::test("mes")).await.unwrap();
        running.close().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn reasons_of_acknowledgements_are_told_apart() {
    let answers: [(Answer, &str); 4] = [
        (|id, _| Reply::Bytes(puback(id, 0x97)), "a quota is exceeded"),
        (|id, _| Reply::Bytes(puback(id, 0x99)), "the payload is not accepted"),
        // A reason that MQTT does not define for PUBACK, and DISCONNECT because of the size.
        (|id, _| Reply::Bytes(puback(id, 0x95)), "did not acknowledge"),
        (|_, _| Reply::Bytes(vec![0xE0, 2, 0x95, 0]), "does not accept packets of that size"),
    ];
    for (answer, words) in answers {
        let broker = ScriptedBroker::start(false, &[], results(answer));
        let running = start(&broker);
        let reason = refused(running.deliver(&result(1)).await);
        assert!(reason.contains(words), "{reason}");
        running.deliver_at_last(&Delivery::test("mes")).await;
        running.close().await;
    }
    let broker = ScriptedBroker::start(false, &[], results(|id, _| Reply::Bytes(puback(id, 0x10))));
    let running = start(&broker);
    running.deliver(&result(1)).await.unwrap();
    running.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_session_that_was_taken_over_is_named_and_holds_events_back() {
    let broker = ScriptedBroker::start(true, &[], results(|_, _| Reply::Bytes(vec![0xE0, 2, 0x8E, 0])));
    let running = start(&broker);
    let reason = unreachable(running.deliver(&result(1)).await);
    assert!(reason.contains("another client with the same client id connected"), "{reason}");
    running.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_that_acknowledges_nothing_is_of_no_use() {
    // Maximum QoS 0.
    let broker = ScriptedBroker::start(false, &[0x24, 0], |id, _| Reply::Bytes(puback(id, 0)));
    let running = start(&broker);
    let reason = unreachable(running.deliver(&result(1)).await);
    assert!(reason.contains("does not support QoS 1"), "{reason}");
    running.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn cancelled_deliveries_do_not_confuse_later_ones() {
    let broker = ScriptedBroker::start(false, &[], |id, topic| match topic.ends_with("/result") {
        true => {
            std::thread::sleep(Duration::from_millis(20));
            Reply::Bytes(puback(id, 0))
        }
        false => Reply::Bytes(puback(id, 0x97)),
    });
    let running = start(&broker);
    running.deliver(&result(1)).await.unwrap();
    for seq in 2..40 {
        let delivery = result(seq);
        tokio::select! {
            biased;
            _ = running.deliver(&delivery) => {}
            () = tokio::time::sleep(Duration::from_millis(10)) => {}
        }
        // Refused by the broker, unlike the one before.
        refused(running.deliver(&Delivery::test("mes")).await);
    }
    running.close().await;
}
