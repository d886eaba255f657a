//! `mosquitto_sub`: an MQTT client by another author than the door's.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use serde_json::Value;

use crate::tests::broker::{Broker, PATIENCE, program};

/// A message as it arrived.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrived {
    pub topic: String,
    /// Retained earlier, and sent because of the subscription.
    pub retained: bool,
    pub qos: u8,
    pub expiry_s: Option<u32>,
    pub content_type: String,
    pub payload: Value,
}

/// Prints what arrives; ends with its value.
pub struct Subscriber {
    process: Child,
    arrived: Arc<Mutex<Vec<Arrived>>>,
}

impl Subscriber {
    /// Of everything, with a session that outlives its connection; subscribed once this returns.
    pub fn of(broker: &Broker) -> Self {
        Self::start(broker, "subscriber", &[])
    }

    /// Beside another one.
    pub fn late(broker: &Broker) -> Self {
        Self::start(broker, "late", &[])
    }

    /// With arguments that name the user.
    pub fn with_login(broker: &Broker, login: &[&str]) -> Self {
        Self::start(broker, "subscriber", login)
    }

    fn start(broker: &Broker, id: &str, login: &[&str]) -> Self {
        let mut command = Command::new(program("mosquitto_sub"));
        command.args(["-V", "mqttv5", "-h", "127.0.0.1", "-p", &broker.port.to_string()]);
        command.args(["-i", id, "-c", "-x", "3600", "-q", "1", "-t", "#"]);
        command.args(["-F", "%t\t%r\t%q\t%E\t%C\t%p"]).args(login);
        let mut process = command.stdout(Stdio::piped()).stderr(Stdio::inherit()).spawn().unwrap();
        let lines = BufReader::new(process.stdout.take().unwrap()).lines();
        let arrived = Arc::<Mutex<Vec<_>>>::default();
        let arriving = arrived.clone();
        // Ends with the process.
        std::thread::spawn(move || {
            lines.map_while(Result::ok).for_each(|line| arriving.lock().push(parse(&line)));
        });
        let subscriber = Self { process, arrived };
        subscriber.ready(broker, login);
        subscriber
    }

    /// Waits until a message of another client arrives.
    pub fn ready(&self, broker: &Broker, login: &[&str]) {
        let before = self.probes();
        let begun = Instant::now();
        while self.probes() == before {
            assert!(begun.elapsed() < PATIENCE, "nothing arrives; {}", broker.log());
            let status = Command::new(program("mosquitto_pub"))
                .args(["-V", "mqttv5", "-h", "127.0.0.1", "-p", &broker.port.to_string()])
                .args(["-t", "probe", "-m", "1"])
                .args(login)
                .stderr(Stdio::null())
                .status();
            status.unwrap();
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    fn probes(&self) -> usize {
        self.arrived.lock().iter().filter(|one| one.topic == "probe").count()
    }

    /// What has arrived so far on topics that end so.
    pub fn on(&self, topic: &str) -> Vec<Arrived> {
        self.arrived.lock().iter().filter(|one| one.topic.ends_with(topic)).cloned().collect()
    }

    /// Waits until enough has arrived on topics that end so.
    pub fn until(&self, topic: &str, is_enough: impl Fn(&[Arrived]) -> bool) -> Vec<Arrived> {
        let begun = Instant::now();
        loop {
            let arrived = self.on(topic);
            if is_enough(&arrived) {
                return arrived;
            }
            assert!(begun.elapsed() < PATIENCE, "{} arrived on {topic}: {arrived:?}", arrived.len());
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Subscriber {
    fn drop(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

fn parse(line: &str) -> Arrived {
    let fields: Vec<&str> = line.splitn(6, '\t').collect();
    let [topic, retained, qos, expiry_s, content_type, payload] = fields[..] else { panic!("{line}") };
    Arrived {
        topic: topic.to_owned(),
        retained: retained == "1",
        qos: qos.parse().unwrap(),
        expiry_s: expiry_s.parse().ok(),
        content_type: content_type.to_owned(),
        payload: serde_json::from_str(payload).unwrap(),
    }
}
