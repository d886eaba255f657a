//! The configuration of the service: defaults, then a file, then the environment, then flags; and where each value
//! came from.

pub mod error;
pub mod layers;
pub mod limits;
pub mod settings;
pub mod value;

pub use error::ConfigError;
pub use layers::{Asked, Effective, Origin, effective};

use std::net::SocketAddr;
use std::path::PathBuf;

use station::config::StationConfig;

/// The configuration in force.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Where to listen.
    pub listen: SocketAddr,
    /// Where everything is kept.
    pub data: PathBuf,
    /// What the station is made of.
    pub station: StationConfig,
    /// The board used for calibration.
    pub target: TargetConfig,
    /// The projector by its data sheet.
    pub projector: ProjectorConfig,
    /// Who may talk to the service.
    pub http: HttpConfig,
}

impl Config {
    /// Height of the gauge block and radius of the ball beside the station, mm: on the simulated one their true sizes.
    pub fn known_sizes_mm(&self) -> (f64, f64) {
        match &self.station {
            StationConfig::Twin(twin) => (twin.gauge_height_mm, twin.sphere_radius_mm),
            _ => (crate::cli::GAUGE_HEIGHT_MM, crate::cli::SPHERE_RADIUS_MM),
        }
    }
}

impl Config {
    /// For tests: everything as it is by default: a simulated station, loopback, any free port, everything under `data`.
    #[cfg(test)]
    pub fn simulated(data: PathBuf) -> Self {
        let asked = Asked { listen: Some("127.0.0.1:0".to_owned()), data: Some(data), ..Asked::default() };
        layers::from_flags(&asked).expect("the defaults are valid; a test holds this").config
    }
}

/// Who may talk to the service, beyond this machine's own names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct HttpConfig {
    /// Names under which clients may address the service (`Host`), without port.
    pub allowed_hosts: Vec<String>,
    /// Origins of pages that may use it (`Origin`), beside its own: `https://line3.example`.
    pub allowed_origins: Vec<String>,
    /// Whether a reverse proxy that is trusted with users and TLS stands before it; without, only this machine is served.
    pub trusted_proxy: bool,
}

/// A chessboard.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetConfig {
    /// Inner corners along a row.
    pub inner_columns: usize,
    /// Inner corners along a column.
    pub inner_rows: usize,
    /// Side of a square.
    pub square_mm: f64,
}

/// The projector by its data sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct ProjectorConfig {
    /// Wavelength of the laser.
    pub wavelength_nm: f64,
    /// Grooves of the grating.
    pub grating_lines_per_mm: f64,
    /// Orders from the top (left) of the image.
    pub orders: Vec<i8>,
    /// `rows` or `columns`.
    pub line_direction: String,
}
