//! A controller with GRBL, grblHAL or FluidNC, one axis and a laser, simulated in real time behind a pseudo-terminal.
//!
//! For tests of the driver and of the service: it speaks the firmware's dialogue, its axis takes time, it fails on
//! request, and its [`Witness`] tells what light and motion there really was and when each byte came. It can outlive
//! the process under test, with its record in a file and its terminal at a known place.

#[cfg(test)]
mod cells;
mod dialect;
mod firmware;
mod motion;

pub use crate::simulator::{Entry, Happening, Witness};
pub use dialect::Dialect;

use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

use crate::simulator::Terminal;
use firmware::{BUSY_PERIOD, Firmware};

/// The simulated machine. Positions are the machine's own: 0 at the switch, negative elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatorConfig {
    /// Its start-up line.
    pub banner: String,
    /// Text stored by `$I=`.
    pub name: String,
    /// Which firmware it is.
    pub dialect: Dialect,
    /// Letter of the axis.
    pub axis: char,
    /// `$100` and so on.
    pub steps_per_mm: f64,
    /// `$110` and so on, mm/s.
    pub max_speed_mm_s: f64,
    /// `$120` and so on.
    pub acceleration_mm_s2: f64,
    /// `$130` and so on.
    pub max_travel_mm: f64,
    /// `$27`.
    pub pull_off_mm: f64,
    /// Speed of homing.
    pub homing_mm_s: f64,
    /// `$30`.
    pub max_spindle: f64,
    /// How long `ok` waits after the spindle word changed, as for a spindle that spins up.
    pub spindle_delay: Duration,
    /// `$32`.
    pub laser_mode: u8,
    /// `$10`.
    pub report_mask: u32,
    /// `$39` of grblHAL.
    pub hears_in_commands: bool,
    /// Bit 0 of `$22`.
    pub homing: bool,
    /// Bit 2 of `$22` of grblHAL: nothing but homing before homing.
    pub homing_lock: bool,
    /// Whether homing finds its switch.
    pub switch_works: bool,
    /// `$62` of grblHAL.
    pub sleeps: bool,
    /// `$20`.
    pub soft_limits: bool,
    /// `$13`.
    pub inches: bool,
    /// Where the axis is when it is switched on, by the simulation's own knowledge.
    pub start_at_mm: f64,
}

impl Default for SimulatorConfig {
    /// [`SimulatorConfig::of`] GRBL 1.1h.
    fn default() -> Self {
        Self::of(Dialect::Grbl)
    }
}

impl SimulatorConfig {
    /// A small stage with switches: 100 mm of travel, 200 mm/s, 5 m/s², homed within tens of milliseconds.
    pub fn of(dialect: Dialect) -> Self {
        Self {
            banner: dialect.banner().to_owned(),
            name: "simulated stage".to_owned(),
            dialect,
            axis: 'X',
            steps_per_mm: 400.0,
            max_speed_mm_s: 200.0,
            acceleration_mm_s2: 5000.0,
            max_travel_mm: 100.0,
            pull_off_mm: 1.0,
            homing_mm_s: 200.0,
            max_spindle: 1000.0,
            spindle_delay: Duration::ZERO,
            laser_mode: 1,
            // As they are delivered.
            report_mask: if dialect == Dialect::GrblHal { 511 } else { 1 },
            hears_in_commands: true,
            homing: true,
            homing_lock: false,
            switch_works: true,
            sleeps: false,
            soft_limits: true,
            inches: false,
            start_at_mm: -5.0,
        }
    }

    pub(crate) fn axis_idx(&self) -> usize {
        match self.axis {
            'X' => 0,
            'Y' => 1,
            _ => 2,
        }
    }
}

/// A fault on request; it lasts until another or [`GrblSimulator::repair`].
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// Hears and does everything, and sends nothing.
    Silence,
    /// Sends nonsense instead of its answers.
    Garbage,
    /// Acknowledges no line, but reports.
    NoAcknowledgement,
    /// The axis stops on its way, and the firmware waits for it.
    Stall,
    /// The emergency stop is pressed: no reset is heard.
    EmergencyStop,
}

/// What the simulation is asked for.
enum Request {
    Fault(Option<Fault>),
    Alarm(u32),
    Restart,
    Stray,
    Override(u8),
    Door(bool),
    Unplug,
    Replug(Option<Box<SimulatorConfig>>),
    End,
}

/// See the module. Dropping it ends it.
pub struct GrblSimulator {
    place: PathBuf,
    witness: Witness,
    requests: Sender<(Request, Sender<()>)>,
    thread: Option<JoinHandle<()>>,
}

