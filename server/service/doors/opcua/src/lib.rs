//! A door for OPC UA clients: a server after OPC 40100-1 Machine Vision 1.0.
//!
//! Clients see one vision system: its state machines, its recipes and its results. The types are those of the OPC
//! Foundation's nodeset, which is part of the program; instances are copied from what the types declare. A result is
//! shown in variables and announced by an event; a client that was away lists the results that it missed, which are read
//! from the store.
//!
//! Deliveries: OPC UA has no acknowledgement by an application. A result counts as delivered once it stands in the address
//! space and was handed to all subscriptions.
//!
//! Connections are signed and encrypted, with user and password; reading without both, and all commands, have to be
//! switched on. There is no command for the laser.

mod door;
mod information_model;
mod line;
mod machine;
mod refusal;
mod result;
mod server;
mod settings;
#[cfg(test)]
mod tests;

pub use settings::{Settings, User};

use std::sync::Arc;

use app::doors::{BadSetting, Door};

/// Opens the door; it listens once the service runs.
///
/// # Errors
/// A setting cannot be used.
pub fn open(settings: Settings) -> Result<Arc<dyn Door>, BadSetting> {
    Ok(Arc::new(door::OpcUaDoor::new(settings)?))
}
