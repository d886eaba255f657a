//! Common parts of the simulated controllers: a terminal, a thread in real time, a witness, and an axis that takes
//! time.
//!
//! A firmware implements [`Firmware`]: it takes bytes and time, produces bytes, and records the real light and motion
//! in the witness. [`Simulator`] runs it behind a pseudo-terminal and injects faults on request.

mod axis;
mod terminal;
mod witness;

pub use axis::SimulatedAxis;
use terminal::Terminal;
pub use witness::{Entry, Witness, WitnessEvent};

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
    fn new(config: Self::Config, witness: Witness) -> Self;
    /// Power on: it starts, with a banner if it has one.
    fn power_on(&mut self, now: Instant);
    /// Power off: motion and laser off.
    fn power_off(&mut self, now: Instant);
    /// Takes bytes from the computer.
    fn receive(&mut self, bytes: &[u8], now: Instant);
    /// Advances the time.
    fn pass(&mut self, now: Instant);
    /// Returns its output.
    fn take_outgoing(&mut self) -> Vec<u8>;
    /// Handles an event.
    fn trigger_event(&mut self, event: Self::Event, now: Instant);
    /// Ends a lasting event.
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
    Happen(F::Event),
    Hear(Vec<u8>),
    Restart,
    Unplug,
    Replug(Option<F::Config>),
    End,
}

/// A firmware behind a pseudo-terminal, in real time. Dropping it ends the simulation.
pub struct Simulator<F: Firmware> {
    place: PathBuf,
    witness: Witness,
    requests: Sender<(Request<F>, Sender<()>)>,
    thread: Option<Thread<()>>,
}

impl<F: Firmware> Simulator<F> {
    /// Powers a controller on; `place` becomes a link to its terminal, also after it was unplugged and plugged in
    /// again. Its record is also written to `witness_file`, if given.
    ///
    /// # Errors
    /// If no terminal, link, file or thread can be created.
    pub fn start(config: F::Config, place: &Path, witness_file: Option<&Path>) -> std::io::Result<Self> {
        let witness = Witness::new(witness_file)?;
        let terminal = Terminal::open(place)?;
        let (requests, received) = channel();
        let mut machine = Machine {
            firmware: F::new(config, witness.clone()),
            witness: witness.clone(),
            place: place.to_owned(),
            terminal: Some(terminal),
            fault: None,
        };
        machine.firmware.power_on(time::now());
        let thread = time::spawn("simulator", move || machine.run(&received))?;
        Ok(Self { place: place.to_owned(), witness, requests, thread: Some(thread) })
    }

    /// Path for the driver.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Its record.
    pub fn witness(&self) -> &Witness {
        &self.witness
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
        self.request(Request::Happen(event));
    }

    /// Sends it bytes that do not come from the driver, as from a panel or from a dead owner.
    pub fn receive(&self, bytes: &[u8]) {
        self.request(Request::Hear(bytes.to_vec()));
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
const NONSENSE: &[u8] = b"\xf7\x03@0#1 X:\x004..\n";

struct Machine<F: Firmware> {
    firmware: F,
    witness: Witness,
    place: PathBuf,
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
            self.firmware.pass(time::now());
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
            Request::Happen(event) => self.firmware.trigger_event(event, now),
            Request::Hear(bytes) => self.firmware.receive(&bytes, now),
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
                    self.firmware = F::new(config, self.witness.clone());
                }
                self.terminal = Terminal::open(&self.place).ok();
                self.fault = None;
                self.firmware.power_on(now);
            }
            Request::End => {}
        }
    }

    /// Takes the link away before the terminal ends: its number is then free, and the next terminal of any process gets it.
    fn disconnect(&mut self) {
        if self.place.is_symlink() {
            // A link that stays leads nowhere, or to a stranger; the driver then names what it finds.
            let _ = std::fs::remove_file(&self.place);
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
                self.witness.saw(now, WitnessEvent::Byte(byte));
            }
            self.firmware.receive(&buffer[..n], now);
        }
    }

    fn send_outgoing(&mut self) {
        let said = self.firmware.take_outgoing();
        let Some(terminal) = &mut self.terminal else { return };
        let sent = match self.fault {
            Some(LineFault::Silence) => Vec::new(),
            Some(LineFault::Garbage) if !said.is_empty() => NONSENSE.to_vec(),
            _ => said,
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

    fn simulator(place: &Path) -> Simulator<MarlinFirmware> {
        Simulator::start(SimulatorConfig::default(), place, None).unwrap()
    }

    #[test]
    fn the_place_of_an_unplugged_controller_never_leads_to_another_ones_terminal() {
        let folder = tempfile::tempdir().unwrap();
        let places = ["one", "other"].map(|name| folder.path().join(name));
        let one = simulator(&places[0]);
        one.unplug();
        // It gets the number of the terminal that was just closed, unless another process was faster.
        let other = simulator(&places[1]);
        let mut owner = PortLine::new(other.place().to_str().unwrap(), 115_200);
        owner.reopen().unwrap();
        let mut line = PortLine::new(one.place().to_str().unwrap(), 115_200);
        let refused = line.reopen();
        let Err(SerialLineError::Unopened { cause, .. }) = &refused else { panic!("{refused:?}") };
        assert!(!cause.to_string().contains("lock"), "it found the terminal of another: {cause}");
        one.replug();
        line.reopen().unwrap();
        drop(one);
        assert!(!places[0].is_symlink());
    }
}
