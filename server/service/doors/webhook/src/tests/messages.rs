//! What is sent.

use std::time::{SystemTime, UNIX_EPOCH};

use app::doors::Door;
use hmac::{Hmac, Mac};
use sha2::Sha256;

use super::receiver::{Receiver, Request, answer_with};
use super::{deliver, delivery, door};

fn now_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs()
}

#[tokio::test]
async fn an_event_is_posted_signed() {
    let receiver = Receiver::start(answer_with("204 No Content", ""));
    let before_s = now_s();
    deliver(&door(&format!("http://{}/hooks?line=2", receiver.address))).await.unwrap();
    let [request] = &receiver.requests()[..] else { panic!("{:?}", receiver.requests()) };
    assert_eq!(request.line, "POST /hooks?line=2 HTTP/1.1");
    assert_eq!(request.header("content-type"), "application/json");
    assert_eq!(request.header("user-agent"), format!("sheaf/{}", env!("CARGO_PKG_VERSION")));
    assert_eq!(request.header("host"), receiver.address.to_string());
    assert_eq!(request.header("webhook-id"), delivery().id());
    let message: serde_json::Value = serde_json::from_slice(&request.body).unwrap();
    assert_eq!(message, delivery().message());

    let timestamp_s = request.header("webhook-timestamp");
    assert!((before_s..=now_s()).contains(&timestamp_s.parse().unwrap()), "{timestamp_s}");
    let secret: Vec<u8> = (0..32).collect();
    assert_eq!(verified_by(request, &secret), [true]);
}

/// Which of the signatures of a request are made with this secret.
pub fn verified_by(request: &Request, secret: &[u8]) -> Vec<bool> {
    let signed = format!("{}.{}.", request.header("webhook-id"), request.header("webhook-timestamp"));
    let is_by = |signature: &str| {
        let mut mac = Hmac::<Sha256>::new_from_slice(secret).unwrap();
        mac.update(signed.as_bytes());
        mac.update(&request.body);
        let signature = signature.strip_prefix("v1,").unwrap();
        let bytes = base64::Engine::decode(&base64::engine::general_purpose::STANDARD, signature).unwrap();
        mac.verify_slice(&bytes).is_ok()
    };
    request.header("webhook-signature").split(' ').map(is_by).collect()
}

#[tokio::test]
async fn each_attempt_has_the_same_id_and_its_own_time() {
    let receiver = Receiver::start(answer_with("500 Internal Server Error", ""));
    let door = door(&format!("http://{}/", receiver.address));
    let first = loop {
        deliver(&door).await.unwrap_err();
        let requests = receiver.requests();
        if requests[0].header("webhook-timestamp") != requests[requests.len() - 1].header("webhook-timestamp") {
            break requests[0].clone();
        }
    };
    let last = receiver.requests().pop().unwrap();
    assert_eq!((first.header("webhook-id"), &first.body), (last.header("webhook-id"), &last.body));
    assert_ne!(first.header("webhook-signature"), last.header("webhook-signature"));
}

#[tokio::test]
async fn what_may_be_a_secret_is_not_shown() {
    let receiver = Receiver::start(answer_with("500 Internal Server Error", ""));
    let door = door(&format!("http://{}/hooks?key=abc", receiver.address));
    assert_eq!(door.target(), format!("http://{}/hooks", receiver.address));
    let refused = deliver(&door).await.unwrap_err();
    assert_eq!(refused.to_string(), "the receiver answered 500 Internal Server Error");
}
