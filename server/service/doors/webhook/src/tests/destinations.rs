//! Where a door connects to.

use std::io;
use std::net::SocketAddr;
use std::process::Command;
use std::sync::atomic::{AtomicU16, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use ureq::tls::RootCerts;

use super::receiver::{Receiver, answer_with};
use super::{deliver, open, settings, unreachable};
use crate::resolver::{Lookup, system_lookup};

fn to_named(url: &str, allowed: &[&str], lookup: Lookup) -> crate::door::Webhook {
    open(settings(url, allowed), lookup, RootCerts::WebPki)
}

#[tokio::test]
async fn a_name_that_leads_to_this_machine_is_refused_unless_listed() {
    let receiver = Receiver::start(answer_with("204 No Content", ""));
    let port = receiver.address.port();
    let door = to_named(&format!("https://localhost:{port}/"), &[], system_lookup);
    let reason = unreachable(&door).await;
    assert!(reason.starts_with("localhost leads to ") && reason.contains("allowed_private"), "{reason}");
    assert_eq!(receiver.n_connections(), 0);

    let door = to_named(&format!("http://localhost:{port}/"), &["127.0.0.1", "::1"], system_lookup);
    deliver(&door).await.unwrap();
}

/// What a name server could return, all addresses but the last being public.
fn mixed(_: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
    let mut addresses: Vec<_> = (1..=20).map(|last| SocketAddr::from(([9, 9, 9, last], port))).collect();
    addresses.push(SocketAddr::from(([10, 0, 0, 1], port)));
    Ok(addresses)
}

#[tokio::test]
async fn one_address_that_is_not_public_is_enough_to_refuse_a_name() {
    let reason = unreachable(&to_named("https://mes.example/", &[], mixed)).await;
    assert!(reason.starts_with("mes.example leads to 10.0.0.1, which is not public"), "{reason}");
}

#[tokio::test]
async fn events_are_not_sent_unencrypted_to_public_addresses() {
    let reason = unreachable(&to_named("http://mes.example/", &["10.0.0.0/8"], mixed)).await;
    assert!(reason.starts_with("mes.example leads to 9.9.9.1, which is not in allowed_private"), "{reason}");
}

static PORT: AtomicU16 = AtomicU16::new(0);
static N_LOOKUPS: AtomicUsize = AtomicUsize::new(0);

/// The receiver of the test, then an address that is refused.
fn rebinding(host: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
    assert_eq!((host, port), ("mes.example", PORT.load(Ordering::SeqCst)));
    match N_LOOKUPS.fetch_add(1, Ordering::SeqCst) {
        0 => Ok(vec![([127, 0, 0, 1], port).into()]),
        _ => Ok(vec![([127, 0, 0, 2], port).into()]),
    }
}

#[tokio::test]
async fn the_checked_address_is_the_one_connected_to_and_each_attempt_asks_again() {
    let receiver = Receiver::start(answer_with("204 No Content", ""));
    let port = receiver.address.port();
    PORT.store(port, Ordering::SeqCst);
    let door = to_named(&format!("http://mes.example:{port}/"), &["127.0.0.1"], rebinding);
    deliver(&door).await.unwrap();
    assert_eq!(N_LOOKUPS.load(Ordering::SeqCst), 1);
    assert_eq!(receiver.requests()[0].header("host"), format!("mes.example:{port}"));
    let reason = unreachable(&door).await;
    assert!(reason.starts_with("mes.example leads to 127.0.0.2"), "{reason}");
    assert_eq!(receiver.n_connections(), 1);
}

#[tokio::test]
async fn a_name_that_cannot_be_resolved_is_waited_for() {
    let unknown: Lookup = |_, _| Err(io::Error::other("no such name"));
    let reason = unreachable(&to_named("https://mes.example/", &[], unknown)).await;
    assert_eq!(reason, "mes.example cannot be resolved: no such name");
    let empty: Lookup = |_, _| Ok(Vec::new());
    assert_eq!(unreachable(&to_named("https://mes.example/", &[], empty)).await, "mes.example has no address");
    let hanging: Lookup = |_, _| {
        thread::sleep(Duration::from_secs(3600));
        Ok(Vec::new())
    };
    let reason = unreachable(&to_named("https://mes.example/", &[], hanging)).await;
    assert_eq!(reason, "mes.example did not answer within 1 s");
}

#[test]
fn proxies_of_the_environment_are_ignored() {
    let proxy = "http://127.0.0.1:1";
    let variables = ["ALL_PROXY", "HTTP_PROXY", "HTTPS_PROXY", "all_proxy", "http_proxy", "https_proxy"];
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "tests::messages::an_event_is_posted_signed"])
        .envs(variables.map(|variable| (variable, proxy)))
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("1 passed"), "{text}");
}
