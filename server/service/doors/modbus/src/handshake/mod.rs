//! The handshake with a PLC as a state machine: requests and outcomes in, registers and orders out. Without network,
//! clock and threads; the caller holds one lock.
//!
//! - A *change* of `command_seq` executes the command. The first value after a start does not: it may be one that was
//!   executed before, and nothing may move twice. Stop is the exception: in doubt, it stops.
//! - A result stays shown until the PLC writes its number to `result_ack`. Then `valid` is 0 until the PLC has read that,
//!   and the next result is shown. Reading acknowledges nothing.

pub mod order;
pub mod params;
pub mod results;
#[cfg(test)]
mod tests;

use std::net::IpAddr;
use std::time::Instant;

use app::doors::{MachineState, OperationalState};

use crate::codes::{AckCode, Command, Exception, StatusBit};
use crate::handshake::order::{Inspection, Order, Task};
use crate::handshake::params::{HEARTBEAT_STEP, PLC_SILENT, RESULTS_MAY_WAIT};
use crate::handshake::results::Results;
use crate::line::{JobEnd, Station, TriggeredPart};
use crate::registers::map::{
    ACK_CODE, ACK_SEQ, COMMAND, COMMAND_SEQ, ERROR, HEARTBEAT, HOLDING_WORDS, INPUT_WORDS, MAP_VERSION, MIRROR,
    PLC_HEARTBEAT, PREPARED, QUEUED, RESULT_ACK, Register, STATE, STATUS, TRIGGER_ORDER, TRIGGER_RECIPE,
    TRIGGER_SERIAL, Table, VERSION, WORD_ORDER, WORD_ORDER_TEST,
};
use crate::registers::value::Value;

/// A request or its circumstances.
#[derive(Debug, Clone, Copy)]
pub struct Circumstances {
    /// Address of the client.
    pub from: IpAddr,
    /// The station.
    pub station: Station,
    /// Time.
    pub now: Instant,
}

/// The state of the handshake.
pub struct Handshake {
    /// Whether a PLC may write.
    writes: bool,
    started: Instant,
    holding: [u16; HOLDING_WORDS],
    /// When the heartbeat of the PLC changed last.
    plc_seen: Option<Instant>,
    /// Set with the first value.
    command_seq: Option<u16>,
    ack: (u16, AckCode),
    inspection: Inspection,
    /// How the last one ended.
    ended: JobEnd,
    /// Number of the prepared recipe.
    prepared: u32,
    /// The results.
    pub results: Results,
}

impl Handshake {
    /// After a start.
    pub fn new(writes: bool, now: Instant) -> Self {
        Self {
            writes,
            started: now,
            holding: [0; HOLDING_WORDS],
            plc_seen: None,
            command_seq: None,
            ack: (0, AckCode::Restarted),
            inspection: Inspection::None,
            ended: JobEnd::Finished,
            prepared: 0,
            results: Results::default(),
        }
    }

    /// Reads registers.
    ///
    /// # Errors
    /// Some of them do not exist.
    pub fn read(
        &mut self,
        table: Table,
        address: u16,
        count: u16,
        at: Circumstances,
    ) -> Result<Vec<u16>, Exception> {
        let (first, count) = (usize::from(address), usize::from(count));
        if table == Table::Holding && first < MIRROR {
            let words = self.holding.get(first..first + count).ok_or(Exception::Address)?;
            return Ok(words.to_vec());
        }
        let first = if table == Table::Holding { first - MIRROR } else { first };
        let words = self.image(at).get(first..first + count).ok_or(Exception::Address)?.to_vec();
        if (first..first + count).contains(&STATUS.address) {
            self.results.status_read(at.from);
        }
        Ok(words)
    }

