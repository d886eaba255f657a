//! Common parts of the simulated controllers: a terminal, a thread in real time, an event log, and an axis that takes
//! time.
//!
//! A firmware implements [`Firmware`]: it takes bytes and time, produces bytes, and records the real light and motion
//! in the event log. [`Simulator`] runs it behind a pseudo-terminal and injects faults on request.

mod axis;
mod event_log;
mod terminal;

pub use axis::SimulatedAxis;
pub use event_log::{Entry, EventLog, LogEvent};
use terminal::Terminal;

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

use crate::time::{self, Thread};

/// A simulated firmware with its motor and laser.
pub trait Firmware: Send + 'static {
    /// Its configuration.
    type Config: Send + 'static;
    /// Its events, in addition to the common ones.
    type Event: Send + 'static;

    /// Powered off; [`Firmware::power_on`] follows.
    fn new(config: Self::Config, event_log: EventLog) -> Self;
    /// Power on: it starts, with a banner if it has one.
    fn power_on(&mut self, now: Instant);
    /// Power off: motion and laser off.
    fn power_off(&mut self, now: Instant);
    /// Takes bytes from the computer.
    fn receive(&mut self, bytes: &[u8], now: Instant);
    /// Advances the time.
    fn advance_time(&mut self, now: Instant);
    /// Returns its output.
    fn take_outgoing(&mut self) -> Vec<u8>;
    /// Handles an event.
    fn trigger_event(&mut self, event: Self::Event, now: Instant);
    /// Ends an active event.
    fn repair(&mut self) {}
}

/// A fault of the line; it lasts until another one or [`Simulator::repair`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFault {
    /// Receives and executes everything, and sends nothing.
    Silence,
    /// Sends garbage instead of its answers.
    Garbage,
}

enum Request<F: Firmware> {
    Fault(Option<LineFault>),
    Trigger(F::Event),
    Receive(Vec<u8>),
    Restart,
    Unplug,
    Replug(Option<F::Config>),
    End,
}

/// A firmware behind a pseudo-terminal, in real time. Dropping it ends the simulation.
pub struct Simulator<F: Firmware> {
    port_name: PathBuf,
    event_log: EventLog,
    requests: Sender<(Request<F>, Sender<()>)>,
    thread: Option<Thread<()>>,
}

impl<F: Firmware> Simulator<F> {
    /// Powers a controller on; `port_name` becomes a link to its terminal, also after it was unplugged and plugged in
    /// again. Its record is also written to `event_log_file`, if given.
    ///
    /// # Errors
    /// If no terminal, link, file or thread can be created.
    pub fn start(config: F::Config, port_name: &Path, event_log_file: Option<&Path>) -> std::io::Result<Self> {
        let event_log = EventLog::new(event_log_file)?;
        let terminal = Terminal::open(port_name)?;
        let (requests, received) = channel();
        let mut machine = Machine {
            firmware: F::new(config, event_log.clone()),
            event_log: event_log.clone(),
            port_name: port_name.to_owned(),
            terminal: Some(terminal),
            fault: None,
        };
        machine.firmware.power_on(time::now());
        let thread = time::spawn("simulator", move || machine.run(&received))?;
        Ok(Self { port_name: port_name.to_owned(), event_log, requests, thread: Some(thread) })
    }

    /// Path for the driver.
    pub fn port_name(&self) -> &Path {
        &self.port_name
    }

    /// Its record.
    pub fn event_log(&self) -> &EventLog {
        &self.event_log
    }

    /// Starts a fault.
    pub fn fail(&self, fault: LineFault) {
        self.request(Request::Fault(Some(fault)));
    }

    /// Ends the fault started by [`Simulator::fail`].
    pub fn repair(&self) {
        self.request(Request::Fault(None));
    }

    /// Triggers an event.
    pub fn trigger_event(&self, event: F::Event) {
        self.request(Request::Trigger(event));
    }

    /// Sends it bytes that do not come from the driver, as from a panel or a program that was terminated.
    pub fn receive(&self, bytes: &[u8]) {
        self.request(Request::Receive(bytes.to_vec()));
    }

    /// Power-cycles it.
    pub fn restart(&self) {
        self.request(Request::Restart);
    }

    /// Unplugs the cable, which also supplies its power.
    pub fn unplug(&self) {
        self.request(Request::Unplug);
    }

    /// Plugs the cable in again.
    pub fn replug(&self) {
        self.request(Request::Replug(None));
    }

    /// Connects another controller at the same path.
    pub fn replug_as(&self, config: F::Config) {
        self.request(Request::Replug(Some(config)));
    }

    /// Returns when the request has taken effect.
    fn request(&self, request: Request<F>) {
        let (done, is_done) = channel();
        // The thread ends only when this is dropped.
        self.requests.send((request, done)).ok();
        while time::is_simulated() && is_done.try_recv() == Err(TryRecvError::Empty) {
            time::sleep(PERIOD);
        }
        is_done.recv().ok();
    }
}

