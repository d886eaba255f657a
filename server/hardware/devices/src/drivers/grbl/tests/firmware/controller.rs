//! A controller's firmware compiled for this computer, at one end of a pseudo-terminal.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use tempfile::TempDir;

use super::{MOTION_LIMIT, STEPS_PER_MM};
use crate::drivers::grbl::GrblConfig;

/// A program that simulates a controller.
pub struct Controller {
    child: Child,
    port: PathBuf,
    _computer: OwnedFd,
    _folder: TempDir,
}

impl Controller {
    /// Starts the program that `variable` names; without one the calling test is noted as not run.
    pub fn start(variable: &str) -> Option<Self> {
        let program = reference::named_program(variable)?;
        let folder = TempDir::new().unwrap();
        let ends = openpty(None, None).unwrap();
        let mut raw = tcgetattr(&ends.slave).unwrap();
        cfmakeraw(&mut raw);
        tcsetattr(&ends.slave, SetArg::TCSANOW, &raw).unwrap();
        let port = nix::unistd::ttyname(&ends.slave).unwrap();
        let end = || Stdio::from(ends.master.try_clone().unwrap());
        let child = Command::new(program)
            .args(["-n", "-s", "/dev/null", "-b", "/dev/null"])
            .current_dir(folder.path())
            .stdin(end())
            .stdout(end())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // The line is set to raw mode again: the program may have configured its own end differently.
        std::thread::sleep(Duration::from_millis(500));
        tcsetattr(&ends.slave, SetArg::TCSANOW, &raw).unwrap();
        let controller = Self { child, port, _computer: ends.slave, _folder: folder };
        // Data sent before its banner are lost.
        controller.read_until("for help]\r\n");
        std::thread::sleep(Duration::from_millis(500));
        Some(controller)
    }

    pub fn line(&self) -> File {
        OpenOptions::new().read(true).write(true).open(&self.port).unwrap()
    }

    /// Sends lines and waits for the answer to each.
    pub fn set(&self, lines: &[&str]) {
        let mut line = self.line();
        for command in lines {
            line.write_all(format!("{command}\n").as_bytes()).unwrap();
            let said = self.read_until("\r\n");
            assert!(said.ends_with("ok\r\n"), "{command} is answered by {said}");
        }
    }

    fn read_until(&self, end: &str) -> String {
        let mut line = self.line();
        let (mut said, mut byte) = (String::new(), [0]);
        while !said.ends_with(end) {
            assert_eq!(line.read(&mut byte).unwrap(), 1, "it ended after {said}");
            said.push(char::from(byte[0]));
        }
        said
    }

    /// Writes bytes directly, bypassing the driver.
    pub fn press(&self, bytes: &[u8]) {
        self.line().write_all(bytes).unwrap();
    }

    pub fn config(&self) -> GrblConfig {
        GrblConfig {
            zero_at_machine_mm: -50.0,
            homing_limit: MOTION_LIMIT,
            ..GrblConfig::new(self.port.to_str().unwrap(), STEPS_PER_MM, (-40.0, 40.0))
        }
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}
