//! What simulated controllers share: a terminal, a thread in real time, a witness, and an axis that takes time.
//!
//! A firmware is a [`Firmware`]: bytes and time come in, bytes come out, and what there really was goes to the witness.
//! [`Simulator`] runs it behind a pseudo-terminal and lets it fail on request.

mod axis;
mod terminal;
mod witness;

pub use axis::SimulatedAxis;
use terminal::Terminal;
pub use witness::{Entry, Happening, Witness};

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

use crate::time::{self, Thread};

/// A simulated firmware, its motor and its light.
pub trait Firmware: Send + 'static {
    /// What it is made from.
    type Config: Send + 'static;
    /// What can be asked of it besides what every firmware can.
    type Event: Send + 'static;

    /// Powered off; [`Firmware::power_on`] follows.
    fn new(config: Self::Config, witness: Witness) -> Self;
    /// Power comes: it starts, and says so if its kind does.
    fn power_on(&mut self, now: Instant);
    /// Power goes: everything rests, and is dark.
    fn power_off(&mut self, now: Instant);
    /// Bytes from the computer.
    fn hear(&mut self, bytes: &[u8], now: Instant);
    /// Time passes.
    fn pass(&mut self, now: Instant);
    /// What it has said.
    fn take_outgoing(&mut self) -> Vec<u8>;
    /// Something happens to it.
    fn happen(&mut self, event: Self::Event, now: Instant);
    /// What happened to it and lasts is over.
    fn repair(&mut self) {}
}

/// A fault of the line's other end; it lasts until another or [`Simulator::repair`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFault {
    /// Hears and does everything, and sends nothing.
    Silence,
    /// Sends nonsense instead of its answers.
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

/// A firmware behind a pseudo-terminal, in real time. Dropping it ends it.
pub struct Simulator<F: Firmware> {
    place: PathBuf,
    witness: Witness,
    requests: Sender<(Request<F>, Sender<()>)>,
    thread: Option<Thread<()>>,
}

impl<F: Firmware> Simulator<F> {
    /// Powers a controller on; `place` becomes a link to its terminal, also after it was unplugged and came back.
    /// Its record goes to `witness_file` too, where one is named.
    ///
    /// # Errors
    /// If no terminal, link, file or thread can be made.
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

    /// Where the driver finds it.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Its record.
    pub fn witness(&self) -> &Witness {
        &self.witness
    }

    /// Lets it fail.
    pub fn fail(&self, fault: LineFault) {
        self.request(Request::Fault(Some(fault)));
    }

    /// Ends what [`Simulator::fail`] began.
    pub fn repair(&self) {
        self.request(Request::Fault(None));
    }

    /// Lets something happen to the firmware.
    pub fn happen(&self, event: F::Event) {
        self.request(Request::Happen(event));
    }

    /// Lets it hear what the driver did not say, as from a panel or from an owner that died since.
    pub fn hear(&self, bytes: &[u8]) {
        self.request(Request::Hear(bytes.to_vec()));
    }

    /// Switches it off and on.
    pub fn restart(&self) {
        self.request(Request::Restart);
    }

    /// Pulls the cable, which is its power too.
    pub fn unplug(&self) {
        self.request(Request::Unplug);
    }

    /// Puts the cable in again.
    pub fn replug(&self) {
        self.request(Request::Replug(None));
    }

    /// Puts another controller at the same place.
    pub fn replug_as(&self, config: F::Config) {
        self.request(Request::Replug(Some(config)));
    }

    /// Comes back when the request has taken effect.
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

/// Longest sleep of the simulation: how soon time's effects show.
const PERIOD: Duration = Duration::from_millis(1);

/// Nonsense that is sent instead of a line.
const NONSENSE: &[u8] = b"\xf7\x03@0#1 X:\x004..\n";

struct Machine<F: Firmware> {
    firmware: F,
    witness: Witness,
    place: PathBuf,
    terminal: Option<Terminal>,
    fault: Option<LineFault>,
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
            self.hear();
            self.firmware.pass(time::now());
            self.speak();
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
            Request::Happen(event) => self.firmware.happen(event, now),
            Request::Hear(bytes) => self.firmware.hear(&bytes, now),
            Request::Restart => {
                self.firmware.power_off(now);
                self.firmware.power_on(now);
            }
            Request::Unplug => {
                self.firmware.power_off(now);
                self.terminal = None;
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

    /// Waits for bytes, a little; what came is heard at once.
    fn hear(&mut self) {
        let Some(terminal) = &mut self.terminal else { return time::sleep(PERIOD) };
        let mut buffer = [0; 256];
        let n = terminal.read(&mut buffer, PERIOD);
        if n > 0 {
            let now = time::now();
            for &byte in &buffer[..n] {
                self.witness.saw(now, Happening::Byte(byte));
            }
            self.firmware.hear(&buffer[..n], now);
        }
    }

    fn speak(&mut self) {
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
