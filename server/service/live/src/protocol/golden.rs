//! Sample messages, byte by byte: `tests/golden/ws/` is what the program writes and every client must read.
//!
//! The values are synthetic. With `SHEAF_WRITE_GOLDEN` set the files are written instead of compared; review the
//! difference before committing it, since it affects existing clients.

use std::path::PathBuf;

use optics::PointMm;
use scanning::{DropReason, Profile, ProfilePoint};
use serde_json::{Value, json};
use vision::{CentrelinePoint, LineDirection, Segment};

use crate::DisplayPoint;
use crate::jpeg::grey_jpeg;
use crate::protocol::header::{FrameStamp, PixelGrid};
use crate::protocol::image::{Brightness, ImageMessage};
use crate::protocol::profile::{ProfileMessage, calibration_mark};
use crate::protocol::text::{
    Command, DropCount, Limits, Misunderstanding, ServerText, StateChange, Stream, Subscription, parse,
};
use crate::protocol::{CLIENT_MESSAGES_PER_S, MAX_CLIENT_MESSAGE_BYTES, MAX_RATE_HZ, SUB_PROTOCOL, points};

const SCAN_ID: &str = "01890a5d-ac96-774b-bcce-b302099a8057";

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

/// The golden file, or in writing mode its new content.
fn golden(name: &str, now: &[u8]) -> Vec<u8> {
    let path = root().join("tests/golden/ws").join(name);
    if std::env::var_os("SHEAF_WRITE_GOLDEN").is_some() {
        std::fs::write(&path, now).unwrap();
    }
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn stamp() -> FrameStamp {
    FrameStamp {
        sequence: 4711,
        captured_at_ns: 12_345_678_901,
        position_mm: -7.25,
        laser_on: true,
        labelled: true,
    }
}

fn centreline_point(u_px: f64, v_px: f64, saturated: bool) -> CentrelinePoint {
    CentrelinePoint { u_px, v_px, normal: [0.0, 1.0], sigma_px: 0.05, intensity: 140.0, width_px: 4.0, saturated }
}

fn segments() -> Vec<Segment> {
    vec![
        Segment {
            points: vec![
                centreline_point(2.0, 5.25, false),
                centreline_point(3.0, 5.5, false),
                centreline_point(4.0, 5.75, false),
            ],
        },
        Segment { points: vec![centreline_point(9.0, 8.0, false), centreline_point(10.0, 8.125, false)] },
        Segment { points: vec![centreline_point(3.0, 30.0, false), centreline_point(4.0, 30.5, true)] },
    ]
}

fn image(jpeg: &[u8]) -> bytes::Bytes {
    let mut histogram = [0; 64];
    (histogram[0], histogram[35], histogram[63]) = (3000, 70, 2);
    ImageMessage {
        stamp: stamp(),
        grid: PixelGrid::of(64, 48),
        bit_depth: 8,
        scale: 4,
        exposure_us: 2000.0,
        brightness: Brightness { histogram, n_saturated: 2 },
        segments: &segments(),
        labels: &[Some(-1), None, Some(1)],
        jpeg_px: (16, 12),
        jpeg,
    }
    .encode(17)
}

fn sample_jpeg() -> Vec<u8> {
    let grey: Vec<u8> = (0..16 * 12).map(|idx| (idx % 16 * 16) as u8).collect();
    grey_jpeg(&grey, (16, 12), 80).unwrap()
}

fn profile() -> Profile {
    let point = |order, x, y, z, sigma, u, v| ProfilePoint {
        order,
        hit_in_camera: PointMm::new(nalgebra::Vector3::new(x, y, z)),
        centreline: centreline_point(u, v, false),
        noise_sigma_mm: sigma,
    };
    let mut profile = Profile {
        points: vec![
            point(-1, -20.5, -12.0, 401.25, 0.004, 2.0, 5.25),
            point(-1, -20.25, -12.0, 401.5, 0.004, 3.0, 5.5),
            point(0, 0.125, 0.5, 399.0, 0.003, 32.0, 24.5),
            point(1, 20.0, 12.5, 400.0, 0.005, 3.0, 30.0),
            point(1, 20.25, 12.5, 400.5, 0.005, 4.0, 30.5),
        ],
        labels: vec![Some(-1), None, Some(0), Some(1)],
        ..Profile::default()
    };
    profile.dropped.add_piece(DropReason::Doubtful, 2);
    profile
}

fn profile_message() -> bytes::Bytes {
    ProfileMessage {
        stamp: stamp(),
        grid: PixelGrid::of(64, 48),
        calibration: calibration_mark("sample"),
        line_direction: LineDirection::Rows,
        profile: &profile(),
    }
    .encode(18)
}

fn block() -> bytes::Bytes {
    let point = |x, y, z, order, sigma_mm| DisplayPoint {
        xyz_mm: [x, y, z],
        order,
        intensity: 140.0,
        sigma_mm,
        along_px: 33.0,
    };
    let points = [
        point(-1.0, 2.0, 400.0, -1, 0.004),
        point(1.0, 2.0, 401.0, 0, 0.0016),
        point(0.0, 2.0, 400.5, 1, f32::NAN),
    ];
    points::encode_block(SCAN_ID, 5, 6, -7.25, &points)
}

/// Reads numbers at offsets, as the tables of the specification name them.
struct At<'a>(&'a [u8]);

