//! The driver over the simulated device, whose event log records what really happened.
//!
//! Not covered: that a real device behaves like the simulation, which follows the protocol's document.

mod dialogue;
mod faults;
mod suite;

use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::{ZaberConfig, ZaberStage, open};
use crate::contract::Stopwatch;
use crate::simulators::zaber_simulator::{SimulatorConfig, ZaberSimulator};
use crate::time::{Membership, simulate};
use crate::{Stage, StageError, StageState};

/// Time that the operating system may add on an idle machine.
const SLACK: Duration = Duration::from_millis(250);

struct Bench {
    simulator: Arc<ZaberSimulator>,
    config: ZaberConfig,
    _folder: TempDir,
    /// Dropped last: everything above uses it.
    _clock: Option<Membership>,
}

/// A device of this kind; the stage's zero is 50 mm from its home, its travel 8 mm.
/// Test and bench use a simulated clock.
fn bench(kind: SimulatorConfig) -> Bench {
    bench_under(simulate(), kind)
}

fn bench_under(clock: Option<Membership>, kind: SimulatorConfig) -> Bench {
    let folder = TempDir::new().unwrap();
    let port_name = folder.path().join("device");
    let travel_per_turn_mm = kind.travel_per_turn_mm;
    let address = kind.address;
    let simulator = Arc::new(ZaberSimulator::start(kind, &port_name, None).unwrap());
    let config = ZaberConfig {
        address,
        zero_at_device_mm: 6.0,
        moving_query_hz: 50.0,
        ..ZaberConfig::new(port_name.to_str().unwrap(), travel_per_turn_mm, (-4.0, 4.0))
    };
    Bench { simulator, config, _folder: folder, _clock: clock }
}

fn default_bench() -> Bench {
    bench(SimulatorConfig::default())
}

impl Bench {
    fn open(&self) -> ZaberStage {
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
}

fn wait_until(limit: Duration, what: &str, mut condition: impl FnMut() -> bool) {
    let watch = Stopwatch::start();
    while !condition() {
        assert!(watch.own_time() < limit, "{what}: not within {limit:?}");
        crate::time::sleep(Duration::from_millis(1));
    }
}

/// Waits until it is at rest; returns its state.
fn rest(stage: &mut ZaberStage) -> StageState {
    wait_until(Duration::from_secs(5), "it comes to rest", || !stage.poll().unwrap().moving);
    stage.poll().unwrap()
}

fn home(stage: &mut ZaberStage) {
    stage.start_home().unwrap();
    assert!(rest(stage).homed, "homing ended without a reference");
}
