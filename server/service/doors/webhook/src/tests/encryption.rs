//! Receivers with TLS.

use std::fs;
use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU16, Ordering};

use ureq::tls::{Certificate, RootCerts};

use super::messages::verified_by;
use super::receiver::Receiver;
use super::{deliver, open, settings, unreachable};
use crate::door::Webhook;
use crate::settings::Settings;

static PORT: AtomicU16 = AtomicU16::new(0);

/// Every name leads to the receiver of the test.
fn lookup(_: &str, _: u16) -> io::Result<Vec<SocketAddr>> {
    Ok(vec![([127, 0, 0, 1], PORT.load(Ordering::SeqCst)).into()])
}

fn door(url: &str, roots: RootCerts) -> Webhook {
    open(settings(url, &["127.0.0.1"]), lookup, roots)
}

#[tokio::test]
async fn a_certificate_must_be_trusted_and_for_this_host() {
    let (receiver, certificate) = Receiver::start_encrypted("mes.example");
    PORT.store(receiver.address.port(), Ordering::SeqCst);
    let trusting = || RootCerts::new_with_certs(&[Certificate::from_der(&certificate).to_owned()]);

    let reason = unreachable(&door("https://mes.example/", RootCerts::WebPki)).await;
    assert!(reason.starts_with("no secure connection to mes.example: "), "{reason}");
    let reason = unreachable(&door("https://erp.example/", trusting())).await;
    assert!(reason.starts_with("no secure connection to erp.example: "), "{reason}");
    assert!(receiver.requests().is_empty());

    deliver(&door("https://mes.example/", trusting())).await.unwrap();
    assert_eq!(receiver.requests().len(), 1);
}

/// As written into a file.
fn pem(certificate: &[u8]) -> String {
    let base64 = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, certificate);
    let lines: Vec<&str> = base64.as_bytes().chunks(64).map(|line| str::from_utf8(line).unwrap()).collect();
    format!("-----BEGIN CERTIFICATE-----\n{}\n-----END CERTIFICATE-----\n", lines.join("\n"))
}

#[tokio::test]
async fn the_plants_own_authority_vouches_and_a_secret_changes_without_a_gap() {
    let (receiver, authority) = Receiver::start_vouched("mes.example");
    let (_, strange) = Receiver::start_vouched("mes.example");
    PORT.store(receiver.address.port(), Ordering::SeqCst);
    let folder = tempfile::tempdir().unwrap();
    let [ca_file, secret_file] = ["ca.pem", "secret"].map(|name| folder.path().join(name));
    let (old, new) = ([1_u8; 32], [2_u8; 32]);
    let line = |secret: &[u8]| {
        format!("whsec_{}\n", base64::Engine::encode(&base64::engine::general_purpose::STANDARD, secret))
    };
    fs::write(&secret_file, line(&old)).unwrap();
    let private = |authority: &[u8]| {
        fs::write(&ca_file, pem(authority)).unwrap();
        let settings = settings("https://mes.example/", &["127.0.0.1"]);
        let settings = Settings { secret_file: secret_file.clone(), ca_file: Some(ca_file.clone()), ..settings };
        Webhook::new(settings, lookup, RootCerts::WebPki).unwrap()
    };
    let reason = unreachable(&private(&strange)).await;
    assert!(reason.starts_with("no secure connection to mes.example: "), "{reason}");

    let door = private(&authority);
    for secrets in [vec![old], vec![old, new], vec![new]] {
        fs::write(&secret_file, secrets.iter().map(|secret| line(secret)).collect::<String>()).unwrap();
        deliver(&door).await.unwrap();
        let request = receiver.requests().pop().unwrap();
        for secret in [old, new] {
            let expected: Vec<bool> = secrets.iter().map(|one| *one == secret).collect();
            assert_eq!(verified_by(&request, &secret), expected);
        }
    }
    assert_eq!(receiver.requests().len(), 3);
}

#[tokio::test]
async fn a_receiver_without_tls_gets_no_event() {
    let receiver = Receiver::start_speaking("220 mail.example ESMTP\r\n");
    PORT.store(receiver.address.port(), Ordering::SeqCst);
    let reason = unreachable(&door("https://mes.example/", RootCerts::WebPki)).await;
    assert!(reason.starts_with("no secure connection to mes.example: "), "{reason}");
}
