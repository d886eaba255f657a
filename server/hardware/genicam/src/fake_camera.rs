//! A third-party GigE Vision camera for tests: `arv-fake-gv-camera-0.8` of aravis, a process that speaks the protocol
//! on 127.0.0.1. The protocol has a fixed port, so each camera gets a network of its own, or, without root, its turn.

use std::fs::File;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::fcntl::{Flock, FlockArg};
use nix::sched::{CloneFlags, unshare};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::gvcp;

/// Name of the program.
pub const PROGRAM: &str = "arv-fake-gv-camera-0.8";

/// Address on which it listens.
const ADDRESS: &str = "127.0.0.1";

/// Longest wait until it listens.
const START_LIMIT: Duration = Duration::from_secs(10);

/// Options of a camera.
#[derive(Debug, Clone, Default)]
pub struct FakeOptions {
    /// Serial number.
    pub serial: String,
    /// Packets lost per thousand.
    pub lost_per_thousand: u32,
    /// Replacement of its feature description (GenICam XML).
    pub description: Option<PathBuf>,
}

/// A running camera process; it is killed on drop. It holds the address exclusively until then.
pub struct FakeCamera {
    options: FakeOptions,
    process: Option<Child>,
    _turn: Option<Flock<File>>,
}

impl FakeCamera {
    /// Whether the program is installed.
    pub fn is_installed() -> bool {
        std::env::var_os("PATH")
            .is_some_and(|path| std::env::split_paths(&path).any(|folder| folder.join(PROGRAM).is_file()))
    }

    /// Starts a camera and waits until it answers. The calling thread, and all that it starts from then on, are moved to
    /// a network of their own; without the permission for that, it waits until no other test uses a camera.
    ///
    /// # Errors
    /// An error of the operating system, or a camera that does not answer.
    pub fn start(options: FakeOptions) -> std::io::Result<Self> {
        let turn = if enter_own_network()? { None } else { Some(turn()?) };
        let mut camera = Self { options, process: None, _turn: turn };
        camera.restart()?;
        Ok(camera)
    }

    /// Kills it and starts it again, as after a power cycle.
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

    /// Kills it, as after a loss of power.
    pub fn kill(&mut self) {
        if let Some(mut process) = self.process.take() {
            // It may already have ended.
            let _ = process.kill();
            let _ = process.wait();
        }
    }

    /// Suspends it: it neither answers nor sends until [`FakeCamera::resume`].
    pub fn hold(&self) {
        self.signal(Signal::SIGSTOP);
    }

    /// Resumes it.
    pub fn resume(&self) {
        self.signal(Signal::SIGCONT);
    }

    /// Whether it has ended.
    pub fn has_ended(&self) -> bool {
        self.process.is_none()
    }

    /// Process id, or `None` if it has ended.
    pub fn pid(&self) -> Option<u32> {
        self.process.as_ref().map(Child::id)
    }

    fn signal(&self, signal: Signal) {
        if let Some(pid) = self.pid().and_then(|pid| i32::try_from(pid).ok()) {
            // It may already have ended.
            let _ = kill(Pid::from_raw(pid), signal);
        }
    }
}

impl Drop for FakeCamera {
    fn drop(&mut self) {
        self.resume();
        self.kill();
    }
}

/// Moves the calling thread to a network namespace in which there is nothing but the loopback device, and returns whether
/// that is permitted.
fn enter_own_network() -> std::io::Result<bool> {
    let has_ip = Command::new("ip").arg("-V").stdout(Stdio::null()).status().is_ok_and(|status| status.success());
    if !has_ip {
        return Ok(false);
    }
    match unshare(CloneFlags::CLONE_NEWNET) {
        Err(Errno::EPERM) => return Ok(false),
        entered => entered?,
    }
    let status = Command::new("ip").args(["link", "set", "lo", "up"]).status()?;
    if status.success() { Ok(true) } else { Err(std::io::Error::other(format!("ip link set lo up: {status}"))) }
}

/// Waits until no other test uses a camera.
fn turn() -> std::io::Result<Flock<File>> {
    let file = File::create(std::env::temp_dir().join("sheaf-fake-gige-camera.lock"))?;
    Flock::lock(file, FlockArg::LockExclusive).map_err(|(_, error)| error.into())
}
