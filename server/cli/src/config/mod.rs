//! The configuration of the service from defaults, file, environment and flags, with the origin of each value.

pub mod certificate;
pub mod error;
pub mod layer;
pub mod layers;
pub mod origin;
pub mod setting;
pub mod settings;

pub use error::ConfigError;
pub use layers::{Effective, Flags, effective};

use std::net::SocketAddr;

use app::config::AppConfig;
use http::HttpConfig;

use crate::doors::DoorSettings;

/// The effective configuration.
#[derive(Debug, Clone)]
pub struct Config {
    /// Address and port to listen on.
    pub listen: SocketAddr,
    /// Configuration of the application.
    pub app: AppConfig,
    /// Access to the service.
    pub http: HttpConfig,
    /// Doors: interfaces to other systems.
    pub doors: DoorSettings,
}
