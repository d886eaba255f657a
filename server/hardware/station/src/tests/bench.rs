//! A small simulated station with its thread, ended when the test ends.

use std::time::Duration;

use devices::contract::Stopwatch;
use twin::{SceneKind, StationModel, StationShape, TwinControl, TwinOptions, TwinStation};

use crate::shared::cancel::CancelFlag;
use crate::station_thread::handle::Watch;
use crate::{
    Manual, Purpose, StationDevices, StationHandle, StationLease, StationRefusal, StationStatus, StopEpoch,
};

/// Longest wait of a test for an expected event; far beyond every promised time.
pub const WAIT_LIMIT: Duration = Duration::from_secs(10);

/// A station under test.
pub struct Bench {
    /// The station.
    pub station: StationHandle,
    /// Control of the simulation.
    pub control: TwinControl,
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.station.shut_down();
    }
}

/// A simulated station with few pixels.
pub fn small_twin(options: TwinOptions) -> TwinStation {
    let shape = StationShape { width_px: 160, height_px: 128, ..StationShape::default() };
    TwinStation::new(StationModel::seeded(7, &shape).unwrap(), options)
}

/// Devices of a small simulated station with a bare plate.
pub fn small_devices() -> StationDevices {
    StationDevices::over(small_twin(TwinOptions { scene: SceneKind::Plate, ..TwinOptions::default() }))
}

/// A calibrated station with these devices.
pub fn bench_of(devices: StationDevices) -> Bench {
    bench_with(devices, Watch::default(), false)
}

/// As [`bench_of`], with the times of an unwatched live view, stopped in an earlier process or not.
pub fn bench_with(devices: StationDevices, watch: Watch, halted: bool) -> Bench {
    let control = devices.twin.as_ref().and_then(|twin| twin.control()).expect("the camera is simulated");
    let station = StationHandle::start_with(devices, watch, halted);
    station.calibration_changed(true);
    Bench { station, control }
}

/// A small simulated station, ready.
pub fn bench() -> Bench {
    let bench = bench_of(small_devices());
    bench.wait_for("ready", |status| status.activity == "ready");
    bench
}

impl Bench {
    /// Waits until the status fulfils a condition; panics with the last status otherwise. Returns the time this took
    /// without pauses of the machine.
    pub fn wait_for(&self, what: &str, holds: impl Fn(&StationStatus) -> bool) -> Duration {
        let watch = Stopwatch::start();
        while !holds(&self.station.status()) {
            assert!(watch.own_time() < WAIT_LIMIT, "not {what}: {:#?}", self.station.status());
            std::thread::sleep(Duration::from_millis(1));
        }
        watch.own_time()
    }

    /// A lease for a job.
    pub fn lease(&self) -> StationLease {
        self.try_lease().unwrap()
    }

    /// A lease, or the refusal.
    pub fn try_lease(&self) -> Result<StationLease, StationRefusal> {
        self.lease_of(self.station.stop_epoch())
    }

    /// A lease for a job authorised in that epoch.
    pub fn lease_of(&self, epoch: StopEpoch) -> Result<StationLease, StationRefusal> {
        self.station.lease(Purpose { job_id: "job-1".to_owned(), activity: "scanning".to_owned(), epoch })
    }

    /// Sends a person's command.
    pub fn manual(&self, command: Manual) -> Result<Option<devices::AcceptedMove>, StationRefusal> {
        wait(self.station.manual(command))
    }

    /// Sends a person's Stop.
    pub fn stop(&self) {
        wait(self.station.stop("a person")).unwrap();
    }
}

/// Waits for a future on this thread.
pub fn wait<F: Future>(future: F) -> F::Output {
    tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(future)
}

/// Waits until a condition holds. Returns the time this took without pauses of the machine.
pub fn wait_until(what: &str, holds: impl Fn() -> bool) -> Duration {
    let watch = Stopwatch::start();
    while !holds() {
        assert!(watch.own_time() < WAIT_LIMIT, "not {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
    watch.own_time()
}

/// A flag that is never set.
pub fn never_cancelled() -> CancelFlag {
    CancelFlag::default()
}