impl At<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        self.0[at..at + N].try_into().unwrap()
    }
    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.bytes(at))
    }
    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.bytes(at))
    }
    fn f32(&self, at: usize) -> f32 {
        f32::from_le_bytes(self.bytes(at))
    }
    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.bytes(at))
    }
    fn u64(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.bytes(at))
    }
    fn check_stamp(&self, opcode: u8, header_bytes: u16, number: u32) {
        assert_eq!((self.0[0], self.0[1]), (opcode, 3));
        assert_eq!((self.u16(2), self.u32(4)), (header_bytes, number));
        assert_eq!((self.u64(8), self.u64(16), self.f64(24)), (4711, 12_345_678_901, -7.25));
    }
}

#[test]
fn the_image_sample_is_written_byte_by_byte() {
    let now = image(&sample_jpeg());
    let golden = golden("image.bin", &now);
    let jpeg = &golden[320 + 3 * 8 + 7 * 4..];
    assert_eq!(image(jpeg), golden);
}

#[test]
fn the_image_sample_reads_by_the_table() {
    let golden = golden("image.bin", &image(&sample_jpeg()));
    let at = At(&golden);
    at.check_stamp(1, 320, 17);
    assert_eq!([32, 34, 36, 38].map(|offset| at.u16(offset)), [64, 48, 16, 12]);
    let (jpeg_bytes, lines, points) = (at.u32(40) as usize, at.u32(44) as usize, at.u32(48) as usize);
    assert_eq!((lines, points, at.u16(52), golden[54], golden[55]), (3, 7, 64, 4, 8));
    assert_eq!((at.f32(56), at.u32(60)), (2000.0, 2));
    assert_eq!([0, 35, 63, 1].map(|bin| at.u32(64 + 4 * bin)), [3000, 70, 2, 0]);
    let table =
        [0, 1, 2].map(|line| 320 + 8 * line).map(|row| (golden[row] as i8, golden[row + 1], at.u32(row + 4)));
    assert_eq!(table, [(-1, 0, 3), (-128, 0, 2), (1, 1, 2)]);
    let first = 320 + 8 * lines;
    let last = first + 4 * (points - 1);
    assert_eq!((at.u16(first), at.u16(first + 2)), (2 * 64, 5 * 64 + 16));
    assert_eq!((at.u16(last), at.u16(last + 2)), (4 * 64, 30 * 64 + 32));
    let jpeg = first + 4 * points;
    assert_eq!(golden.len(), jpeg + jpeg_bytes);
    let picture = image::load_from_memory(&golden[jpeg..]).unwrap();
    assert_eq!((picture.width(), picture.height()), (16, 12));
}

#[test]
fn the_profile_sample_is_written_byte_by_byte() {
    let now = profile_message();
    assert_eq!(golden("profile.bin", &now), now);
}

#[test]
fn the_profile_sample_reads_by_the_table() {
    let golden = golden("profile.bin", &profile_message());
    let at = At(&golden);
    at.check_stamp(2, 64, 18);
    assert_eq!(golden[32..40], calibration_mark("sample"));
    let (n, orders) = (at.u32(40) as usize, usize::from(at.u16(44)));
    assert_eq!((n, orders, golden[46], at.u32(48), at.u32(52)), (5, 3, 0, 2, 4));
    assert_eq!([56, 58, 60].map(|offset| at.u16(offset)), [64, 48, 64]);
    let rows = [0, 1, 2].map(|row| 64 + 12 * row).map(|row| (golden[row] as i8, at.u32(row + 4), at.u32(row + 8)));
    assert_eq!(rows, [(-1, 0, 2), (0, 2, 1), (1, 3, 2)]);
    let column = |idx: usize| 64 + 12 * orders + 4 * n * idx;
    assert_eq!([0, 1, 2, 3].map(|idx| at.f32(column(idx) + 4 * 2)), [0.125, 0.5, 399.0, 0.003]);
    assert_eq!((at.u16(column(4) + 4 * 2), at.u16(column(4) + 4 * 2 + 2)), (32 * 64, 24 * 64 + 32));
    assert_eq!(golden.len(), column(5));
}

#[test]
fn the_points_sample_is_written_byte_by_byte() {
    let now = block();
    assert_eq!(golden("points.bin", &now), now);
}

