//! The driver setting `port`.

use crate::Found;
use crate::lines::memory_line::MemoryLine;
use crate::lines::serial_line::{PortLine, SerialLine};
use crate::lines::tcp_line::{SCHEME, TcpLine};
use crate::time;

/// The line named by a driver's setting `port`: a device file, or `tcp://host:port`.
pub fn line_to(port: &str, baud_rate: u32) -> Box<dyn SerialLine> {
    match port.strip_prefix(SCHEME) {
        Some(address) => Box::new(TcpLine::new(address)),
        None if time::is_simulated() => Box::new(MemoryLine::new(port)),
        None => Box::new(PortLine::new(port, baud_rate)),
    }
}

/// Serial ports with a USB device, as values of a driver's setting `port`.
pub fn ports_on_usb() -> Vec<Found> {
    let ports = serialport::available_ports().unwrap_or_default().into_iter();
    let on_usb = ports.filter(|port| matches!(port.port_type, serialport::SerialPortType::UsbPort(_)));
    on_usb.map(|port| Found::by("port", port.port_name)).collect()
}