    /// Writes registers, all or none; returns what is to be carried out.
    ///
    /// # Errors
    /// Writes are off, or some registers do not exist.
    pub fn write(&mut self, address: u16, words: &[u16], at: Circumstances) -> Result<Option<Order>, Exception> {
        if !self.writes {
            return Err(Exception::Function);
        }
        let first = usize::from(address);
        let heartbeat = PLC_HEARTBEAT.number(&self.holding);
        let place = self.holding.get_mut(first..first + words.len()).ok_or(Exception::Address)?;
        place.copy_from_slice(words);
        let is_written = |register: Register| (first..first + words.len()).contains(&register.address);
        if PLC_HEARTBEAT.number(&self.holding) != heartbeat {
            self.plc_seen = Some(at.now);
        }
        if is_written(RESULT_ACK) {
            self.results.acknowledge(RESULT_ACK.number(&self.holding), at.from, at.now);
        }
        Ok(if is_written(COMMAND_SEQ) { self.command(at) } else { None })
    }

    /// Executes the command if its number has changed.
    fn command(&mut self, at: Circumstances) -> Option<Order> {
        let seq = COMMAND_SEQ.number(&self.holding) as u16;
        let is_stop = Command::numbered(COMMAND.number(&self.holding)) == Some(Command::Stop);
        match self.command_seq.replace(seq) {
            None if !is_stop => {
                self.ack = (seq, AckCode::Restarted);
                return None;
            }
            Some(before) if before == seq => return None,
            None | Some(_) => {}
        }
        match self.task(at) {
            Ok(Some(task)) => Some(Order { seq, task }),
            Ok(None) => {
                self.ack = (seq, AckCode::Accepted);
                None
            }
            Err(code) => {
                self.ack = (seq, code);
                None
            }
        }
    }

    /// What the command asks for; `None` if it is done already.
    fn task(&mut self, at: Circumstances) -> Result<Option<Task>, AckCode> {
        let recipe = TRIGGER_RECIPE.number(&self.holding);
        match Command::numbered(COMMAND.number(&self.holding)) {
            None => Err(AckCode::UnknownCommand),
            Some(Command::None) => Ok(None),
            Some(Command::Trigger) => self.trigger(recipe, at).map(Some),
            Some(Command::Stop) => Ok(Some(Task::Stop)),
            Some(Command::Abort) => Ok(match &mut self.inspection {
                Inspection::None => None,
                Inspection::Requested { aborted } => {
                    *aborted = true;
                    None
                }
                Inspection::Accepted(job_id) => Some(Task::Abort { job_id: job_id.clone() }),
            }),
            Some(Command::Prepare) if recipe == 0 => Err(AckCode::NoRecipe),
            Some(Command::Prepare) => Ok(Some(Task::Prepare { recipe })),
            Some(Command::Unprepare) => {
                self.prepared = 0;
                Ok(None)
            }
        }
    }

    fn trigger(&mut self, recipe: u32, at: Circumstances) -> Result<Task, AckCode> {
        self.accepts_trigger(at)?;
        let serial = TRIGGER_SERIAL.text(&self.holding).filter(|serial| !serial.is_empty());
        let serial = serial.ok_or(AckCode::BadSerial)?;
        let order = TRIGGER_ORDER.text(&self.holding).ok_or(AckCode::BadSerial)?;
        let order = (!order.is_empty()).then_some(order);
        let recipe = [recipe, self.prepared].into_iter().find(|number| *number != 0);
        self.inspection = Inspection::Requested { aborted: false };
        self.ended = JobEnd::Finished;
        Ok(Task::Trigger(TriggeredPart { recipe, serial, order }))
    }

    fn accepts_trigger(&self, at: Circumstances) -> Result<(), AckCode> {
        match at.station.state {
            MachineState::Halted => return Err(AckCode::Stopped),
            _ if at.station.stopped => return Err(AckCode::Stopped),
            MachineState::Error => return Err(AckCode::Fault),
            _ if self.is_busy(at) => return Err(AckCode::Busy),
            MachineState::Operational(OperationalState::Ready | OperationalState::ContinuousExecution) => {}
            _ => return Err(AckCode::NotReady),
        }
        if self.results.n_behind() >= RESULTS_MAY_WAIT {
            return Err(AckCode::QueueFull);
        }
        if self.is_plc_alive(at.now) { Ok(()) } else { Err(AckCode::PlcSilent) }
    }

