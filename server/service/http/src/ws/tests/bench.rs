//! A stream without a station, and clients for it.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::State;
use axum::routing::any;
use futures_util::{SinkExt, StreamExt};
use live::worker::Worker;
use live::{LiveBus, LiveFrame};
use serde_json::{Value, json};
use station::{MachineState, SharedFrame, StampedFrame, StationStatus};
use tokio::net::{TcpSocket, TcpStream};
use tokio::sync::watch;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, client_async};
use vision::{CentrelinePoint, Centrelines, GreyImage, LineDirection, Pixels, Segment};

use crate::ws::alone::NoStation;
use crate::ws::streams::{Sources, Streams};
use crate::ws::tests::status::first_status;
use app::jobs::JobNews;
use app::lease::ControlDesk;
use tokio_util::sync::CancellationToken;

/// Timeout for messages that are expected immediately.
pub const PATIENCE: Duration = Duration::from_secs(20);

/// A live stream whose sources the test controls.
pub struct Bench {
    pub bus: LiveBus,
    pub frames: watch::Sender<Option<SharedFrame>>,
    pub status: watch::Sender<Arc<StationStatus>>,
    pub control: ControlDesk,
    /// Held so that the stream does not end.
    pub _jobs: watch::Sender<JobNews>,
    pub events: watch::Sender<i64>,
    pub streams: Streams,
    pub closing: CancellationToken,
    pub address: SocketAddr,
    _encoder: Worker,
    server: tokio::task::JoinHandle<()>,
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.server.abort();
    }
}

impl Bench {
    pub async fn start() -> Self {
        let bus = LiveBus::default();
        let frames = watch::Sender::new(None);
        let status = watch::Sender::new(Arc::new(first_status()));
        let (jobs, events) = (watch::Sender::new(JobNews::default()), watch::Sender::new(41));
        let control = ControlDesk::default();
        let sources = Sources {
            live: bus.clone(),
            frames: frames.subscribe(),
            status: status.subscribe(),
            control: control.watch(),
            jobs: jobs.subscribe(),
            events: events.subscribe(),
        };
        let closing = CancellationToken::new();
        let (streams, encoder) = Streams::start(sources, LineDirection::Rows, closing.clone()).unwrap();
        let socket = TcpSocket::new_v4().unwrap();
        // Inherited by accepted sockets: little is buffered for a client that does not read.
        socket.set_send_buffer_size(16 * 1024).unwrap();
        socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let listener = socket.listen(1024).unwrap();
        let address = listener.local_addr().unwrap();
        let accept =
            any(|State(streams): State<Streams>, upgrade| async move { streams.accept(upgrade, NoStation) });
        let router = Router::new().route("/api/v1/stream", accept).with_state(streams.clone());
        let server = tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
        Self {
            bus,
            frames,
            status,
            control,
            _jobs: jobs,
            events,
            streams,
            closing,
            address,
            _encoder: encoder,
            server,
        }
    }

    /// Publishes a frame of `width` × `width` / 2 noisy pixels with one line in it.
    pub fn show(&self, sequence: u64, width: usize) {
        let height = width / 2;
        let noise = |idx: usize| (idx as u32).wrapping_mul(2_654_435_761).wrapping_add(sequence as u32 * 97) >> 24;
        let pixels = (0..width * height).map(|idx| noise(idx) as u8).collect();
        let image = GreyImage::new(width, height, Pixels::Eight(pixels)).unwrap();
        let frame = Arc::new(StampedFrame::detached(sequence, sequence as f64 * 0.5, image));
        let point = |idx: usize| CentrelinePoint {
            u_px: idx as f64,
            v_px: 3.0 + idx as f64 * 0.25,
            normal: [0.0, 1.0],
            sigma_px: 0.05,
            intensity: 99.0,
            width_px: 4.0,
            saturated: false,
        };
        let segments = vec![Segment { points: (0..8).map(point).collect() }];
        let centrelines = Centrelines { segments, correlation_px: 2.0, ..Default::default() };
        self.frames.send_replace(Some(frame.clone()));
        self.bus.show(Arc::new(LiveFrame {
            frame,
            centrelines,
            profile: Some(scanning::Profile { labels: vec![Some(1)], ..Default::default() }),
            calibration_id: Some("sample".into()),
        }));
    }

    /// Enters a state.
    pub fn enter(&self, state: MachineState) {
        self.status.send_modify(|status| {
            let status = Arc::make_mut(status);
            status.state = state;
            status.state_history.enter(state);
        });
    }

    /// A client that has read the greeting.
    pub async fn client(&self) -> Client {
        let mut client = self.silent_client("sheaf.v1").await.unwrap();
        assert_eq!(client.text().await["op"], "hello");
        client
    }

    /// A client with a small receive buffer, straight after the handshake.
    pub async fn silent_client(&self, protocol: &str) -> Result<Client, Error> {
        let socket = TcpSocket::new_v4().unwrap();
        socket.set_recv_buffer_size(16 * 1024).unwrap();
        let stream = socket.connect(self.address).await.unwrap();
        let mut request = format!("ws://{}/api/v1/stream", self.address).into_client_request()?;
        request.headers_mut().insert("Sec-WebSocket-Protocol", protocol.parse().unwrap());
        let (socket, _) = client_async(request, stream).await?;
        Ok(Client { socket })
    }
}

/// A client.
pub struct Client {
    pub socket: WebSocketStream<TcpStream>,
}

impl Client {
    pub async fn say(&mut self, text: Value) {
        self.socket.send(Message::text(text.to_string())).await.unwrap();
    }

    /// Subscribes to one stream and waits for the answer.
    pub async fn subscribe(&mut self, subscription: Value) {
        self.say(json!({ "op": "subscribe", "streams": [subscription] })).await;
        let answer = self.text_of("subscribed").await;
        assert!(
            answer["streams"].as_array().unwrap().iter().any(|known| known["stream"] == subscription["stream"])
        );
    }

    /// The next text or binary message.
    pub async fn next(&mut self) -> Message {
        loop {
            let message = timeout(PATIENCE, self.socket.next()).await.expect("nothing came").unwrap().unwrap();
            if matches!(message, Message::Text(_) | Message::Binary(_)) {
                return message;
            }
        }
    }

    /// The next message, which is text.
    pub async fn text(&mut self) -> Value {
        serde_json::from_str(self.next().await.to_text().unwrap()).unwrap()
    }

    /// The next text with that `op`; what comes before is skipped.
    pub async fn text_of(&mut self, op: &str) -> Value {
        loop {
            if let Message::Text(text) = self.next().await {
                let text: Value = serde_json::from_str(&text).unwrap();
                if text["op"] == op {
                    return text;
                }
            }
        }
    }

    /// The next binary message with that opcode; what comes before is skipped.
    pub async fn binary_of(&mut self, opcode: u8) -> Vec<u8> {
        loop {
            if let Message::Binary(bytes) = self.next().await
                && bytes[0] == opcode
            {
                return bytes.to_vec();
            }
        }
    }

    /// The code the server closes with; what comes before is skipped.
    pub async fn close_code(&mut self) -> u16 {
        loop {
            match timeout(PATIENCE, self.socket.next()).await.expect("the server did not close") {
                Some(Ok(Message::Close(Some(frame)))) => return frame.code.into(),
                Some(Ok(_)) => {}
                end => panic!("the connection ended without a code: {end:?}"),
            }
        }
    }
}

/// Sequence of a frame's message.
pub fn sequence(message: &[u8]) -> u64 {
    u64::from_le_bytes(message[8..16].try_into().unwrap())
}