#[test]
fn the_points_sample_reads_by_the_table() {
    let golden = golden("points.bin", &block());
    let at = At(&golden);
    assert_eq!((golden[0], golden[1], at.u16(2), at.u32(4)), (3, 0, 64, 5));
    assert_eq!(uuid::Uuid::from_slice(&golden[8..24]).unwrap().to_string(), SCAN_ID);
    assert_eq!((at.f64(24), at.u32(32), at.u32(36)), (-7.25, 6, 3));
    let coordinate = |idx: usize, axis: usize| {
        at.f32(40 + 4 * axis) + f32::from(at.u16(64 + 12 * idx + 2 * axis)) * at.f32(52 + 4 * axis)
    };
    let positions = [0, 1, 2].map(|idx| [0, 1, 2].map(|axis| (coordinate(idx, axis) * 1000.0).round() / 1000.0));
    assert_eq!(positions, [[-1.0, 2.0, 400.0], [1.0, 2.0, 401.0], [0.0, 2.0, 400.5]]);
    let rest = [0, 1, 2].map(|idx| 64 + 12 * idx).map(|row| (golden[row + 8] as i8, golden[row + 9]));
    assert_eq!(rest, [(-1, 85), (0, 64), (1, 255)]);
    assert_eq!((at.u16(64 + 6), at.u16(64 + 10), golden.len()), (140, 33, 64 + 3 * 12));
}

/// Every text the server sends, in the order of the specification.
fn server_texts() -> Value {
    let station = json!({ "state": "Operational.Ready", "activity": "" });
    let job = json!({ "id": SCAN_ID, "kind": "scan", "state": "running", "progress": 0.25 });
    let subscription = |stream, max_rate_hz, scale| Subscription { stream, max_rate_hz, scale, from_block: None };
    let unknown = Misunderstanding {
        code: "unknown-op",
        detail: "unknown op `dance`; known are subscribe, unsubscribe, ping".into(),
        id: Some(3),
    };
    let texts = [
        ServerText::Hello {
            protocol: SUB_PROTOCOL,
            software_version: "0.1.0",
            clock_ms: Some(12_345.75),
            limits: Limits {
                max_rate_hz: MAX_RATE_HZ,
                max_client_message_bytes: MAX_CLIENT_MESSAGE_BYTES,
                client_messages_per_s: CLIENT_MESSAGES_PER_S,
            },
        },
        ServerText::Subscribed {
            id: Some(1),
            streams: vec![
                subscription(Stream::Image, Some(20.0), Some(2)),
                subscription(Stream::Points, None, None),
            ],
        },
        ServerText::Pong { id: Some(2), clock_ms: None },
        ServerText::Error(&unknown),
        ServerText::State {
            changes: vec![
                StateChange { number: 6, state: "Halted" },
                StateChange { number: 7, state: "Operational.Ready" },
            ],
            station: &station,
        },
        ServerText::Job { job: &job },
        ServerText::Event { seq: 1234 },
        ServerText::Scan { scan_id: SCAN_ID, running: true, n_blocks: 12, next_block: 12 },
        ServerText::Dropped {
            streams: vec![DropCount { stream: Stream::Image, offered: 100, sent: 60, by_rate: 38, too_slow: 2 }],
        },
    ];
    texts.iter().map(|text| serde_json::from_str::<Value>(&text.to_json()).unwrap()).collect()
}

#[test]
fn the_server_texts_are_written_byte_by_byte() {
    let now = server_texts();
    let golden = golden("server_texts.json", (serde_json::to_string_pretty(&now).unwrap() + "\n").as_bytes());
    assert_eq!(serde_json::from_slice::<Value>(&golden).unwrap(), now);
}

#[test]
fn the_client_texts_are_parsed() {
    let path = root().join("tests/golden/ws/client_texts.json");
    let texts: Vec<Value> = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let commands: Vec<_> = texts.iter().map(|text| parse(&text.to_string()).unwrap()).collect();
    let image = Subscription { stream: Stream::Image, max_rate_hz: Some(20.0), scale: Some(2), from_block: None };
    let points = Subscription { stream: Stream::Points, max_rate_hz: None, scale: None, from_block: Some(12) };
    assert_eq!(commands[0].command, Command::Subscribe(vec![image, points]));
    assert_eq!(commands[1].command, Command::Unsubscribe(vec![Stream::Image]));
    assert_eq!((commands[2].id, &commands[2].command), (Some(2), &Command::Ping));
}

#[test]
fn the_specification_shows_the_samples() {
    let specification = std::fs::read_to_string(root().join("openapi/stream.md")).unwrap();
    for (name, shown) in [("image.bin", 320 + 24 + 28), ("profile.bin", usize::MAX), ("points.bin", usize::MAX)] {
        let bytes = std::fs::read(root().join("tests/golden/ws").join(name)).unwrap();
        for (row, sixteen) in bytes[..shown.min(bytes.len())].chunks(16).enumerate() {
            let hex: Vec<String> = sixteen.iter().map(|byte| format!("{byte:02x}")).collect();
            let line = format!("{:04x}  {}", 16 * row, hex.join(" "));
            assert!(specification.contains(&line), "{name}: `{line}` is not in openapi/stream.md");
        }
    }
}
