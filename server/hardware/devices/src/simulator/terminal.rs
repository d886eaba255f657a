//! A pseudo-terminal at a known place.

use std::fs::File;
use std::os::fd::OwnedFd;
use std::path::Path;

use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

/// Both ends of a pseudo-terminal; the computer's end is kept open so that it may come and go.
pub struct Terminal {
    pub controller: File,
    _computer: OwnedFd,
}

impl Terminal {
    pub fn open(place: &Path) -> std::io::Result<Self> {
        let ends = openpty(None, None)?;
        let mut raw = tcgetattr(&ends.slave)?;
        cfmakeraw(&mut raw);
        tcsetattr(&ends.slave, SetArg::TCSANOW, &raw)?;
        let device = nix::unistd::ttyname(&ends.slave)?;
        if place.symlink_metadata().is_ok() {
            std::fs::remove_file(place)?;
        }
        std::os::unix::fs::symlink(device, place)?;
        Ok(Self { controller: File::from(ends.master), _computer: ends.slave })
    }
}
