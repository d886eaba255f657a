//! Byte streams: serial, TCP and in memory, split into text lines, and the dialogue with a controller over them.

pub mod line_reader;
pub mod memory_line;
pub mod ports;
pub mod serial_controller;
pub mod serial_line;
pub mod tcp_line;