impl<F: Firmware> Drop for Simulator<F> {
    fn drop(&mut self) {
        self.request(Request::End);
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

/// Longest sleep of the simulation, which limits its time resolution.
const PERIOD: Duration = Duration::from_millis(1);

/// Garbage sent instead of a line.
const GARBAGE: &[u8] = b"\xf7\x03@0#1 X:\x004..\n";

struct Machine<F: Firmware> {
    firmware: F,
    event_log: EventLog,
    port_name: PathBuf,
    terminal: Option<Terminal>,
    fault: Option<LineFault>,
}

impl<F: Firmware> Drop for Machine<F> {
    fn drop(&mut self) {
        self.disconnect();
    }
}

impl<F: Firmware> Machine<F> {
    fn run(&mut self, requests: &Receiver<(Request<F>, Sender<()>)>) {
        loop {
            match requests.try_recv() {
                Ok((Request::End, _)) | Err(TryRecvError::Disconnected) => return,
                Ok((request, done)) => {
                    self.request(request);
                    done.send(()).ok();
                }
                Err(TryRecvError::Empty) => {}
            }
            self.receive();
            self.firmware.advance_time(time::now());
            self.send_outgoing();
        }
    }

    fn request(&mut self, request: Request<F>) {
        let now = time::now();
        match request {
            Request::Fault(fault) => {
                if fault.is_none() {
                    self.firmware.repair();
                }
                self.fault = fault;
            }
            Request::Trigger(event) => self.firmware.trigger_event(event, now),
            Request::Receive(bytes) => self.firmware.receive(&bytes, now),
            Request::Restart => {
                self.firmware.power_off(now);
                self.firmware.power_on(now);
            }
            Request::Unplug => {
                self.firmware.power_off(now);
                self.disconnect();
            }
            Request::Replug(config) => {
                self.firmware.power_off(now);
                if let Some(config) = config {
                    self.firmware = F::new(config, self.event_log.clone());
                }
                self.terminal = Terminal::open(&self.port_name).ok();
                self.fault = None;
                self.firmware.power_on(now);
            }
            Request::End => {}
        }
    }

    /// Takes the link away before the terminal ends: its number is then free, and the next terminal of any process gets
    /// it.
    fn disconnect(&mut self) {
        if self.port_name.is_symlink() {
            // A remaining link is dangling or leads to another device; the driver then reports what it finds.
            let _ = std::fs::remove_file(&self.port_name);
        }
        self.terminal = None;
    }

    /// Waits briefly for bytes and processes them.
    fn receive(&mut self) {
        let Some(terminal) = &mut self.terminal else { return time::sleep(PERIOD) };
        let mut buffer = [0; 256];
        let n = terminal.read(&mut buffer, PERIOD);
        if n > 0 {
            let now = time::now();
            for &byte in &buffer[..n] {
                self.event_log.record(now, LogEvent::Byte(byte));
            }
            self.firmware.receive(&buffer[..n], now);
        }
    }

    fn send_outgoing(&mut self) {
        let output = self.firmware.take_outgoing();
        let Some(terminal) = &mut self.terminal else { return };
        let sent = match self.fault {
            Some(LineFault::Silence) => Vec::new(),
            Some(LineFault::Garbage) if !output.is_empty() => GARBAGE.to_vec(),
            _ => output,
        };
        if !sent.is_empty() {
            terminal.write(&sent);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lines::serial_line::{PortLine, SerialLine as _, SerialLineError};
    use crate::marlin_simulator::{MarlinFirmware, SimulatorConfig};

    fn simulator(port_name: &Path) -> Simulator<MarlinFirmware> {
        Simulator::start(SimulatorConfig::default(), port_name, None).unwrap()
    }

    #[test]
    fn the_port_of_an_unplugged_controller_never_leads_to_another_terminal() {
        let folder = tempfile::tempdir().unwrap();
        let places = ["one", "other"].map(|name| folder.path().join(name));
        let one = simulator(&places[0]);
        one.unplug();
        // It gets the number of the terminal that was just closed, unless another process was faster.
        let other = simulator(&places[1]);
        let mut owner = PortLine::new(other.port_name().to_str().unwrap(), 115_200);
        owner.reopen().unwrap();
        let mut line = PortLine::new(one.port_name().to_str().unwrap(), 115_200);
        let refused = line.reopen();
        let Err(SerialLineError::OpenFailed { cause, .. }) = &refused else { panic!("{refused:?}") };
        assert!(!cause.to_string().contains("lock"), "it found the terminal of another: {cause}");
        one.replug();
        line.reopen().unwrap();
        drop(one);
        assert!(!places[0].is_symlink());
    }
}
