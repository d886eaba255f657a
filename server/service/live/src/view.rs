//! The thread `live`: extracts lines from the station's newest frame while there are viewers.

use std::io;
use std::sync::Arc;

use optics::Triangulator;
use scanning::label_frame;
use station::{SharedFrame, StationHandle, StationStatus};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};
use vision::{CentrelineExtractor, CentrelineParams, Centrelines, LineDirection};

use crate::pace::Pace;
use crate::worker::Worker;
use crate::{LiveBus, LiveFrame};

/// Starts the thread. It is idle without viewers, and during a scan, which publishes its own frames.
pub fn start(station: &StationHandle, bus: LiveBus, line_direction: LineDirection) -> io::Result<Worker> {
    let (frames, status) = (station.watch_frames(), station.watch_status());
    let params = CentrelineParams { line_direction, ..CentrelineParams::default() };
    Worker::spawn("live", move || look(frames, status, bus, params))
}

async fn look(
    mut frames: watch::Receiver<Option<SharedFrame>>,
    status: watch::Receiver<Arc<StationStatus>>,
    bus: LiveBus,
    params: CentrelineParams,
) {
    // Labelling uses rayon: on the shared pool a frame would wait for a calibration.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    if let Err(error) = &alone {
        tracing::warn!("the live view shares the threads of computations: {error}");
    }
    let mut demands = bus.watch_demands();
    let calibration = bus.watch_calibration();
    let mut pace = Pace::new(1.0, Instant::now());
    let mut extractor = CentrelineExtractor::default();
    loop {
        let Ok(rate_hz) =
            demands.wait_for(|demands| demands.any_rate_hz().is_some()).await.map(|demands| demands.any_rate_hz())
        else {
            return;
        };
        pace.set_rate(rate_hz.unwrap_or(1.0));
        if frames.changed().await.is_err() {
            return;
        }
        sleep_until(pace.opens()).await;
        let Some(frame) = frames.borrow_and_update().clone() else { continue };
        let shown_by_scan = status.borrow().job_id.is_some() && bus.scan_runs();
        if shown_by_scan || bus.watch_demands().borrow().any_rate_hz().is_none() {
            continue;
        }
        pace.pass(Instant::now());
        let calibration = calibration.borrow().clone();
        bus.show(Arc::new(process_frame(frame, calibration.as_deref(), &params, &mut extractor)));
    }
}

/// Finds the lines of a frame and, with a calibration, its profile. Without laser light there are no lines.
pub fn process_frame(
    frame: SharedFrame,
    triangulator: Option<&Triangulator>,
    params: &CentrelineParams,
    extractor: &mut CentrelineExtractor,
) -> LiveFrame {
    let mut centrelines = Centrelines::default();
    if frame.laser_on {
        extractor.find(&frame.image, params, &mut centrelines);
    }
    let fits = |triangulator: &&Triangulator| {
        let camera = &triangulator.calibration().camera;
        (camera.width_px, camera.height_px) == (frame.image.width(), frame.image.height())
    };
    let triangulator = triangulator.filter(fits);
    let labelled = |triangulator: &Triangulator| {
        label_frame(&centrelines, triangulator, triangulator.calibration().depth_range_mm)
    };
    let profile = triangulator.map(labelled);
    let calibration_id = triangulator.map(|triangulator| triangulator.calibration().id.as_str().into());
    LiveFrame { frame, centrelines, profile, calibration_id }
}