impl GrblSimulator {
    /// Powers a controller on; `place` becomes a link to its terminal, also after it was unplugged and came back.
    /// Its record goes to `witness_file` too, where one is named.
    ///
    /// # Errors
    /// If no terminal, link, file or thread can be made.
    pub fn start(config: SimulatorConfig, place: &Path, witness_file: Option<&Path>) -> std::io::Result<Self> {
        let witness = Witness::new(witness_file)?;
        let terminal = Terminal::open(place)?;
        let (requests, received) = channel();
        let mut machine = Machine {
            firmware: Firmware::new(config, witness.clone(), Instant::now()),
            witness: witness.clone(),
            place: place.to_owned(),
            terminal: Some(terminal),
        };
        let thread =
            std::thread::Builder::new().name("grbl-simulator".to_owned()).spawn(move || machine.run(&received))?;
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
    pub fn fail(&self, fault: Fault) {
        self.request(Request::Fault(Some(fault)));
    }

    /// Ends what [`GrblSimulator::fail`] began.
    pub fn repair(&self) {
        self.request(Request::Fault(None));
    }

    /// Raises an alarm.
    pub fn alarm(&self, code: u32) {
        self.request(Request::Alarm(code));
    }

    /// Switches it off and on: the reset banner comes, also in the middle of a move.
    pub fn restart(&self) {
        self.request(Request::Restart);
    }

    /// Somebody turns an override at the machine: a real-time byte that did not come over this line.
    pub fn turn_override(&self, byte: u8) {
        self.request(Request::Override(byte));
    }

    /// Lets the laser shine though nobody asked for it.
    pub fn shine_unasked(&self) {
        self.request(Request::Stray);
    }

    /// Opens or closes the door's switch; the door's own stop is the byte 0x84.
    pub fn set_door_open(&self, open: bool) {
        self.request(Request::Door(open));
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
    pub fn replug_as(&self, config: SimulatorConfig) {
        self.request(Request::Replug(Some(Box::new(config))));
    }

    /// Comes back when the request has taken effect.
    fn request(&self, request: Request) {
        let (done, is_done) = channel();
        // The thread ends only when this is dropped.
        self.requests.send((request, done)).ok();
        is_done.recv().ok();
    }
}

impl Drop for GrblSimulator {
    fn drop(&mut self) {
        self.request(Request::End);
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

/// Longest sleep of the simulation at rest: how soon a request is heard.
const RESTING_PERIOD: Duration = Duration::from_millis(5);

/// Nonsense that is sent instead of a line.
const NONSENSE: &[u8] = b"\xf7\x03<I#le|MP\x00\n";

struct Machine {
    firmware: Firmware,
    witness: Witness,
    place: PathBuf,
    terminal: Option<Terminal>,
}

impl Machine {
    fn run(&mut self, requests: &Receiver<(Request, Sender<()>)>) {
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
            self.firmware.pass(Instant::now());
            self.speak();
        }
    }

    fn request(&mut self, request: Request) {
        let now = Instant::now();
        match request {
            Request::Fault(fault) => {
                if fault == Some(Fault::Stall) {
                    self.firmware.stall(now);
                }
                self.firmware.fault = fault;
            }
            Request::Alarm(code) => self.firmware.raise(code, now),
            Request::Restart => self.firmware.power_cycle(now),
            Request::Override(byte) => self.firmware.change_override(byte, now),
            Request::Stray => self.firmware.shine_unasked(now),
            Request::Door(open) => self.firmware.set_door_open(open),
            Request::Unplug => {
                self.firmware.power_off(now);
                self.terminal = None;
            }
            Request::Replug(config) => {
                if let Some(config) = config {
                    self.firmware.power_off(now);
                    self.firmware = Firmware::new(*config, self.witness.clone(), now);
                }
                self.terminal = Terminal::open(&self.place).ok();
                self.firmware.fault = None;
                self.firmware.power_cycle(now);
            }
            Request::End => {}
        }
    }

    /// Waits for bytes, a little; what came is heard at once.
    fn hear(&mut self) {
        let period = if self.firmware.busy() { BUSY_PERIOD } else { RESTING_PERIOD };
        let Some(terminal) = &mut self.terminal else { return std::thread::sleep(period) };
        let mut waits = [PollFd::new(terminal.controller.as_fd(), PollFlags::POLLIN)];
        let timeout = PollTimeout::try_from(period).unwrap_or(PollTimeout::ZERO);
        if poll(&mut waits, timeout).unwrap_or(0) == 0 {
            return;
        }
        let mut buffer = [0; 256];
        if let Ok(n) = terminal.controller.read(&mut buffer) {
            self.firmware.hear(&buffer[..n], Instant::now());
        }
    }

    fn speak(&mut self) {
        let said = self.firmware.take_outgoing();
        let Some(terminal) = &mut self.terminal else { return };
        let sent = match self.firmware.fault {
            Some(Fault::Silence) => Vec::new(),
            Some(Fault::Garbage) if !said.is_empty() => NONSENSE.to_vec(),
            Some(Fault::NoAcknowledgement) => without_acknowledgements(&said),
            _ => said,
        };
        if !sent.is_empty() {
            // Nobody may be listening.
            terminal.controller.write_all(&sent).ok();
        }
    }
}

fn without_acknowledgements(said: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(said);
    let kept = text.split_inclusive('\n').filter(|line| line.trim() != "ok");
    kept.collect::<String>().into_bytes()
}
