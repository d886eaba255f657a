//! A scan of a part that passes on a belt, from triggers to a measured ball.

use std::sync::Arc;

use devices::CameraRequest;
use devices::conveyor::{ConveyorDriver, ConveyorSettings};
use metrology::PartVerdict;
use station::{Manual, StationDevices};
use store::ScanState;
use twin::TwinFault;
use twin::live::BELT_START_MM;

use super::bench::{Bench, from_station, run, shape};
use super::measured::sphere;
use crate::error::ErrorKind;
use crate::jobs::{JobEnd, ScanInput, ScanMode};
use crate::resources::scan_run::ScanSettings;

const PITCH_MM: f64 = 0.5;

fn belt() -> Bench {
    let settings = ConveyorSettings { pitch_mm: PITCH_MM, longest_mm: 100.0 };
    let stage = Arc::new(ConveyorDriver(settings));
    let bench = Bench::with(&shape(), |twin| StationDevices { stage, ..StationDevices::over(twin) });
    let fast = CameraRequest { frame_rate_hz: Some(60.0), ..CameraRequest::default() };
    bench.runtime.block_on(bench.station.manual(Manual::Configure(fast))).unwrap();
    bench
}

/// The ball passes the lines about as far after the first trigger as the belt starts before them.
fn ball() -> ScanInput {
    let range = (-BELT_START_MM - 8.0, -BELT_START_MM + 8.0);
    let mut input = from_station(range.0, range.1, PITCH_MM);
    (input.settings.mode, input.settings.step_mm) = (Some(ScanMode::Continuous), None);
    input.measure = vec![sphere(18.9)];
    input
}

#[test]
fn a_ball_that_passes_on_a_belt_is_measured() {
    let bench = belt();
    let id = bench.finish(run(ball(), &bench.job().ctx));
    let record = bench.record(&id);
    assert_eq!((record.state, bench.part(&id).verdict), (ScanState::Complete, Some(PartVerdict::Ok)));
    assert_eq!(record.report["losses"], serde_json::json!([]));
}

#[test]
fn a_frame_lost_on_a_belt_makes_the_scan_invalid_and_moves_no_point() {
    let bench = belt();
    let whole = bench.scan(ball());
    bench.operator.set_fault(TwinFault::LostFrames { every: 10 });
    let id = bench.finish(run(ball(), &bench.job().ctx));
    assert_eq!(bench.part(&id).verdict, Some(PartVerdict::Invalid));
    let record = bench.record(&id);
    assert!(record.report["losses"][0].as_str().unwrap().contains("frames were lost"), "{}", record.report);
    // The radius with the part of its uncertainty from the noise, and the scatter about the ball.
    let measured = |id: &str| {
        let result = bench.part(id).measured[0].result.clone();
        let number = |pointer: &str| result.pointer(pointer).and_then(serde_json::Value::as_f64).unwrap();
        [number("/value"), number("/u_noise"), number("/features/0/rms_mm")]
    };
    let [with_losses, without] = [measured(&id), measured(&whole.id)];
    assert!((with_losses[0] - without[0]).abs() < with_losses[1].hypot(without[1]), "{with_losses:?} {without:?}");
    // Points moved by one pitch would be half a millimetre off.
    assert!(with_losses[2] < 1.1 * without[2], "{with_losses:?} {without:?}");
}

#[test]
fn requests_that_need_the_belt_to_stop_are_refused_by_name() {
    let bench = belt();
    let refused = |input: ScanInput| match run(input, &bench.job().ctx) {
        Err(JobEnd::Failed(error)) => error,
        other => panic!("{other:?}"),
    };
    let with = |change: fn(&mut ScanSettings)| {
        let mut input = ball();
        change(&mut input.settings);
        refused(input)
    };
    let stopping = with(|settings| settings.mode = Some(ScanMode::StopAndGo));
    assert_eq!((stopping.kind, stopping.pointer.as_deref()), (ErrorKind::Impossible, Some("/mode")));
    assert!(stopping.detail.contains("not controlled here"), "{}", stopping.detail);
    let backwards = with(|settings| (settings.from_mm, settings.to_mm) = (Some(20.0), Some(10.0)));
    assert_eq!(backwards.pointer.as_deref(), Some("/to_mm"));
}
