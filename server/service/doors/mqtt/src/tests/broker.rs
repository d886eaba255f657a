//! A mosquitto of its own for every test.

use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tempfile::TempDir;

/// Limit for everything that happens soon.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// A broker on a free port of this computer; ends with its value.
pub struct Broker {
    pub port: u16,
    pub folder: TempDir,
    process: Option<Child>,
}

impl Broker {
    /// With anybody allowed to do anything.
    pub fn start() -> Self {
        Self::start_with("allow_anonymous true")
    }

    /// With these lines after those of the listener.
    pub fn start_with(lines: &str) -> Self {
        Self::start_in(tempfile::tempdir().unwrap(), lines)
    }

    /// With files that are already in its folder.
    pub fn start_in(folder: TempDir, lines: &str) -> Self {
        let port = free_port();
        // `user`: started as root, mosquitto would change to a user who may not write to the folder.
        let configuration = format!("listener {port} 127.0.0.1\nuser root\n{lines}\n");
        std::fs::write(folder.path().join("mosquitto.conf"), configuration).unwrap();
        let mut broker = Self { port, folder, process: None };
        broker.start_again();
        broker
    }

    /// On the same port, after it was killed.
    pub fn start_again(&mut self) {
        let log = std::fs::File::options().create(true).append(true).open(self.log_file()).unwrap();
        let process = Command::new(program("mosquitto"))
            .arg("-c")
            .arg(self.folder.path().join("mosquitto.conf"))
            .stdout(Stdio::null())
            .stderr(log)
            .spawn();
        let mut process = process.unwrap();
        let begun = Instant::now();
        while TcpStream::connect(("127.0.0.1", self.port)).is_err() {
            if let Some(status) = process.try_wait().unwrap() {
                panic!("mosquitto ended with {status}: {}", self.log());
            }
            assert!(begun.elapsed() < PATIENCE, "mosquitto does not listen");
            std::thread::sleep(Duration::from_millis(10));
        }
        self.process = Some(process);
    }

    /// Lets it store what it has to, and end.
    pub fn stop(&mut self) {
        self.end(Signal::SIGTERM);
    }

    /// Ends it without any chance to store or send anything.
    pub fn kill(&mut self) {
        self.end(Signal::SIGKILL);
    }

    fn end(&mut self, signal: Signal) {
        if let Some(mut process) = self.process.take() {
            kill(Pid::from_raw(i32::try_from(process.id()).unwrap()), signal).unwrap();
            process.wait().unwrap();
        }
    }

    pub fn url(&self) -> String {
        format!("mqtt://127.0.0.1:{}", self.port)
    }

    /// What it has logged.
    pub fn log(&self) -> String {
        std::fs::read_to_string(self.log_file()).unwrap_or_default()
    }

    fn log_file(&self) -> PathBuf {
        self.folder.path().join("mosquitto.log")
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A port that nobody listens on.
pub fn free_port() -> u16 {
    TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port()
}

/// A program of the packages mosquitto and mosquitto-clients; the broker is in a folder that users rarely search.
pub fn program(name: &str) -> PathBuf {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    folders.push("/usr/sbin".into());
    let found = folders.iter().map(|folder| folder.join(name)).find(|path: &PathBuf| Path::is_file(path));
    let package = if name == "mosquitto" { "mosquitto" } else { "mosquitto-clients" };
    found.unwrap_or_else(|| panic!("{name} is missing: install the Debian package {package}"))
}
