//! The driver over the simulated firmware, whose event log records what really happened.
//!
//! Not covered: that a real board behaves like the simulation. The simulation follows the firmware's source and
//! documents as described in `server/docs/devices/grbl.md`.

mod dialects;
mod dialogue;
mod faults;
mod firmware;
mod stops;
mod suite;
mod tcp;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::{GrblConfig, GrblLaser, GrblStage};
use crate::contract::Stopwatch;
use crate::simulators::grbl_simulator::{GrblSimulator, SimulatorConfig};
use crate::time::{Membership, simulate};
use crate::{Stage, StageError, StageState};

/// Time that the operating system may add on an idle machine.
const SLACK: Duration = Duration::from_millis(250);

/// Steps per mm of the simulated stage.
const STEPS_PER_MM: f64 = 400.0;

/// A simulated controller, with the configuration of the driver.
struct Bench {
    simulator: Arc<GrblSimulator>,
    config: GrblConfig,
    _folder: TempDir,
    /// Dropped last: everything above uses it.
    _clock: Option<Membership>,
}

/// A controller of this kind; the stage's zero is 6 mm before the switch, its travel 8 mm. Test and bench use a
/// simulated clock.
fn bench(kind: SimulatorConfig) -> Bench {
    bench_under(simulate(), kind)
}

/// As [`bench`], over a pseudo-terminal and with the real clock.
fn bench_in_real_time(kind: SimulatorConfig) -> Bench {
    bench_under(None, kind)
}

fn bench_under(clock: Option<Membership>, kind: SimulatorConfig) -> Bench {
    let folder = TempDir::new().unwrap();
    let port_name: PathBuf = folder.path().join("controller");
    let simulator = Arc::new(GrblSimulator::start(kind, &port_name, None).unwrap());
    let config = GrblConfig {
        zero_at_machine_mm: -6.0,
        moving_query_hz: 50.0,
        ..GrblConfig::new(port_name.to_str().unwrap(), STEPS_PER_MM, (-4.0, 4.0))
    };
    Bench { simulator, config, _folder: folder, _clock: clock }
}

fn default_bench() -> Bench {
    bench(SimulatorConfig::default())
}

impl Bench {
    fn open(&self) -> (GrblStage, GrblLaser) {
        super::open(&self.config).unwrap()
    }

    /// The refusal to open.
    fn refusal(&self) -> StageError {
        match super::open(&self.config) {
            Ok(_) => panic!("opened"),
            Err(refusal) => refusal,
        }
    }

    fn light(&self) -> bool {
        self.simulator.event_log().light()
    }
}

fn wait_until(limit: Duration, what: &str, mut condition: impl FnMut() -> bool) {
    let watch = Stopwatch::start();
    while !condition() {
        assert!(watch.own_time() < limit, "{what}: not within {limit:?}");
        crate::time::sleep(Duration::from_millis(1));
    }
}

/// Waits until it is at rest; returns its state.
fn rest(stage: &mut GrblStage) -> StageState {
    wait_until(Duration::from_secs(5), "it comes to rest", || !stage.poll().unwrap().moving);
    stage.poll().unwrap()
}

fn home(stage: &mut GrblStage) {
    stage.start_home().unwrap();
    assert!(rest(stage).homed, "homing ended without a reference");
}
