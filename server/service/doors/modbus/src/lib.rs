//! A door for programmable logic controllers: a Modbus TCP server.
//!
//! A PLC reads the state of the station and one result at a time, and writes commands. The registers are listed once, in
//! [`register_map`]; server and documentation follow from that list. The handshake is a state machine without network and
//! clock (`handshake`); the server decodes requests and applies each to it under one lock, so that no read is torn.
//!
//! Deliveries: a result is shown until the PLC acknowledges it, and shown again after a restart if that was not stored.
//! Its number derives from that of the inspection, so that a PLC recognises a repetition.
//!
//! Only Modbus functions 3, 4, 6 and 16 exist. There is no reset, and no command for the laser. Modbus has no
//! authentication: whoever reaches the port can read, and write if that is switched on.

mod codes;
mod door;
mod handshake;
mod line;
mod registers;
mod server;
mod settings;
#[cfg(test)]
mod tests;

pub use registers::map::{Access, Kind, Register, Table, register_map};
pub use registers::print::{csv, markdown};
pub use settings::Settings;

use std::sync::Arc;

use app::doors::{BadSetting, Door};

/// Opens the door; it listens once the service runs.
///
/// # Errors
/// A setting cannot be used.
pub fn open(settings: Settings) -> Result<Arc<dyn Door>, BadSetting> {
    Ok(Arc::new(door::ModbusDoor::new(settings)?))
}
