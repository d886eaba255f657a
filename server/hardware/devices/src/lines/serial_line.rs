//! The seam below serial drivers: bytes out now, bytes in until a deadline, opened again on request.

use std::io::{ErrorKind, Read, Write};
use std::time::Duration;

use serialport::TTYPort;

/// Why a serial line does not work.
#[derive(Debug, thiserror::Error)]
pub enum SerialLineError {
    /// It cannot be opened.
    #[error("{place} cannot be opened")]
    Unopened {
        /// Where it was looked for.
        place: String,
        /// Why.
        #[source]
        cause: serialport::Error,
    },
    /// It cannot be connected to.
    #[error("{place} cannot be connected to")]
    Unconnected {
        /// Where it was looked for.
        place: String,
        /// Why.
        #[source]
        cause: std::io::Error,
    },
    /// The other end is gone: unplugged, or its computer closed it.
    #[error("{place} was cut off")]
    CutOff {
        /// Which line.
        place: String,
        /// How it showed; none where the line just ended.
        #[source]
        cause: Option<std::io::Error>,
    },
    /// Bytes were not taken in time.
    #[error("{place} takes no more bytes")]
    Blocked {
        /// Which line.
        place: String,
    },
    /// It was not opened, or it was closed.
    #[error("{place} is closed")]
    Closed {
        /// Which line.
        place: String,
    },
}

/// A serial line: read by one thread, written by any that holds a writer.
pub trait SerialLine: Send {
    /// Where it is: a device file, or a name for a test.
    fn place(&self) -> String;

    /// Opens it, or closes and opens it again. Writers of before are dead and should be dropped first, for a line
    /// is opened by one owner only.
    ///
    /// # Errors
    /// [`SerialLineError::Unopened`].
    fn reopen(&mut self) -> Result<(), SerialLineError>;

    /// Closes it; reading and writing fail until it is opened again.
    fn close(&mut self);

    /// Reads what has arrived, waiting at most `wait` for the first byte; 0: nothing came.
    ///
    /// # Errors
    /// [`SerialLineError::CutOff`], [`SerialLineError::Closed`].
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError>;

    /// An end to write to, also while another thread waits in [`SerialLine::read`].
    ///
    /// # Errors
    /// [`SerialLineError::Closed`].
    fn writer(&self) -> Result<Box<dyn SerialWriter>, SerialLineError>;
}

/// The writing end of a [`SerialLine`].
pub trait SerialWriter: Send {
    /// Hands all of `bytes` to the operating system now.
    ///
    /// # Errors
    /// [`SerialLineError::Blocked`] after [`WRITE_LIMIT`], [`SerialLineError::CutOff`].
    fn write_now(&mut self, bytes: &[u8]) -> Result<(), SerialLineError>;
}

/// Longest wait for room in the operating system's buffer, a part of [`crate::CALL_LIMIT`]. The buffer holds
/// seconds of what a driver writes: a line that takes no byte in this time takes none at all.
pub const WRITE_LIMIT: Duration = Duration::from_millis(10);

/// A serial port of the operating system.
pub struct PortLine {
    path: String,
    baud_rate: u32,
    port: Option<TTYPort>,
}

impl PortLine {
    /// The port at `path`, not opened yet.
    pub fn new(path: &str, baud_rate: u32) -> Self {
        Self { path: path.to_owned(), baud_rate, port: None }
    }

    fn cut_off(&self, cause: Option<std::io::Error>) -> SerialLineError {
        SerialLineError::CutOff { place: self.path.clone(), cause }
    }
}

impl SerialLine for PortLine {
    fn place(&self) -> String {
        self.path.clone()
    }

    fn reopen(&mut self) -> Result<(), SerialLineError> {
        self.close();
        // `serialport` sets DTR only where the line has one; a pseudo-terminal answers ENOTTY, which it tolerates.
        let wanted = serialport::new(&self.path, self.baud_rate).timeout(WRITE_LIMIT);
        let port =
            wanted.open_native().map_err(|cause| SerialLineError::Unopened { place: self.path.clone(), cause })?;
        self.port = Some(port);
        Ok(())
    }

    fn close(&mut self) {
        self.port = None;
    }

    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError> {
        use serialport::SerialPort;
        let place = || self.path.clone();
        let Some(port) = &mut self.port else { return Err(SerialLineError::Closed { place: place() }) };
        if port.set_timeout(wait).is_err() {
            return Err(self.cut_off(None));
        }
        match port.read(buffer) {
            // Readable without a byte: the other end is closed.
            Ok(0) => Err(self.cut_off(None)),
            Ok(n) => Ok(n),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            Err(error) => Err(self.cut_off(Some(error))),
        }
    }

    fn writer(&self) -> Result<Box<dyn SerialWriter>, SerialLineError> {
        let Some(port) = &self.port else { return Err(SerialLineError::Closed { place: self.path.clone() }) };
        let mut port = port
            .try_clone_native()
            .map_err(|cause| SerialLineError::Unopened { place: self.path.clone(), cause })?;
        serialport::SerialPort::set_timeout(&mut port, WRITE_LIMIT)
            .map_err(|cause| SerialLineError::Unopened { place: self.path.clone(), cause })?;
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
                Err(SerialLineError::Blocked { place: self.path.clone() })
            }
            Err(error) => Err(SerialLineError::CutOff { place: self.path.clone(), cause: Some(error) }),
        }
    }
}
