//! What a station is made of, as a configuration says it.

use std::path::PathBuf;

/// What the station is made of.
#[derive(Debug, Clone, PartialEq)]
pub enum StationConfig {
    /// A simulated station.
    Twin(TwinConfig),
    /// A capture folder played back.
    Replay(ReplayStationConfig),
    /// A GRBL stage and laser with a simulated or replayed camera, until camera drivers exist.
    Grbl(GrblStationConfig),
}

/// A simulated station.
#[derive(Debug, Clone, PartialEq)]
pub struct TwinConfig {
    /// What all its randomness comes from.
    pub seed: u64,
    /// What is on the stage at the start: `plate`, `gauge`, `sphere`, `freeform`, or an STL file.
    pub scene: String,
    /// Height of the gauge.
    pub gauge_height_mm: f64,
    /// Radius of the ball.
    pub sphere_radius_mm: f64,
    /// Ramps, settling and homing take their time.
    pub realistic_timing: bool,
    /// Frames per second of the live view.
    pub frame_rate_hz: f64,
}

/// A capture folder played back.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayStationConfig {
    /// The capture folder.
    pub folder: PathBuf,
    /// Which scan; `None`: the first.
    pub scan: Option<String>,
    /// Frames per second.
    pub frame_rate_hz: f64,
    /// From memory, without a disk in the way.
    pub preload: bool,
    /// Start again at the end.
    pub repeat: bool,
}

/// A GRBL controller that moves the stage and switches the laser.
#[derive(Debug, Clone, PartialEq)]
pub struct GrblStationConfig {
    /// The serial port.
    pub port: String,
    /// Its speed.
    pub baud: u32,
    /// Steps per mm that the controller must have.
    pub steps_per_mm: f64,
    /// Text its identity must contain; empty: any.
    pub identity: String,
    /// Lowest position the stage may go to.
    pub travel_from_mm: f64,
    /// Highest position the stage may go to.
    pub travel_to_mm: f64,
    /// Machine position of the stage's zero.
    pub zero_at_machine_mm: f64,
    /// The camera beside it.
    pub camera: TwinConfig,
}
