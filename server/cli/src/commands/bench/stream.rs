//! `sheaf bench stream`: throughput of the live stream to many viewers, compared with bare TCP connections.
//!
//! The points of a scan are sent without rate limit, every message in order. They are encoded once and sent through the
//! accept loop, handshake and connections of the service; the bare connections carry the same bytes.

use std::fmt::Write as _;
use std::net::SocketAddr;
use std::sync::{Arc, Barrier};
use std::time::Instant;

use bytes::{BufMut as _, Bytes, BytesMut};
use live::LiveBus;
use live::protocol::points::{HEADER_BYTES, POINT_BYTES};
use nalgebra::Vector3;
use optics::{PointMm, StagePosition};
use scanning::synthetic::SyntheticScan;
use scanning::{Profile, ProfilePoint};
use serde_json::json;
use statistics::median;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpListener;
use vision::CentrelinePoint;

use crate::arguments::BenchStreamArgs;
use crate::commands::Answer;
use crate::commands::bench::server::viewer::Viewer;
use pipeline::Reporter;
use pipeline::{Failure, FailureKind};

/// Minimum number of bytes per round: a tenth of a second or more.
const ROUND_BYTES: usize = 200 << 20;
/// The scan whose points are sent.
const SCAN_ID: &str = "01890000-0000-7000-8000-000000000001";

/// Runs the benchmark.
pub fn stream(args: &BenchStreamArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let no_threads =
        |cause: std::io::Error| Failure::new(FailureKind::Internal, "no threads can be started").because(&cause);
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .thread_name("serve")
        .build()
        .map_err(no_threads)?;
    let (mut text, mut rows) = (String::new(), Vec::new());
    for &n_viewers in &args.viewers {
        reporter.note(&format!("{n_viewers} viewers"));
        let n_messages = (ROUND_BYTES / args.bytes.max(1) / n_viewers.max(1)).max(1);
        let served = runtime.block_on(serve(args.bytes, n_messages)).map_err(no_threads)?;
        let mb = (n_viewers * served.size_bytes) as f64 / 1e6;
        let mut speeds: Vec<[f64; 2]> = Vec::new();
        for _ in 0..args.rounds.max(1) {
            let round = |address, opens: fn(SocketAddr) -> std::io::Result<Viewer>| {
                round(address, n_viewers, n_messages, opens).map_err(no_threads)
            };
            let streamed_s = round(served.stream, Viewer::open)?;
            let bare_s = round(served.bare, Viewer::connect)?;
            speeds.push([mb / streamed_s, mb / bare_s]);
        }
        let middle = |of: fn(&[f64; 2]) -> f64| {
            median(&mut speeds.iter().map(of).collect::<Vec<f64>>()).unwrap_or(f64::NAN)
        };
        let (stream, bare, ratio) =
            (middle(|speed| speed[0]), middle(|speed| speed[1]), middle(|speed| speed[0] / speed[1]));
        let _ = writeln!(
            text,
            "{n_viewers} viewers, messages of {} bytes: {stream:.0} MB/s with the stream, {bare:.0} MB/s with bare TCP; ratio {ratio:.2}",
            served.size_bytes / n_messages
        );
        rows.push(json!({
            "viewers": n_viewers, "message_bytes": served.size_bytes / n_messages, "messages": n_messages,
            "rounds": speeds.len(), "stream_mb_s": stream, "bare_mb_s": bare, "ratio": ratio,
        }));
    }
    Ok(Answer::done(text, json!({ "subject": "stream", "rows": rows })))
}

/// Both servers; they run as long as the runtime.
struct Served {
    stream: SocketAddr,
    bare: SocketAddr,
    size_bytes: usize,
}

