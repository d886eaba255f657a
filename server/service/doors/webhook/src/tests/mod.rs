//! The door against a receiver on this machine.

#![allow(clippy::unwrap_used)]

mod answers;
mod destinations;
mod encryption;
mod messages;
mod receiver;
mod settings;

use std::fs;
use std::time::{Duration, Instant};

use app::doors::{Delivery, Door, EventRecord, Undelivered};
use serde_json::json;
use ureq::tls::RootCerts;

use crate::door::Webhook;
use crate::resolver::{Lookup, system_lookup};
use crate::settings::Settings;

/// 32 bytes.
const SECRET: &str = "whsec_AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=";

/// Much longer than any attempt should take, much shorter than the time limit of a door.
const SOON: Duration = Duration::from_secs(10);

/// A door with a short time limit.
fn settings(url: &str, allowed: &[&str]) -> Settings {
    let allowed: Vec<_> = allowed.iter().map(|range| (*range).to_owned()).collect();
    let settings = json!({
        "name": "mes",
        "url": url,
        "secret_file": "/nowhere",
        "allowed_private": allowed,
        "timeout_s": 1,
    });
    serde_json::from_value(settings).unwrap()
}

fn open(settings: Settings, lookup: Lookup, roots: RootCerts) -> Webhook {
    let secret = tempfile::NamedTempFile::new().unwrap();
    fs::write(secret.path(), SECRET).unwrap();
    let settings = Settings { secret_file: secret.path().to_owned(), ..settings };
    Webhook::new(settings, lookup, roots).unwrap()
}

/// A door to a receiver on this machine, with time to answer.
fn door(url: &str) -> Webhook {
    let patient = Settings { timeout_s: 60, ..settings(url, &["127.0.0.1"]) };
    open(patient, system_lookup, RootCerts::WebPki)
}

fn delivery() -> Delivery {
    let event = EventRecord {
        seq: 12,
        kind: "scan.created".to_owned(),
        subject: "scan-7".to_owned(),
        body: json!({ "name": "Ä" }),
        at_ms: 1_764_172_350_123,
    };
    Delivery::new(event, None)
}

async fn deliver(door: &Webhook) -> Result<(), Undelivered> {
    door.deliver(&delivery()).await
}

/// The reason for which the receiver cannot be reached, within [`SOON`].
async fn unreachable(door: &Webhook) -> String {
    let start = Instant::now();
    let outcome = deliver(door).await;
    assert!(start.elapsed() < SOON, "{outcome:?} after {:?}", start.elapsed());
    let Err(Undelivered::Unreachable { reason, retry_after: None }) = outcome else { panic!("{outcome:?}") };
    assert!(!reason.contains(&SECRET["whsec_".len()..]), "{reason}");
    reason
}
