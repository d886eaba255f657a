//! The service under load, killed, stopped, and with a camera that others wrote.

pub mod crash;
pub mod genicam;
pub mod stop;
pub mod stream_load;
