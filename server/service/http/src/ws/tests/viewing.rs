//! What clients receive of frames and states.

use std::sync::Arc;

use live::StreamKind;
use serde_json::{Value, json};
use station::{MachineState, OperationalState};
use tokio_tungstenite::tungstenite::Message;

use super::bench::{Bench, Client, sequence};
use app::limits::CONTROL_LEASE;

const READY: MachineState = MachineState::Operational(OperationalState::Ready);

#[tokio::test]
async fn an_image_comes_with_the_lines_of_its_own_frame() {
    let bench = Bench::start().await;
    bench.show(5, 64);
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "image", "scale": 2 })).await;
    let message = client.binary_of(1).await;
    assert_eq!((sequence(&message), message[320] as i8), (5, 1));
    let jpeg = &message[320 + 8 + 8 * 4..];
    let picture = image::load_from_memory(jpeg).unwrap();
    assert_eq!((picture.width(), picture.height()), (32, 16));
    client.subscribe(json!({ "stream": "profile" })).await;
    assert_eq!(sequence(&client.binary_of(2).await), 5);
}

#[tokio::test]
async fn nothing_is_encoded_without_subscribers() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "profile" })).await;
    bench.show(1, 64);
    client.binary_of(2).await;
    assert_eq!(bench.streams.slots.of(StreamKind::Image { scale: 1 }).borrow().number, 0);
    assert_eq!(bench.streams.slots.of(StreamKind::Profile).borrow().number, 1);
}

#[tokio::test]
async fn a_frame_is_encoded_once_whatever_the_number_of_viewers() {
    const VIEWERS: usize = 10;
    const FRAMES: u64 = 5;
    for (stream, opcode, kind) in
        [("image", 1, StreamKind::Image { scale: 1 }), ("profile", 2, StreamKind::Profile)]
    {
        let bench = Bench::start().await;
        let mut clients = Vec::new();
        for _ in 0..VIEWERS {
            let mut client = bench.client().await;
            client.subscribe(json!({ "stream": stream, "max_rate_hz": 200 })).await;
            clients.push(client);
        }
        for frame in 1..=FRAMES {
            bench.show(frame, 64);
            let first = clients[0].binary_of(opcode).await;
            assert_eq!(sequence(&first), frame);
            for client in &mut clients[1..] {
                assert!(client.binary_of(opcode).await == first, "viewers were sent different bytes");
            }
        }
        let encoded = bench.streams.slots.of(kind).borrow().number;
        assert_eq!(encoded, FRAMES, "{stream}: messages made");
    }
}

/// Publishes frames until the client was offered `n` messages and got a `dropped` report: its counts, and the messages
/// received.
async fn watch(client: &mut Client, n: u64) -> (Value, u64) {
    let mut got = 0;
    loop {
        match client.next().await {
            Message::Binary(_) => got += 1,
            Message::Text(text) => {
                let text: Value = serde_json::from_str(&text).unwrap();
                if text["op"] == "dropped" && text["streams"][0]["offered"].as_u64() >= Some(n) {
                    return (text["streams"][0].clone(), got);
                }
            }
            _ => {}
        }
    }
}

#[tokio::test]
async fn two_clients_see_at_their_own_rates_and_the_counts_add_up() {
    let bench = Arc::new(Bench::start().await);
    let (mut fast, mut slow) = (bench.client().await, bench.client().await);
    fast.subscribe(json!({ "stream": "profile", "max_rate_hz": 200 })).await;
    slow.subscribe(json!({ "stream": "profile", "max_rate_hz": 4 })).await;
    let show = async {
        for frame in 1.. {
            bench.show(frame, 64);
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
        }
    };
    let seen = tokio::select! {
        seen = watch(&mut slow, 100) => seen,
        () = show => unreachable!("frames never end"),
        () = async { loop { fast.next().await; } } => unreachable!("the fast client never ends"),
    };
    let (count, got) = seen;
    let number = |name: &str| count[name].as_u64().unwrap();
    assert_eq!(number("sent"), got);
    assert_eq!(number("offered"), number("sent") + number("by_rate") + number("too_slow"));
    assert!(number("by_rate") > 50, "a rate of 4 out of some 200 Hz: {count}");
}

