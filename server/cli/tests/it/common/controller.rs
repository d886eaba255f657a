//! A simulated GRBL controller and the configuration of a station on it.

use std::path::{Path, PathBuf};

use devices::grbl_simulator::{GrblSimulator, SimulatorConfig};

/// The controller under `folder`, and the configuration file that names its port.
pub fn grbl_station(folder: &Path) -> (GrblSimulator, PathBuf) {
    let port = folder.join("controller");
    let simulated = SimulatorConfig::default();
    let steps_per_mm = simulated.steps_per_mm;
    let simulator = GrblSimulator::start(simulated, &port, None).unwrap();
    let config = folder.join("sheaf.toml");
    let text = format!(
        "[station]\nstage.kind = \"grbl\"\nlaser.kind = \"grbl\"\n[station.grbl]\nport = {port:?}\nsteps_per_mm = {steps_per_mm}\n"
    );
    std::fs::write(&config, text).unwrap();
    (simulator, config)
}
