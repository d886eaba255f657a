//! The configuration of the service: defaults, then a file, then the environment, then flags; and where each value
//! came from.

pub mod error;
pub mod layer;
pub mod layers;
pub mod origin;
pub mod setting;
pub mod settings;

pub use error::ConfigError;
pub use layers::{Asked, Effective, effective};

use std::net::SocketAddr;

use app::config::AppConfig;
use http::HttpConfig;

use crate::doors::DoorSettings;

/// The configuration in force.
#[derive(Debug, Clone)]
pub struct Config {
    /// Where to listen.
    pub listen: SocketAddr,
    /// What the use cases care for.
    pub app: AppConfig,
    /// Who may talk to the service.
    pub http: HttpConfig,
    /// Where it delivers events.
    pub doors: DoorSettings,
}