#[tokio::test]
async fn a_client_that_does_not_read_slows_no_other_and_gets_the_newest_frame_in_the_end() {
    let bench = Bench::start().await;
    let (mut lazy, mut keen) = (bench.client().await, bench.client().await);
    for client in [&mut lazy, &mut keen] {
        client.subscribe(json!({ "stream": "image", "max_rate_hz": 240 })).await;
    }
    // Pictures of noise, some 100 kB each: more than all buffers between server and client hold.
    const FRAMES: u64 = 120;
    for frame in 1..=FRAMES {
        bench.show(frame, 512);
        while sequence(&keen.binary_of(1).await) < frame {}
    }
    let mut taken = 0;
    loop {
        let message = lazy.binary_of(1).await;
        taken += 1;
        if sequence(&message) == FRAMES {
            break;
        }
    }
    assert!(taken < FRAMES / 2, "{taken} messages waited for a client that read nothing");
    bench.show(FRAMES + 1, 512);
    let dropped = lazy.text_of("dropped").await["streams"][0].clone();
    let number = |name: &str| dropped[name].as_u64().unwrap();
    assert!(number("too_slow") > FRAMES / 2, "{dropped}");
    assert_eq!(number("offered"), number("sent") + number("by_rate") + number("too_slow"));
}

#[tokio::test]
async fn every_change_of_state_arrives_in_order_and_the_newest_state_too() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "state", "max_rate_hz": 1 })).await;
    let mut changes = Vec::new();
    for _ in 0..100 {
        // Faster than any client: statuses between are never seen by the connection.
        [MachineState::Halted, READY].into_iter().for_each(|state| bench.enter(state));
        tokio::task::yield_now().await;
    }
    while changes.len() < 200 {
        let text = client.text_of("state").await;
        changes.extend(text["changes"].as_array().unwrap().clone());
        if changes.len() == 200 {
            assert_eq!(text["station"]["state"], "Operational.Ready");
        }
    }
    for (idx, change) in changes.iter().enumerate() {
        let state = if idx % 2 == 0 { "Halted" } else { "Operational.Ready" };
        assert_eq!(change, &json!({ "number": idx + 1, "state": state }));
    }
}

#[tokio::test]
async fn a_minor_change_is_sent_when_the_rate_allows_it() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "state", "max_rate_hz": 20 })).await;
    client.text_of("state").await;
    for position in 1..=50 {
        bench.status.send_modify(|status| Arc::make_mut(status).position_mm = Some(f64::from(position)));
    }
    let mut messages = 0;
    loop {
        messages += 1;
        if client.text_of("state").await["station"]["stage"]["position_mm"] == 50.0 {
            break;
        }
    }
    assert!(messages < 10, "{messages} messages for changes within a millisecond");
}

#[tokio::test]
async fn the_number_of_the_newest_event_comes_at_once_and_with_every_event() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "events" })).await;
    assert_eq!(client.text_of("event").await["seq"], 41);
    bench.events.send_replace(44);
    assert_eq!(client.text_of("event").await["seq"], 44);
}

#[tokio::test]
async fn the_clock_of_a_pong_is_the_clock_of_frames() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.say(json!({ "op": "ping", "id": 1 })).await;
    assert_eq!(client.text_of("pong").await["clock_ms"], Value::Null);
    bench.show(7, 64);
    client.say(json!({ "op": "ping", "id": 2 })).await;
    let clock_ms = client.text_of("pong").await["clock_ms"].as_f64().unwrap();
    // The frame was exposed at 7 ms of the synthetic clock, just now.
    assert!((7.0..7.0 + super::bench::PATIENCE.as_secs_f64() * 1e3).contains(&clock_ms), "{clock_ms}");
}

#[tokio::test]
async fn a_change_of_control_and_the_end_of_a_lease_are_sent_at_once() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "state", "max_rate_hz": 0.001 })).await;
    assert_eq!(client.text_of("state").await["station"]["control"], Value::Null);
    let taken = bench.control.take("Anna", false, std::time::Instant::now()).unwrap();
    let state = client.text_of("state").await;
    assert_eq!((&state["station"]["control"]["holder"], &state["changes"]), (&json!("Anna"), &json!([])));
    bench.control.give_back(Some(&taken.lease.id));
    assert_eq!(client.text_of("state").await["station"]["control"], Value::Null);
    // A lease that was taken almost five seconds ago and is not renewed.
    let almost = std::time::Instant::now() - CONTROL_LEASE + std::time::Duration::from_millis(200);
    bench.control.take("Ben", false, almost).unwrap();
    assert_eq!(client.text_of("state").await["station"]["control"]["holder"], "Ben");
    assert_eq!(client.text_of("state").await["station"]["control"], Value::Null);
}
