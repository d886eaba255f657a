//! TLS with a certificate of the plant's own authority.

use std::path::Path;
use std::process::Command;

use crate::tests::bench::{Running, result, settings, unreachable};
use crate::tests::broker::Broker;

/// Makes an authority and a certificate for `localhost` in the folder.
fn make_certificates(folder: &Path) {
    let openssl = |arguments: &str| {
        let made = Command::new("openssl").args(arguments.split(' ')).current_dir(folder).output();
        let made = made.expect("openssl is missing: install the Debian package openssl");
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    };
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes";
    openssl(&format!("req -x509 {key} -keyout ca.key -out ca.pem -days 2 -subj /CN=plant"));
    openssl(&format!("req {key} -keyout broker.key -out broker.csr -subj /CN=localhost"));
    std::fs::write(folder.join("names"), "subjectAltName=DNS:localhost\n").unwrap();
    openssl(
        "x509 -req -in broker.csr -CA ca.pem -CAkey ca.key -CAcreateserial -out broker.pem -days 2 -extfile names",
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_with_tls_is_used_if_its_certificate_leads_to_a_trusted_one() {
    let (folder, strange) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    make_certificates(folder.path());
    make_certificates(strange.path());
    let file = |name: &str| folder.path().join(name).display().to_string();
    let (certificate, key) = (file("broker.pem"), file("broker.key"));
    let ca_file = folder.path().join("ca.pem");
    let broker = Broker::start_in(folder, &format!("allow_anonymous true\ncertfile {certificate}\nkeyfile {key}"));
    let mut settings = settings(&format!("mqtts://localhost:{}", broker.port));
    settings.ca_file = Some(ca_file);
    let running = Running::start(settings.clone());
    running.deliver(&result(1)).await.unwrap();
    running.close().await;

    settings.ca_file = Some(strange.path().join("ca.pem"));
    let running = Running::start(settings.clone());
    let reason = unreachable(running.deliver(&result(2)).await);
    assert!(reason.contains("TLS failed") && reason.contains("certificate"), "{reason}");
    running.close().await;

    settings.url = broker.url();
    settings.ca_file = None;
    let running = Running::start(settings);
    unreachable(running.deliver(&result(3)).await);
    running.close().await;
}
