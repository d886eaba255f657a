//! Bytes on a cable: serial, TCP and in memory, cut into lines, and the dialogue with a controller over them.

pub mod line_reader;
pub mod memory_line;
pub mod ports;
pub mod serial_controller;
pub mod serial_line;
pub mod tcp_line;
