//! A GigE Vision camera that others wrote: `arv-fake-gv-camera-0.8` of aravis, a process that speaks the protocol on
//! 127.0.0.1. For tests; one at a time, since the protocol has one port.

use std::fs::File;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::fcntl::{Flock, FlockArg};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::gvcp;

/// The program.
pub const PROGRAM: &str = "arv-fake-gv-camera-0.8";

/// Where it listens.
const ADDRESS: &str = "127.0.0.1";

/// Longest wait until it listens.
const START_LIMIT: Duration = Duration::from_secs(10);

/// How a camera is to be.
#[derive(Debug, Clone, Default)]
pub struct FakeOptions {
    /// Its serial number.
    pub serial: String,
    /// Packets lost of a thousand.
    pub lost_per_thousand: u32,
    /// Another description of its features.
    pub description: Option<PathBuf>,
}

/// The camera, which ends with this value; it alone has the address until then.
pub struct FakeCamera {
    options: FakeOptions,
    process: Option<Child>,
    _alone: Flock<File>,
}

impl FakeCamera {
    /// Whether the program is installed.
    pub fn is_installed() -> bool {
        std::env::var_os("PATH")
            .is_some_and(|path| std::env::split_paths(&path).any(|folder| folder.join(PROGRAM).is_file()))
    }

    /// Starts a camera once no other test has one, and waits until it answers.
    ///
    /// # Errors
    /// What the operating system says, and a camera that does not answer.
    pub fn start(options: FakeOptions) -> std::io::Result<Self> {
        let file = File::create(std::env::temp_dir().join("sheaf-fake-gige-camera.lock"))?;
        let alone = Flock::lock(file, FlockArg::LockExclusive).map_err(|(_, error)| error)?;
        let mut camera = Self { options, process: None, _alone: alone };
        camera.restart()?;
        Ok(camera)
    }

    /// Ends it without a word and starts it again: switched off and on.
    ///
    /// # Errors
    /// As [`FakeCamera::start`].
    pub fn restart(&mut self) -> std::io::Result<()> {
        self.kill();
        let mut command = Command::new(PROGRAM);
        command.args(["-i", ADDRESS, "-s", &self.options.serial]);
        command.args(["-r", &self.options.lost_per_thousand.to_string()]);
        if let Some(description) = &self.options.description {
            command.arg("-g").arg(description);
        }
        let process = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
        self.process = Some(process);
        let deadline = Instant::now() + START_LIMIT;
        while gvcp::control(ADDRESS).is_none() {
            if Instant::now() > deadline {
                return Err(std::io::Error::other(format!("{PROGRAM} does not answer at {ADDRESS}")));
            }
        }
        Ok(())
    }

    /// Ends it without a word: power lost.
    pub fn kill(&mut self) {
        if let Some(mut process) = self.process.take() {
            // It may have ended by itself.
            let _ = process.kill();
            let _ = process.wait();
        }
    }

    /// Holds it: it answers nothing and sends nothing until [`FakeCamera::go_on`].
    pub fn hold(&self) {
        self.signal(Signal::SIGSTOP);
    }

    /// Lets it go on.
    pub fn go_on(&self) {
        self.signal(Signal::SIGCONT);
    }

    /// Whether it was ended.
    pub fn has_ended(&self) -> bool {
        self.process.is_none()
    }

    /// Its process.
    pub fn pid(&self) -> Option<u32> {
        self.process.as_ref().map(Child::id)
    }

    fn signal(&self, signal: Signal) {
        if let Some(pid) = self.pid().and_then(|pid| i32::try_from(pid).ok()) {
            // It may have ended by itself.
            let _ = kill(Pid::from_raw(pid), signal);
        }
    }
}

impl Drop for FakeCamera {
    fn drop(&mut self) {
        self.go_on();
        self.kill();
    }
}
