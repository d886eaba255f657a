//! Receivers with TLS.

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU16, Ordering};

use ureq::tls::{Certificate, RootCerts};

use super::receiver::Receiver;
use super::{deliver, open, settings, unreachable};
use crate::door::Webhook;

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

#[tokio::test]
async fn a_receiver_without_tls_gets_no_event() {
    let receiver = Receiver::start_speaking("220 mail.example ESMTP\r\n");
    PORT.store(receiver.address.port(), Ordering::SeqCst);
    let reason = unreachable(&door("https://mes.example/", RootCerts::WebPki)).await;
    assert!(reason.starts_with("no secure connection to mes.example: "), "{reason}");
}
