//! Brokers that refuse the client or a message.

use std::collections::BTreeSet;
use std::process::Command;
use std::time::{Duration, Instant};

use app::doors::{Delivery, Undelivered};

use crate::tests::bench::{Running, event, large, refused, result, settings, unreachable};
use crate::tests::broker::{Broker, PATIENCE, program};
use crate::tests::subscriber::Subscriber;

/// A broker that knows one user, `station` with the password `right`, who may write what these lines allow.
fn broker_with_user(rules: &str) -> Broker {
    let folder = tempfile::tempdir().unwrap();
    let [users, rights] = ["users", "rights"].map(|name| folder.path().join(name));
    let mut make = Command::new(program("mosquitto_passwd"));
    assert!(make.args(["-c", "-b"]).arg(&users).args(["station", "right"]).status().unwrap().success());
    std::fs::write(&rights, format!("user station\n{rules}\n")).unwrap();
    let lines = format!("allow_anonymous false\npassword_file {}\nacl_file {}", users.display(), rights.display());
    Broker::start_in(folder, &lines)
}

fn start_as(broker: &Broker, username: &str, password: &str) -> Running {
    let file = broker.folder.path().join("password");
    std::fs::write(&file, format!("{password}\n")).unwrap();
    let mut settings = settings(&broker.url());
    (settings.username, settings.password_file) = (Some(username.to_owned()), Some(file));
    Running::start(settings)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_wrong_password_is_named_as_the_reason_and_the_right_one_works() {
    let broker = broker_with_user("topic #");
    for (username, password) in [("station", "wrong"), ("other", "right")] {
        let running = start_as(&broker, username, password);
        let reason = unreachable(running.deliver(&result(1)).await);
        assert!(reason.contains("refused the user name or the password"), "{reason}");
        running.close().await;
    }
    let running = Running::start(settings(&broker.url()));
    let reason = unreachable(running.deliver(&result(1)).await);
    assert!(reason.contains("refused the user name or the password"), "{reason}");
    running.close().await;

    let running = start_as(&broker, "station", "right");
    let subscriber = Subscriber::with_login(&broker, &["-u", "station", "-P", "right"]);
    running.deliver(&result(1)).await.unwrap();
    subscriber.until("/result", |arrived| arrived.len() == 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_topic_that_the_user_may_not_write_is_refused_and_others_pass() {
    let broker = broker_with_user("topic write sheaf/station/result");
    let running = start_as(&broker, "station", "right");
    let other = Delivery::new(event(1, "scan.created"), None);
    let reason = refused(running.deliver(&other).await);
    assert!(reason.contains("sheaf/station/event: this user may not publish there (not authorised)"), "{reason}");
    running.deliver(&result(2)).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_message_larger_than_the_broker_accepts_is_impossible_and_does_not_hold_up_others() {
    let broker = Broker::start_with("allow_anonymous true\nmax_packet_size 20000");
    let running = Running::start(settings(&broker.url()));
    let subscriber = Subscriber::of(&broker);
    let Err(Undelivered::Impossible(reason)) = running.deliver(&large(1, 20_000)).await else { panic!() };
    assert!(reason.contains("accepts at most 20000"), "{reason}");
    running.deliver(&large(2, 15_000)).await.unwrap();
    let arrived = subscriber.until("/result", |arrived| !arrived.is_empty());
    assert_eq!(arrived[0].payload["seq"], 2);
    let births = subscriber.on("/state");
    assert_eq!(births.len(), 1, "the connection broke: {births:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_that_limits_messages_without_saying_so_refuses_them() {
    let broker = Broker::start_with("allow_anonymous true\nmessage_size_limit 5000");
    let running = Running::start(settings(&broker.url()));
    refused(running.deliver(&large(1, 20_000)).await);
    running.deliver_at_last(&result(2)).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_station_of_the_same_name_is_named_as_the_reason() {
    let broker = Broker::start();
    let first = Running::start(settings(&broker.url()));
    first.deliver(&result(1)).await.unwrap();
    let _second = Running::start(settings(&broker.url()));
    let begun = Instant::now();
    // Both take the session from each other. A delivery meets the end of a connection in different ways.
    let mut reasons = BTreeSet::new();
    while !reasons.iter().any(|why: &String| why.contains("perhaps another client uses the same client id")) {
        assert!(begun.elapsed() < PATIENCE, "{reasons:?}");
        if let Err(why) = first.deliver(&result(2)).await {
            reasons.insert(unreachable(Err(why)));
        }
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}
