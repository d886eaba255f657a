//! The points of a scan: streamed, requested and stored blocks are the same bytes.

use bytes::Bytes;
use live::LiveBus;
use nalgebra::{DMatrix, Vector3};
use optics::{Calibration, Camera, DepthRangeMm, LightSurfaces, PointMm, StageAxis, StagePosition};
use scanning::{Profile, ProfilePoint};
use serde_json::json;
use tokio_tungstenite::tungstenite::Message;
use vision::CentrelinePoint;

use super::bench::{Bench, Client};
use app::points_page::live_page;

const SCAN: &str = "01890a5d-ac96-774b-bcce-b302099a8057";
const NEXT_SCAN: &str = "01890a5d-ac96-774b-bcce-b302099a8058";

fn profile(frame: u32, n_points: usize) -> Profile {
    let centreline = CentrelinePoint {
        u_px: 5.0,
        v_px: 6.0,
        normal: [0.0, 1.0],
        sigma_px: 0.05,
        intensity: 99.0,
        width_px: 4.0,
        saturated: false,
    };
    let point = |idx: usize| ProfilePoint {
        order: 1,
        hit_in_camera: PointMm::new(Vector3::new(idx as f64, f64::from(frame), 400.0)),
        centreline,
        noise_sigma_mm: 0.003,
    };
    Profile { points: (0..n_points).map(point).collect(), ..Profile::default() }
}

fn scan(bus: &LiveBus, scan_id: &str, frames: std::ops::Range<u32>) {
    for frame in frames {
        // Every fifth frame shows nothing.
        let n_points = if frame % 5 == 4 { 0 } else { 400 };
        bus.add_profile_points(
            scan_id,
            frame,
            StagePosition::LinearMm(f64::from(frame)),
            &profile(frame, n_points),
            &calibration(),
        );
    }
}

/// A calibration with a stage; the rest of it is not used here.
fn calibration() -> Calibration {
    Calibration {
        id: "sample".into(),
        camera: Camera::from_opencv(64, 32, [[100.0, 0.0, 32.0], [0.0, 100.0, 16.0], [0.0, 0.0, 1.0]], &[0.0; 5]),
        orders: vec![1],
        light: LightSurfaces::Planes(Vec::new()),
        stage: Some(StageAxis::new(Vector3::new(0.0, 1.0, 0.0)).into()),
        depth_range_mm: DepthRangeMm { near_mm: 350.0, far_mm: 450.0 },
        covariance: DMatrix::zeros(0, 0),
    }
}

/// Blocks until the scan has ended, and the text that said so.
async fn until_end(client: &mut Client, scan_id: &str) -> (Vec<Bytes>, serde_json::Value) {
    let mut blocks = Vec::new();
    loop {
        match client.next().await {
            Message::Binary(block) => blocks.push(block),
            Message::Text(text) => {
                let text: serde_json::Value = serde_json::from_str(&text).unwrap();
                if text["op"] == "scan" && text["scan_id"] == scan_id && text["running"] == false {
                    return (blocks, text);
                }
            }
            _ => {}
        }
    }
}

#[tokio::test]
async fn requested_and_streamed_blocks_together_equal_the_stored_points() {
    let bench = Bench::start().await;
    bench.bus.begin_scan(SCAN);
    scan(&bench.bus, SCAN, 0..100);
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "points" })).await;
    let begun = client.text_of("scan").await;
    assert_eq!((begun["running"].as_bool(), begun["next_block"].as_u64()), (Some(true), Some(80)));
    let missed = live_page(&bench.bus, SCAN, 0).unwrap();
    assert!(!missed.complete);
    scan(&bench.bus, SCAN, 100..300);
    let stored = bench.bus.end_scan(SCAN);
    let (streamed, ended) = until_end(&mut client, SCAN).await;
    assert_eq!((ended["n_blocks"].as_u64(), stored.len()), (Some(240), 240));
    assert_eq!(missed.bytes, stored[..80].concat());
    assert_eq!(streamed, stored[80..]);
    assert!(live_page(&bench.bus, SCAN, 200).unwrap().complete);
}

#[tokio::test]
async fn a_client_that_reads_late_misses_no_block_of_two_scans() {
    let bench = Bench::start().await;
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "points" })).await;
    bench.bus.begin_scan(SCAN);
    scan(&bench.bus, SCAN, 0..1);
    let begun = client.text_of("scan").await;
    assert_eq!((begun["scan_id"].as_str(), begun["next_block"].as_u64()), (Some(SCAN), Some(0)));
    // More than the buffers of the connection hold, then the next scan: 5 kB a block.
    scan(&bench.bus, SCAN, 1..500);
    let first = bench.bus.end_scan(SCAN);
    bench.bus.begin_scan(NEXT_SCAN);
    scan(&bench.bus, NEXT_SCAN, 0..10);
    let second = bench.bus.end_scan(NEXT_SCAN);
    assert_eq!(until_end(&mut client, SCAN).await.0, first);
    assert_eq!(until_end(&mut client, NEXT_SCAN).await.0, second);
}

#[tokio::test]
async fn a_reconnected_client_resumes_where_it_was() {
    let bench = Bench::start().await;
    bench.bus.begin_scan(SCAN);
    scan(&bench.bus, SCAN, 0..10);
    let mut client = bench.client().await;
    client.subscribe(json!({ "stream": "points", "from_block": 3 })).await;
    let stored = bench.bus.end_scan(SCAN);
    assert_eq!(until_end(&mut client, SCAN).await.0, stored[3..]);
}