async fn serve(message_bytes: usize, n_messages: usize) -> std::io::Result<Served> {
    let bus = LiveBus::default();
    let messages = packed(&bus, message_bytes, n_messages);
    let size_bytes = messages.iter().map(Bytes::len).sum();
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let stream = listener.local_addr()?;
    tokio::spawn(http::serve_stream(listener, bus)?);
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let bare = listener.local_addr()?;
    tokio::spawn(write_bare(listener, messages.iter().map(framed).collect()));
    Ok(Served { stream, bare, size_bytes })
}

/// Encoded messages with points of a scan, each of about `message_bytes`.
fn packed(bus: &LiveBus, message_bytes: usize, n_messages: usize) -> Vec<Bytes> {
    let n_points = (message_bytes.saturating_sub(HEADER_BYTES) / POINT_BYTES).max(1);
    let point = |idx: usize| ProfilePoint {
        order: 0,
        hit_in_camera: PointMm::new(Vector3::new(idx as f64 * 0.1, 2.0, 400.0)),
        centreline: CentrelinePoint {
            u_px: idx as f64,
            v_px: 300.0,
            normal: [0.0, 1.0],
            sigma_px: 0.05,
            intensity: 99.0,
            width_px: 4.0,
            saturated: false,
        },
        noise_sigma_mm: 0.02,
    };
    let profile = Profile { points: (0..n_points).map(point).collect(), ..Profile::default() };
    let calibration = SyntheticScan::new(1, 1).calibration;
    bus.begin_scan(SCAN_ID);
    for idx in 0..n_messages {
        bus.add_profile_points(
            SCAN_ID,
            idx as u32,
            StagePosition::LinearMm(idx as f64 * 0.1),
            &profile,
            &calibration,
        );
    }
    bus.end_scan(SCAN_ID)
}

/// A message with its WebSocket frame header.
fn framed(message: &Bytes) -> Bytes {
    let mut frame = BytesMut::with_capacity(message.len() + 10);
    frame.put_u8(0x82);
    match message.len() {
        short @ 0..126 => frame.put_u8(short as u8),
        middle @ 126..65_536 => {
            frame.put_u8(126);
            frame.put_u16(middle as u16);
        }
        long => {
            frame.put_u8(127);
            frame.put_u64(long as u64);
        }
    }
    frame.put_slice(message);
    frame.freeze()
}

/// Writes all messages to each client after its first message.
async fn write_bare(listener: TcpListener, messages: Arc<[Bytes]>) {
    while let Ok((mut stream, _)) = listener.accept().await {
        let messages = messages.clone();
        tokio::spawn(async move {
            let _ = stream.set_nodelay(true);
            let mut asked = [0; 256];
            if !matches!(stream.read(&mut asked).await, Ok(1..)) {
                return;
            }
            for message in &*messages {
                if stream.write_all(message).await.is_err() {
                    return;
                }
            }
        });
    }
}

/// Seconds until all viewers, which start together, have received everything.
fn round(
    address: SocketAddr,
    n_viewers: usize,
    n_messages: usize,
    open: fn(SocketAddr) -> std::io::Result<Viewer>,
) -> std::io::Result<f64> {
    let barrier = Barrier::new(n_viewers + 1);
    let read = |mut viewer: Viewer| {
        barrier.wait();
        viewer.send_text(r#"{"op":"subscribe","streams":[{"stream":"points","from_block":0}]}"#)?;
        let mut n_read = 0;
        while n_read < n_messages {
            n_read += usize::from(viewer.next()?.0);
        }
        Ok::<(), std::io::Error>(())
    };
    let viewers = (0..n_viewers).map(|_| open(address)).collect::<std::io::Result<Vec<_>>>()?;
    std::thread::scope(|scope| {
        let read = &read;
        let threads: Vec<_> = viewers.into_iter().map(|viewer| scope.spawn(move || read(viewer))).collect();
        barrier.wait();
        let began = Instant::now();
        let ended: std::io::Result<Vec<()>> = threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect();
        ended.map(|_| began.elapsed().as_secs_f64())
    })
}
