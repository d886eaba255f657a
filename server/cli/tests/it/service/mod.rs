//! The service under load, killed, stopped, and with a third-party simulated camera.

pub mod crash;
mod doctor;
pub mod genicam;
pub mod recording_kills;
pub mod stop;
pub mod stream_load;
