//! The controller's end of a line at a known path: a pseudo-terminal, or bytes in memory under a simulated clock.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::path::Path;
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

use crate::lines::memory_line::MemoryPort;
use crate::time;

/// See the module.
pub enum Terminal {
    /// Both ends; the computer's is kept open so that clients may connect and disconnect.
    Pseudo {
        controller: File,
        _computer: OwnedFd,
    },
    Memory(MemoryPort),
}

impl Terminal {
    pub fn open(port_name: &Path) -> std::io::Result<Self> {
        if time::is_simulated() {
            return Ok(Self::Memory(MemoryPort::open(port_name)));
        }
        let ends = openpty(None, None)?;
        let mut raw = tcgetattr(&ends.slave)?;
        cfmakeraw(&mut raw);
        tcsetattr(&ends.slave, SetArg::TCSANOW, &raw)?;
        let device = nix::unistd::ttyname(&ends.slave)?;
        if port_name.symlink_metadata().is_ok() {
            std::fs::remove_file(port_name)?;
        }
        std::os::unix::fs::symlink(device, port_name)?;
        Ok(Self::Pseudo { controller: File::from(ends.master), _computer: ends.slave })
    }

    /// Reads received bytes, waiting for `wait` at most; 0 if there are none.
    pub fn read(&mut self, buffer: &mut [u8], wait: Duration) -> usize {
        match self {
            Self::Memory(port) => port.read(buffer, wait),
            Self::Pseudo { controller, .. } => {
                let mut waits = [PollFd::new(controller.as_fd(), PollFlags::POLLIN)];
                let timeout = PollTimeout::try_from(wait).unwrap_or(PollTimeout::ZERO);
                if poll(&mut waits, timeout).unwrap_or(0) == 0 {
                    return 0;
                }
                controller.read(buffer).unwrap_or(0)
            }
        }
    }

    /// There may be no reader.
    pub fn write(&mut self, bytes: &[u8]) {
        match self {
            Self::Memory(port) => port.write(bytes),
            Self::Pseudo { controller, .. } => drop(controller.write_all(bytes)),
        }
    }
}