    /// The outcome of an order: the job of a trigger, or why it was refused. Returns a job that is to be cancelled,
    /// because the PLC aborted it before it was accepted.
    pub fn finish(&mut self, order: &Order, outcome: &Result<Option<String>, AckCode>) -> Option<String> {
        let mut to_cancel = None;
        match &order.task {
            Task::Trigger { .. } => {
                let aborted = self.inspection == Inspection::Requested { aborted: true };
                let job = outcome.as_ref().ok().and_then(Option::clone);
                to_cancel = job.clone().filter(|_| aborted);
                self.inspection = job.map_or(Inspection::None, Inspection::Accepted);
            }
            Task::Prepare { recipe } if outcome.is_ok() => self.prepared = *recipe,
            Task::Prepare { .. } | Task::Abort { .. } | Task::Stop => {}
        }
        // A later command may have been acknowledged meanwhile.
        if self.command_seq == Some(order.seq) {
            self.ack = (order.seq, outcome.as_ref().err().copied().unwrap_or(AckCode::Accepted));
        }
        to_cancel
    }

    /// A triggered inspection has ended.
    pub fn ended(&mut self, job_id: &str, end: JobEnd) {
        if matches!(&self.inspection, Inspection::Accepted(running) if running == job_id) {
            (self.inspection, self.ended) = (Inspection::None, end);
        }
    }

    /// The input registers.
    fn image(&self, at: Circumstances) -> Vec<u16> {
        let mut image = self.results.image().to_vec();
        let heartbeat = at.now.duration_since(self.started).as_millis() / HEARTBEAT_STEP.as_millis();
        let n_behind = u16::try_from(self.results.n_behind()).unwrap_or(u16::MAX);
        for (register, value) in [
            (VERSION, Value::U16(MAP_VERSION)),
            (HEARTBEAT, Value::U16(heartbeat as u16)),
            (STATE, Value::U16(at.station.state.number())),
            (STATUS, Value::U16(self.status(at))),
            (ACK_SEQ, Value::U16(self.ack.0)),
            (ACK_CODE, Value::U16(self.ack.1.number())),
            (ERROR, Value::U16(self.ended.number())),
            (QUEUED, Value::U16(n_behind)),
            (WORD_ORDER, Value::F32(WORD_ORDER_TEST)),
            (PREPARED, Value::U32(self.prepared)),
        ] {
            register.put(&mut image, value);
        }
        debug_assert_eq!(image.len(), INPUT_WORDS);
        image
    }

    fn status(&self, at: Circumstances) -> u16 {
        let is_set = |bit: &StatusBit| match bit {
            StatusBit::Ready => self.accepts_trigger(at).is_ok(),
            StatusBit::Busy => self.is_busy(at),
            StatusBit::Valid => self.results.is_valid(),
            StatusBit::Fault => at.station.state == MachineState::Error,
            StatusBit::StopLatched => at.station.stopped || at.station.state == MachineState::Halted,
            StatusBit::Overflow => self.results.n_behind() > RESULTS_MAY_WAIT,
            StatusBit::Simulated => at.station.simulated || self.results.is_simulated(),
            StatusBit::PlcAlive => self.is_plc_alive(at.now),
        };
        StatusBit::ALL.iter().filter(|bit| is_set(bit)).fold(0, |status, bit| status | 1 << bit.number())
    }

    fn is_busy(&self, at: Circumstances) -> bool {
        self.inspection != Inspection::None
            || at.station.state == MachineState::Operational(OperationalState::SingleExecution)
    }

    fn is_plc_alive(&self, now: Instant) -> bool {
        self.plc_seen.is_some_and(|seen| now.duration_since(seen) <= PLC_SILENT)
    }
}
