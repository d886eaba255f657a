//! Clients that break the rules are disconnected with a reason.

use serde_json::json;
use tokio_tungstenite::tungstenite::{Error, Message};

use super::bench::Bench;
use futures_util::SinkExt;
use live::protocol::{CLIENT_MESSAGE_BURST, MAX_CLIENT_MESSAGE_BYTES, MAX_SOCKETS};

#[tokio::test]
async fn another_sub_protocol_is_refused_with_a_problem() {
    let bench = Bench::start().await;
    let Err(Error::Http(response)) = bench.silent_client("sheaf.v2").await else { panic!("it was accepted") };
    assert_eq!(response.status(), 400);
    assert_eq!(response.headers()["content-type"], "application/problem+json");
}

#[tokio::test]
async fn an_invalid_message_gets_an_error_and_changes_nothing() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "events" })).await;
    client.say(json!({ "op": "dance", "id": 7 })).await;
    let error = client.text_of("error").await;
    assert_eq!((error["code"].as_str(), error["id"].as_u64()), (Some("unknown-op"), Some(7)));
    let streams = json!([{ "stream": "image" }, { "stream": "profile", "max_rate_hz": -1 }]);
    client.say(json!({ "op": "subscribe", "streams": streams })).await;
    assert_eq!(client.text_of("error").await["code"], "bad-subscription");
    client.say(json!({ "op": "unsubscribe", "streams": ["events"], "id": 8 })).await;
    assert_eq!(client.text_of("subscribed").await, json!({ "op": "subscribed", "id": 8, "streams": [] }));
}

#[tokio::test]
async fn a_long_message_closes_with_too_big() {
    let mut client = Bench::start().await.client().await;
    client.say(json!({ "op": "ping", "x": "x".repeat(MAX_CLIENT_MESSAGE_BYTES) })).await;
    assert_eq!(client.close_code().await, 1009);
}

#[tokio::test]
async fn a_binary_message_closes_with_unsupported() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.socket.send(Message::binary(vec![1, 2, 3])).await.unwrap();
    assert_eq!(client.close_code().await, 1003);
}

#[tokio::test]
async fn too_many_messages_close_with_policy() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    for _ in 0..3 * CLIENT_MESSAGE_BURST as usize {
        if client.socket.send(Message::text(r#"{"op":"ping"}"#)).await.is_err() {
            break;
        }
    }
    assert_eq!(client.close_code().await, 1008);
}

#[tokio::test]
async fn a_socket_above_the_limit_is_refused_until_another_closes() {
    let bench = Bench::start().await;
    let mut clients = Vec::new();
    for _ in 0..MAX_SOCKETS {
        clients.push(bench.client().await);
    }
    let Err(Error::Http(response)) = bench.silent_client("sheaf.v1").await else { panic!("it was accepted") };
    assert_eq!((response.status().as_u16(), response.headers()["retry-after"].to_str().unwrap()), (503, "5"));
    clients.pop().unwrap().socket.close(None).await.unwrap();
    while bench.streams.n_sockets() == MAX_SOCKETS {
        tokio::task::yield_now().await;
    }
    bench.client().await;
}

#[tokio::test]
async fn a_server_shutdown_closes_with_going_away() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    bench.closing.cancel();
    assert_eq!(client.close_code().await, 1001);
}
