//! The driver over the simulated firmware, whose event log records what really happened.
//!
//! Not covered: that a real board behaves like the simulation, which follows the firmware's documents and order.

mod dialogue;
mod faults;
mod suite;

use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::{MarlinConfig, MarlinLaser, MarlinStage, open};
use crate::contract::Stopwatch;
use crate::simulators::marlin_simulator::{MarlinSimulator, SimulatorConfig};
use crate::time::{Membership, simulate};
use crate::{Stage, StageError, StageState};

/// Time that the operating system may add on an idle machine.
const SLACK: Duration = Duration::from_millis(250);

/// A move that runs out: pieces ahead, the first block's wait, and `M400`.
const RUN_OUT: Duration = Duration::from_millis(450);

struct Bench {
    simulator: Arc<MarlinSimulator>,
    config: MarlinConfig,
    _folder: TempDir,
    /// Dropped last: everything above uses it.
    _clock: Option<Membership>,
}

/// A controller of this kind; the stage's zero is 6 mm from its switch, its travel 8 mm. Test and bench use a simulated
/// clock.
fn bench(kind: SimulatorConfig) -> Bench {
    bench_under(simulate(), kind)
}

fn bench_under(clock: Option<Membership>, kind: SimulatorConfig) -> Bench {
    let folder = TempDir::new().unwrap();
    let port_name = folder.path().join("controller");
    let steps_per_mm = kind.steps_per_mm;
    let simulator = Arc::new(MarlinSimulator::start(kind, &port_name, None).unwrap());
    let config = MarlinConfig {
        zero_at_machine_mm: 6.0,
        moving_query_hz: 50.0,
        ..MarlinConfig::new(port_name.to_str().unwrap(), steps_per_mm, (-4.0, 4.0))
    };
    Bench { simulator, config, _folder: folder, _clock: clock }
}

fn default_bench() -> Bench {
    bench(SimulatorConfig::default())
}

impl Bench {
    fn open(&self) -> (MarlinStage, MarlinLaser) {
        open(&self.config).unwrap()
    }

    fn refusal(&self) -> StageError {
        match open(&self.config) {
            Ok(_) => panic!("opened"),
            Err(refusal) => refusal,
        }
    }

    fn moving(&self) -> bool {
        self.simulator.event_log().moving()
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
fn rest(stage: &mut MarlinStage) -> StageState {
    wait_until(Duration::from_secs(5), "it comes to rest", || !stage.poll().unwrap().moving);
    stage.poll().unwrap()
}

fn home(stage: &mut MarlinStage) {
    stage.start_home().unwrap();
    assert!(rest(stage).homed, "homing ended without a reference");
}
