//! Commands by `mosquitto_pub` and `mosquitto_rr`, clients by another author.

use std::process::{Command, Output, Stdio};
use std::time::Instant;

use app::App;
use app::config::AppConfig;
use serde_json::{Value, json};

use crate::params::COMMAND_EXPIRY_S;
use crate::settings::Settings;
use crate::tests::bench::{Running, UNKNOWN, result, settings};
use crate::tests::broker::{Broker, PATIENCE, program};
use crate::tests::subscriber::Subscriber;

const TOPIC: &str = "sheaf/station/cmd";

const ANSWERS: &str = "line/answers";

fn commanded(broker: &Broker) -> Settings {
    Settings { commands: true, ..settings(&broker.url()) }
}

fn client(name: &str, broker: &Broker, command: &Value) -> Command {
    let mut client = Command::new(program(name));
    client.args(["-V", "mqttv5", "-h", "127.0.0.1", "-p", &broker.port.to_string(), "-q", "1", "-t", TOPIC]);
    client.args(["-m", &command.to_string()]).stdin(Stdio::null());
    client
}

fn with_expiry(client: &mut Command) -> &mut Command {
    client.args(["-D", "publish", "message-expiry-interval", &COMMAND_EXPIRY_S.to_string()])
}

fn output(client: &mut Command) -> Output {
    let output = client.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

/// The answer to a command, by a client that gives correlation data.
fn answer(broker: &Broker, command: &Value) -> Value {
    let mut client = client("mosquitto_rr", broker, command);
    with_expiry(&mut client).args(["-e", ANSWERS, "-D", "publish", "correlation-data", "part 7", "-W", "30"]);
    let output = output(client.args(["-F", "%D\t%C\t%p"]));
    let line = String::from_utf8(output.stdout).unwrap();
    let fields: Vec<&str> = line.trim_end().splitn(3, '\t').collect();
    let [correlation, content_type, payload] = fields[..] else { panic!("{line}") };
    assert_eq!((correlation, content_type), ("part 7", "application/json"));
    serde_json::from_str(payload).unwrap()
}

/// Returns once commands arrive.
async fn listening(broker: &Broker) -> Running {
    let running = Running::start(commanded(broker));
    let begun = Instant::now();
    while running.line.calls.lock().is_empty() {
        assert!(begun.elapsed() < PATIENCE, "{}", broker.log());
        output(with_expiry(&mut client("mosquitto_pub", broker, &json!({ "id": "probe", "command": "stop" }))));
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
    running
}

/// What the station was asked to do, without the probes.
fn calls(running: &Running) -> Vec<String> {
    running.line.calls.lock().iter().filter(|call| !call.starts_with("probe")).cloned().collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn commands_are_executed_and_answered_with_outcome_and_reason() {
    let broker = Broker::start();
    let running = listening(&broker).await;
    let inspect = |id: &str, serial: &str| json!({ "id": id, "command": "inspect", "serial": serial });
    let accepted = json!({
        "schema": "sheaf-answer/1", "id": "c-1", "accepted": true, "job_id": "job of S1", "repeated": false
    });
    assert_eq!(answer(&broker, &inspect("c-1", "S1")), accepted);
    let refused = json!({
        "schema": "sheaf-answer/1", "id": "c-2", "accepted": false, "reason": "not_found",
        "detail": "no recipe matches", "remedy": "name one", "pointer": null,
    });
    assert_eq!(answer(&broker, &inspect("c-2", UNKNOWN)), refused);
    for command in [
        json!({ "id": "c-3", "command": "abort", "command_id": "c-1" }),
        json!({ "id": "c-4", "command": "stop" }),
    ] {
        assert_eq!(answer(&broker, &command)["accepted"], true, "{command}");
    }
    let malformed = answer(&broker, &json!({ "id": "c-5", "command": "reset" }));
    assert_eq!((&malformed["id"], &malformed["reason"]), (&json!("c-5"), &json!("bad_request")), "{malformed}");
    let expected = ["c-1 inspect S1", &format!("c-2 inspect {UNKNOWN}"), "c-3 abort c-1", "c-4 stop"];
    assert_eq!(calls(&running), expected);
    running.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_service_obeys_a_command_or_names_what_is_wrong_with_it() {
    let (broker, folder) = (Broker::start(), tempfile::tempdir().unwrap());
    let subscriber = Subscriber::of(&broker);
    let door = crate::open(commanded(&broker)).unwrap();
    let config = AppConfig::simulated(folder.path().join("data"));
    let app = App::start(config, vec![door]).await.unwrap();
    let tasks = app.watch();
    // The door subscribes before it publishes.
    subscriber.until("/state", |arrived| !arrived.is_empty());
    let unknown = json!({ "id": "c-1", "command": "inspect", "serial": "S1", "recipe": "unknown" });
    let refused = answer(&broker, &unknown);
    assert_eq!((&refused["accepted"], &refused["pointer"]), (&json!(false), &json!("/recipe")), "{refused:#}");
    assert!(refused["detail"].is_string() && refused["remedy"].is_string(), "{refused:#}");
    assert!(!app.station.is_halted());
    let stopped = answer(&broker, &json!({ "id": "c-2", "command": "stop" }));
    assert_eq!(stopped, json!({ "schema": "sheaf-answer/1", "id": "c-2", "accepted": true }));
    assert!(app.station.is_halted());
    subscriber.until("/state", |arrived| arrived.last().is_some_and(|last| last.payload["state"] == "Halted"));
    app.shut_down().await;
    tasks.iter().for_each(tokio::task::JoinHandle::abort);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn retained_and_lasting_commands_are_not_executed() {
    let mut broker = Broker::start();
    let stop = |id: &str| json!({ "id": id, "command": "stop" });
    // Before the door is there, while it is there, and while it is away.
    output(with_expiry(&mut client("mosquitto_pub", &broker, &stop("early"))).arg("-r"));
    let running = listening(&broker).await;
    output(with_expiry(&mut client("mosquitto_pub", &broker, &stop("retained"))).arg("-r"));
    output(&mut client("mosquitto_pub", &broker, &stop("lasting")));
    assert_eq!(answer(&broker, &stop("first"))["accepted"], true);
    assert_eq!(calls(&running), ["first stop"]);
    running.crash().await;
    output(&mut client("mosquitto_pub", &broker, &stop("queued")));
    let running = listening(&broker).await;
    assert_eq!(answer(&broker, &stop("last"))["accepted"], true);
    assert_eq!(calls(&running), ["last stop"]);
    running.close().await;
    broker.stop();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_is_executed_unless_commands_are_on() {
    let broker = Broker::start();
    let subscriber = Subscriber::of(&broker);
    let running = Running::start(settings(&broker.url()));
    subscriber.until("/state", |arrived| !arrived.is_empty());
    output(with_expiry(&mut client("mosquitto_pub", &broker, &json!({ "id": "c-1", "command": "stop" }))));
    subscriber.until("/cmd", |arrived| !arrived.is_empty());
    // What is delivered afterwards would have been preceded by the command.
    running.deliver(&result(1)).await.unwrap();
    assert_eq!(calls(&running).len(), 0);
    running.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_answer_to_the_stations_own_topics_is_not_sent() {
    let broker = Broker::start();
    let subscriber = Subscriber::of(&broker);
    let running = listening(&broker).await;
    for topic in [TOPIC, "sheaf/station/state"] {
        let mut client = client("mosquitto_pub", &broker, &json!({ "id": "c-1", "command": "stop" }));
        output(with_expiry(&mut client).args(["-D", "publish", "response-topic", topic]));
    }
    assert_eq!(answer(&broker, &json!({ "id": "c-2", "command": "stop" }))["accepted"], true);
    let is_answer = |topic: &str| subscriber.on(topic).iter().any(|one| one.payload["schema"] == "sheaf-answer/1");
    subscriber.until(ANSWERS, |arrived| arrived.len() == 1);
    assert!(!is_answer("/cmd") && !is_answer("/state"));
    running.close().await;
}
