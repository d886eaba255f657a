//! State and health of the station, and the last will.

use std::time::Instant;

use app::doors::{MachineState, OperationalState};
use serde_json::json;

use crate::station::FaultMessage;
use crate::tests::bench::{Running, result, settings, times};
use crate::tests::broker::Broker;
use crate::tests::subscriber::{Arrived, Subscriber};

const READY: MachineState = MachineState::Operational(OperationalState::Ready);
const SINGLE_EXECUTION: MachineState = MachineState::Operational(OperationalState::SingleExecution);

fn states(arrived: &[Arrived]) -> Vec<String> {
    let word = |one: &Arrived| match one.payload["online"].as_bool().unwrap() {
        true => one.payload["state"].as_str().unwrap().to_owned(),
        false => "offline".to_owned(),
    };
    arrived.iter().map(word).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_change_of_the_state_is_published_and_the_last_one_retained() {
    let broker = Broker::start();
    let subscriber = Subscriber::of(&broker);
    let running = Running::start(settings(&broker.url()));
    subscriber.until("/state", |arrived| arrived.len() == 1);
    running.station.send_modify(|station| {
        station.changes.extend([(2, READY), (3, SINGLE_EXECUTION)]);
        station.simulated = Some("twin");
    });
    running.station.send_modify(|station| station.changes.push((4, READY)));
    let arrived = subscriber.until("sheaf/station/state", |arrived| arrived.len() == 4);
    let all = ["Preoperational", "Operational.Ready", "Operational.SingleExecution", "Operational.Ready"];
    assert_eq!(states(&arrived), all);
    let late = Subscriber::late(&broker);
    let last = late.until("/state", |arrived| !arrived.is_empty()).remove(0);
    let stated = ["schema", "online", "seq", "simulated"].map(|field| last.payload[field].clone());
    assert_eq!(stated, [json!("sheaf-state/1"), json!(true), json!(4), json!("twin")]);
    assert!(
        last.retained && last.content_type == "application/json" && last.payload["at_ms"].is_i64(),
        "{last:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_shutdown_says_goodbye_and_a_crash_is_announced_by_the_broker() {
    let broker = Broker::start();
    let subscriber = Subscriber::of(&broker);
    let running = Running::start(settings(&broker.url()));
    subscriber.until("/state", |arrived| states(arrived) == ["Preoperational"]);
    running.close().await;
    let arrived = subscriber.until("/state", |arrived| states(arrived) == ["Preoperational", "offline"]);
    assert!(arrived[1].payload["at_ms"].is_i64(), "not by the service: {arrived:?}");

    let running = Running::start(settings(&broker.url()));
    subscriber.until("/state", |arrived| arrived.len() == 3);
    running.crash().await;
    let arrived = subscriber.until("/state", |arrived| arrived.len() == 4);
    let will = &arrived[3];
    assert_eq!(will.payload, json!({ "schema": "sheaf-state/1", "online": false }));
    assert_eq!(will.content_type, "application/json");
    let late = Subscriber::late(&broker);
    let retained = late.until("/state", |arrived| !arrived.is_empty()).remove(0);
    assert!(retained.retained && retained.payload["online"] == false, "{retained:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_that_forgot_everything_learns_the_state_again() {
    let mut broker = Broker::start();
    let running = Running::start(settings(&broker.url()));
    running.station.send_modify(|station| station.changes.push((2, MachineState::Halted)));
    running.deliver(&result(1)).await.unwrap();
    broker.kill();
    broker.start_again();
    let subscriber = Subscriber::of(&broker);
    let arrived = subscriber.until("/state", |arrived| !arrived.is_empty());
    assert_eq!(states(&arrived), ["Halted"]);
    subscriber.until("/health", |arrived| !arrived.is_empty());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn faults_are_published_when_they_change_but_not_more_often_than_allowed() {
    const N_CHANGES: usize = 40;
    let broker = Broker::start();
    let subscriber = Subscriber::of(&broker);
    let running = Running::start(settings(&broker.url()));
    let first = subscriber.until("sheaf/station/health", |arrived| !arrived.is_empty()).remove(0);
    assert_eq!((&first.payload["schema"], &first.payload["faults"]), (&json!("sheaf-health/1"), &json!([])));
    let fault = FaultMessage {
        device: "camera",
        kind: "disconnected",
        detail: "no frames".to_owned(),
        remedy: "check the cable".to_owned(),
        since_ms: 0,
    };
    let begun = Instant::now();
    for n in 0..N_CHANGES {
        running.station.send_modify(|station| {
            station.faults = vec![FaultMessage { since_ms: n as i64, ..fault.clone() }];
        });
        tokio::time::sleep(times().health_interval / 10).await;
    }
    let last =
        |arrived: &[Arrived]| arrived.last().unwrap().payload["faults"][0]["since_ms"] == N_CHANGES as i64 - 1;
    let arrived = subscriber.until("/health", last);
    let most = begun.elapsed().as_secs_f64() / times().health_interval.as_secs_f64() + 2.0;
    let numbers: Vec<u64> = arrived.iter().map(|one| one.payload["seq"].as_u64().unwrap()).collect();
    assert_eq!(numbers, (1..=arrived.len() as u64).collect::<Vec<u64>>());
    assert!(arrived.len() > 3 && (arrived.len() as f64) <= most, "{} of at most {most}", arrived.len());
    let expected = json!([{
        "device": "camera", "kind": "disconnected", "detail": "no frames", "remedy": "check the cable",
        "since_ms": N_CHANGES - 1,
    }]);
    assert_eq!(arrived.last().unwrap().payload["faults"], expected);
}
