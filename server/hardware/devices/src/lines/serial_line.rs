//! The interface below serial drivers: write now, read until a deadline, reopen on request.

use std::io::{ErrorKind, Read, Write};
use std::time::Duration;

use serialport::TTYPort;

/// Why a serial line does not work.
#[derive(Debug, thiserror::Error)]
pub enum SerialLineError {
    /// It cannot be opened.
    #[error("{port_name} cannot be opened")]
    OpenFailed {
        /// The port.
        port_name: String,
        /// Why.
        #[source]
        cause: serialport::Error,
    },
    /// It cannot be connected to.
    #[error("cannot connect to {port_name}")]
    ConnectFailed {
        /// The port.
        port_name: String,
        /// Why.
        #[source]
        cause: std::io::Error,
    },
    /// The other end is unplugged or closed.
    #[error("{port_name} was disconnected")]
    Disconnected {
        /// The line.
        port_name: String,
        /// The error; `None` if the line just ended.
        #[source]
        cause: Option<std::io::Error>,
    },
    /// Bytes were not accepted in time.
    #[error("{port_name} accepts no more bytes")]
    Blocked {
        /// The line.
        port_name: String,
    },
    /// It was not opened, or it was closed.
    #[error("{port_name} is closed")]
    Closed {
        /// The line.
        port_name: String,
    },
}

/// A serial line: read by one thread, written by any thread with a writer.
pub trait SerialLine: Send {
    /// Its path, or a name for a test.
    fn port_name(&self) -> String;

    /// Opens it, or closes and reopens it. Existing writers become invalid and should be dropped first, because a line
    /// is opened by one owner only.
    ///
    /// # Errors
    /// [`SerialLineError::OpenFailed`].
    fn reopen(&mut self) -> Result<(), SerialLineError>;

    /// Closes it; reading and writing fail until it is opened again.
    fn close(&mut self);

    /// Reads received bytes, waiting at most `wait` for the first; 0 if there are none.
    ///
    /// # Errors
    /// [`SerialLineError::Disconnected`], [`SerialLineError::Closed`].
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError>;

    /// A writer, usable also while another thread waits in [`SerialLine::read`].
    ///
    /// # Errors
    /// [`SerialLineError::Closed`].
    fn writer(&self) -> Result<Box<dyn SerialWriter>, SerialLineError>;
}

/// The writing end of a [`SerialLine`].
pub trait SerialWriter: Send {
    /// Passes all of `bytes` to the operating system now.
    ///
    /// # Errors
    /// [`SerialLineError::Blocked`] after [`WRITE_LIMIT`], [`SerialLineError::Disconnected`].
    fn write_now(&mut self, bytes: &[u8]) -> Result<(), SerialLineError>;
}

/// Longest wait for space in the operating system's buffer, a part of [`crate::CALL_LIMIT`]. The buffer holds seconds
/// of a driver's output: a line that accepts no byte in this time is blocked.
pub const WRITE_LIMIT: Duration = Duration::from_millis(10);

/// A serial port of the operating system.
pub struct PortLine {
    path: String,
    baud_rate: u32,
    port: Option<TTYPort>,
}

impl PortLine {
    /// The port at `path`, not open yet.
    pub fn new(path: &str, baud_rate: u32) -> Self {
        Self { path: path.to_owned(), baud_rate, port: None }
    }

    fn disconnected(&self, cause: Option<std::io::Error>) -> SerialLineError {
        SerialLineError::Disconnected { port_name: self.path.clone(), cause }
    }
}

impl SerialLine for PortLine {
    fn port_name(&self) -> String {
        self.path.clone()
    }

    fn reopen(&mut self) -> Result<(), SerialLineError> {
        self.close();
        // `serialport` sets DTR only where the line has one; a pseudo-terminal answers ENOTTY, which it tolerates.
        let wanted = serialport::new(&self.path, self.baud_rate).timeout(WRITE_LIMIT);
        let port = wanted
            .open_native()
            .map_err(|cause| SerialLineError::OpenFailed { port_name: self.path.clone(), cause })?;
        self.port = Some(port);
        Ok(())
    }

    fn close(&mut self) {
        self.port = None;
    }

    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError> {
        use serialport::SerialPort;
        let port_name = || self.path.clone();
        let Some(port) = &mut self.port else { return Err(SerialLineError::Closed { port_name: port_name() }) };
        if port.set_timeout(wait).is_err() {
            return Err(self.disconnected(None));
        }
        match port.read(buffer) {
            // Readable without a byte: the other end is closed.
            Ok(0) => Err(self.disconnected(None)),
            Ok(n) => Ok(n),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            Err(error) => Err(self.disconnected(Some(error))),
        }
    }

    fn writer(&self) -> Result<Box<dyn SerialWriter>, SerialLineError> {
        let Some(port) = &self.port else { return Err(SerialLineError::Closed { port_name: self.path.clone() }) };
        let mut port = port
            .try_clone_native()
            .map_err(|cause| SerialLineError::OpenFailed { port_name: self.path.clone(), cause })?;
        serialport::SerialPort::set_timeout(&mut port, WRITE_LIMIT)
            .map_err(|cause| SerialLineError::OpenFailed { port_name: self.path.clone(), cause })?;
        Ok(Box::new(PortWriter { path: self.path.clone(), port }))
    }
}

struct PortWriter {
    path: String,
    port: TTYPort,
}

impl SerialWriter for PortWriter {
    fn write_now(&mut self, bytes: &[u8]) -> Result<(), SerialLineError> {
        match self.port.write_all(bytes) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == ErrorKind::TimedOut => {
                Err(SerialLineError::Blocked { port_name: self.path.clone() })
            }
            Err(error) => Err(SerialLineError::Disconnected { port_name: self.path.clone(), cause: Some(error) }),
        }
    }
}
