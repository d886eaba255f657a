//! A sensor with hot pixels and its dark frame: frames of the station are corrected, but only those to which it
//! applies.

use std::sync::Arc;

use devices::{CameraRequest, Roi, Trigger};
use twin::{SceneKind, StationModel, StationShape, TwinFault, TwinOptions, TwinStation};
use vision::{CentrelineParams, CentrelinePoint, DarkFrameAccumulator, LineDirection, find_centrelines};

use super::bench::{Bench, bench_of, never_cancelled};
use crate::{CameraDarkFrame, CameraName, DarkFrameUse, StationDevices};

const DEFECTS: TwinFault = TwinFault::SensorDefects { levels: 10.0 };

fn plate() -> Bench {
    let shape = StationShape { width_px: 320, height_px: 256, ..StationShape::default() };
    let options = TwinOptions { scene: SceneKind::Plate, ..TwinOptions::default() };
    let bench =
        bench_of(StationDevices::over(TwinStation::new(StationModel::seeded(7, &shape).unwrap(), options)));
    bench.wait_for("ready", |status| status.activity == "ready");
    bench
}

impl Bench {
    /// The station's dark frame, from frames with the lens covered.
    fn dark_frame(&self) -> Arc<CameraDarkFrame> {
        self.control.set_fault(TwinFault::LensCovered);
        let status = self.station.status();
        let lease = self.lease();
        lease.configure(&software()).unwrap();
        let mut frames = DarkFrameAccumulator::default();
        (0..16).for_each(|_| frames.add(&lease.grab(&never_cancelled()).unwrap().image).unwrap());
        self.control.clear_fault(TwinFault::LensCovered.name());
        Arc::new(CameraDarkFrame {
            frame: frames.finish().unwrap(),
            camera: CameraName::of(&status.camera.identity),
            roi: status.camera_settings.roi,
            gain_db: 0.0,
            exposure_us: 700.0,
            line_direction: LineDirection::Rows,
            taken_at_ms: 7,
        })
    }

    /// Points on the laser lines of one frame.
    fn points(&self) -> Vec<CentrelinePoint> {
        let lease = self.lease();
        lease.configure(&software()).unwrap();
        lease.laser_on(1.0).unwrap();
        let image = &lease.grab(&never_cancelled()).unwrap().image;
        let found = find_centrelines(image, &CentrelineParams::default());
        found.segments.into_iter().flat_map(|segment| segment.points).collect()
    }
}

fn software() -> CameraRequest {
    CameraRequest { exposure_us: Some(700.0), trigger: Some(Trigger::Software), ..CameraRequest::default() }
}

/// Points of `found` far from every point of `reference` (the end of a line may be detected a few columns further in
/// one frame than in another), and the root mean square distance of those in the same column in their common standard
/// deviation.
fn compared(found: &[CentrelinePoint], reference: &[CentrelinePoint]) -> (usize, f64) {
    const COLUMNS: f64 = 5.0;
    let (mut n_false, mut squares, mut n) = (0, 0.0, 0.0);
    for point in found {
        let off = |other: &&CentrelinePoint| ((other.u_px - point.u_px).abs(), (other.v_px - point.v_px).abs());
        let near = |other: &&CentrelinePoint| off(other).0 <= COLUMNS && off(other).1 < 2.0;
        n_false += usize::from(!reference.iter().any(|other| near(&other)));
        if let Some(other) = reference.iter().find(|other| off(other).0 < 0.5 && off(other).1 < 1.0) {
            squares += ((other.v_px - point.v_px) / other.sigma_px.hypot(point.sigma_px)).powi(2);
            n += 1.0;
        }
    }
    (n_false, f64::sqrt(squares / n))
}

#[test]
fn a_sensor_with_hot_pixels_gives_false_points_and_its_dark_frame_removes_them() {
    let bench = plate();
    let reference = bench.points();
    bench.control.set_fault(DEFECTS);
    let (n_false, _) = compared(&bench.points(), &reference);
    assert!(n_false > 300, "{n_false} false points of {} without a dark frame", reference.len());
    let dark = bench.dark_frame();
    bench.station.set_dark_frame(Some(dark));
    let corrected = bench.points();
    let (n_false, between) = compared(&corrected, &reference);
    assert_eq!(n_false, 0, "of {}", corrected.len());
    assert!(corrected.len() as f64 > 0.98 * reference.len() as f64, "{} of {}", corrected.len(), reference.len());
    // Both have the same noise, so that this is what the correction adds.
    assert!(between < 0.25, "{between:.2} sigma");
    bench.station.set_dark_frame(None);
    assert!(compared(&bench.points(), &reference).0 > 300);
}

#[test]
fn a_dark_frame_is_used_only_where_it_applies() {
    let bench = plate();
    assert_eq!(bench.station.status().dark_frame_use, DarkFrameUse::NoDarkFrame);
    let dark = bench.dark_frame();
    bench.station.set_dark_frame(Some(dark.clone()));
    bench.wait_for("used", |status| status.dark_frame_use == DarkFrameUse::Full);
    let frame = bench.lease().grab(&never_cancelled()).unwrap();
    let applied = frame.dark_frame.as_ref().unwrap();
    assert_eq!((applied.used, applied.dark.taken_at_ms), (DarkFrameUse::Full, 7));
    let status = bench.station.status();
    let settings = status.camera_settings;
    let used = |camera: &devices::DeviceIdentity, settings| dark.use_for(camera, &settings);
    let region = Roi { left_px: 10, top_px: 20, width_px: 100, height_px: 50 };
    let identity = &status.camera.identity;
    assert_eq!(used(identity, devices::CameraSettings { roi: region, ..settings }), DarkFrameUse::Full);
    assert_eq!(used(identity, devices::CameraSettings { gain_db: 3.0, ..settings }), DarkFrameUse::HotPixels);
    let wide = devices::CameraSettings { pixel_format: devices::PixelFormat::Mono16, ..settings };
    assert_eq!(used(identity, wide), DarkFrameUse::OtherFormat);
    let beyond = Roi { left_px: 300, ..region };
    assert_eq!(used(identity, devices::CameraSettings { roi: beyond, ..settings }), DarkFrameUse::OtherFormat);
    let other = devices::DeviceIdentity { serial: "8".to_owned(), ..identity.clone() };
    assert_eq!(used(&other, settings), DarkFrameUse::OtherCamera);
}
