//! The thread that drives a controller on a line, shared by its devices and written once for all protocols.
//!
//! A protocol is a [`Dialogue`]: a state without thread, line and clock. Callers write their lines themselves, under
//! the lock of the dialogue, so that nothing queues; the thread reads, handles timers (queries, leases, silence) and
//! opens the line. A stop's bytes bypass that lock, through a separate writer. When the thread ends, for whatever
//! reason, it finally sends the dialogue's farewell bytes.

use parking_lot::{Condvar, Mutex, MutexGuard};
use std::sync::Arc;
use std::time::{Duration, Instant};

use remedy::with_causes;

use crate::lines::serial_line::{SerialLine, SerialLineError, SerialWriter};
use crate::params::ANSWER_WAIT;
use crate::time::{self, Thread};
use crate::{StageError, StopHandle};

/// Interval at which a thread without a line checks whether to open it.
const DOWN_WAIT: Duration = Duration::from_millis(50);

/// Time that [`Controller::open`] waits beyond the opening's own limit.
const OPEN_SLACK: Duration = Duration::from_secs(2);

/// Polling interval under a simulated clock.
const LOOK: Duration = Duration::from_millis(1);

/// Bytes per read; reports have a hundred.
const READ_BYTES: usize = 512;

/// The bytes that stop the motion, written bypassing everything else.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StopBytes {
    /// Which of the protocol's stops it is; passed to [`Dialogue::stop_sent`].
    pub code: u8,
    /// The bytes; empty if the protocol stops by sending no more.
    pub bytes: Vec<u8>,
}

/// State of a protocol: takes bytes and time, and collects the bytes to be written.
pub trait Dialogue: Send + 'static {
    /// Faults of the protocol.
    type Fault;

    /// Whether the line is to be opened.
    fn should_be_open(&self) -> bool;
    /// Whether the line may be closed because nothing is expected of it.
    fn is_down(&self) -> bool;
    /// Whether the opening has ended, with or without a fault.
    fn opened_or_failed(&self) -> bool;
    /// Checks that the stage has no fault.
    ///
    /// # Errors
    /// Its fault.
    fn sound(&self) -> Result<(), StageError>;
    /// The line was opened.
    fn line_opened(&mut self, now: Instant);
    /// The line could not be opened.
    fn line_unopened(&mut self, reason: String);
    /// The line was lost.
    fn line_lost(&mut self, reason: String);
    /// Takes received bytes.
    fn received(&mut self, bytes: &[u8], now: Instant);
    /// Processes what is due.
    fn tick(&mut self, now: Instant);
    /// How long the thread may sleep before the next tick.
    fn wait(&self) -> Duration;
    /// The bytes to be written, returned once.
    fn take_outgoing(&mut self) -> Vec<u8>;
    /// The stop for the current state.
    fn stop(&self) -> StopBytes;
    /// Continues after the stop's bytes were written.
    fn stop_sent(&mut self, code: u8, now: Instant);
    /// Whether a stop that the thread announced before its byte was written is announced again.
    fn announces_again(&self, code: u8) -> bool {
        let _ = code;
        true
    }
    /// The last bytes of a line, after which nothing moves and the laser is off.
    fn farewell(&self) -> Vec<u8>;
    /// Waits for the answer to this line; a refusal goes to the waiting caller.
    fn wait_for(&mut self, ticket: u64);
    /// Whether the line was answered or discarded.
    fn answered_or_gone(&self, ticket: u64) -> bool;
    /// Ends the wait; returns the refusal, if there was one.
    fn end_wait(&mut self) -> Option<Self::Fault>;

    /// How many of `bytes`, which is not empty, are written in one piece.
    fn piece(bytes: &[u8]) -> usize {
        bytes.len()
    }
}

struct Desk<D> {
    session: D,
    writer: Option<Box<dyn SerialWriter>>,
    ended: bool,
}

struct Shared<D> {
    desk: Mutex<Desk<D>>,
    changed: Condvar,
    urgent: Mutex<Option<Box<dyn SerialWriter>>>,
    stop: Mutex<StopBytes>,
    farewell: Mutex<Vec<u8>>,
    /// A stop whose byte bypasses the session, until the session knows of it. It is set before the byte is written, so
    /// that the controller's answer never precedes it.
    announced: Mutex<Option<(u8, Instant)>>,
}

/// See the module.
pub struct Controller<D: Dialogue> {
    shared: Arc<Shared<D>>,
    thread: Option<Thread<()>>,
}

impl<D: Dialogue> Controller<D> {
    /// Starts a thread called `name` and waits, at most `open_limit`, until the controller is connected and checked.
    ///
    /// # Errors
    /// Why it was not.
    pub fn open(
        name: &str,
        session: D,
        line: Box<dyn SerialLine>,
        open_limit: Duration,
    ) -> Result<Arc<Self>, StageError> {
        let place = line.place();
        let shared = Arc::new(Shared {
            stop: Mutex::new(session.stop()),
            farewell: Mutex::new(session.farewell()),
            desk: Mutex::new(Desk { session, writer: None, ended: false }),
            changed: Condvar::new(),
            urgent: Mutex::new(None),
            announced: Mutex::new(None),
        });
        let for_thread = Arc::clone(&shared);
        let thread = time::spawn(name, move || run(&for_thread, line))
            .map_err(|cause| StageError::Gone { reason: format!("no thread for {place}: {cause}") })?;
        let controller = Self { shared, thread: Some(thread) };
        controller.wait_opened(open_limit + OPEN_SLACK)?;
        Ok(Arc::new(controller))
    }

    fn wait_opened(&self, limit: Duration) -> Result<(), StageError> {
        let deadline = time::now() + limit;
        let mut desk = self.shared.lock();
        while !desk.session.opened_or_failed() && time::now() < deadline {
            desk = self.shared.wait(desk, deadline);
        }
        desk.session.sound()
    }

    /// Lets `act` change the session, and writes the resulting output.
    pub fn act<T>(&self, act: impl FnOnce(&mut D, Instant) -> T) -> T {
        let mut desk = self.shared.lock();
        let result = act(&mut desk.session, time::now());
        self.shared.settle(&mut desk);
        result
    }

    /// As [`Controller::act`], then waits for the answer to the line sent, as long as a call may take; a later refusal
    /// becomes a fault.
    pub fn ask<T, E>(
        &self,
        act: impl FnOnce(&mut D, Instant) -> Result<(T, Option<u64>), E>,
        refused: impl FnOnce(&D::Fault) -> E,
    ) -> Result<T, E> {
        let mut desk = self.shared.lock();
        let now = time::now();
        let (result, ticket) = act(&mut desk.session, now)?;
        let Some(ticket) = ticket else {
            self.shared.settle(&mut desk);
            return Ok(result);
        };
        desk.session.wait_for(ticket);
        self.shared.settle(&mut desk);
        let deadline = now + ANSWER_WAIT;
        while !desk.session.answered_or_gone(ticket) && time::now() < deadline {
            desk = self.shared.wait(desk, deadline);
        }
        match desk.session.end_wait() {
            Some(fault) => Err(refused(&fault)),
            None => Ok(result),
        }
    }

    /// Stops: the stop's bytes are written before anything else.
    pub fn stop(&self) {
        let stop = self.shared.stop().clone();
        let written = self.shared.write_announced(&stop);
        let mut desk = self.shared.lock();
        match written {
            Ok(true) => {
                let told_before = !self.shared.announce_stops(&mut desk);
                if told_before && desk.session.announces_again(stop.code) {
                    // The reader announced it before the bytes were written, and may have seen the end of a stop since:
                    // the stop is verified again.
                    desk.session.stop_sent(stop.code, time::now());
                }
            }
            // No line: nothing moves on our command, and the fault is reported already.
            Ok(false) => {}
            Err(reason) => desk.session.line_lost(reason),
        }
        self.shared.settle(&mut desk);
    }
}

impl<D: Dialogue> StopHandle for Controller<D> {
    fn stop_now(&self) {
        self.stop();
    }
}

impl<D: Dialogue> Drop for Controller<D> {
    fn drop(&mut self) {
        self.shared.lock().ended = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

impl<D: Dialogue> Shared<D> {
    /// A panic elsewhere does not poison this kind of lock, so that the laser can still be turned off.
    fn lock(&self) -> MutexGuard<'_, Desk<D>> {
        self.desk.lock()
    }

    fn wait<'a>(&'a self, mut desk: MutexGuard<'a, Desk<D>>, deadline: Instant) -> MutexGuard<'a, Desk<D>> {
        let left = deadline.saturating_duration_since(time::now());
        if time::is_simulated() {
            drop(desk);
            time::sleep(left.min(LOOK));
            return self.lock();
        }
        self.changed.wait_for(&mut desk, left);
        desk
    }

    /// Writes the pending output, and wakes the waiters.
    fn settle(&self, desk: &mut Desk<D>) {
        let bytes = desk.session.take_outgoing();
        if let (false, Some(writer)) = (bytes.is_empty(), &mut desk.writer)
            && let Err(error) = write_apart::<D>(&mut **writer, &bytes)
        {
            desk.writer = None;
            if !desk.session.is_down() {
                desk.session.line_lost(with_causes(&error));
            }
        }
        *self.stop() = desk.session.stop();
        *self.farewell.lock() = desk.session.farewell();
        self.changed.notify_all();
    }

    fn stop(&self) -> MutexGuard<'_, StopBytes> {
        self.stop.lock()
    }

    /// Writes a stop bypassing the session and announces it; false without a line.
    fn write_announced(&self, stop: &StopBytes) -> Result<bool, String> {
        let mut urgent = self.urgent.lock();
        let Some(writer) = urgent.as_mut() else { return Ok(false) };
        *self.announced() = Some((stop.code, time::now()));
        let written = if stop.bytes.is_empty() { Ok(()) } else { writer.write_now(&stop.bytes) };
        if written.is_err() {
            *self.announced() = None;
        }
        written.map(|()| true).map_err(|error| with_causes(&error))
    }

    fn announced(&self) -> MutexGuard<'_, Option<(u8, Instant)>> {
        self.announced.lock()
    }

    /// Passes announced stops to the session; called by the sender and by the reader, whichever is first. Returns
    /// whether there was one.
    fn announce_stops(&self, desk: &mut Desk<D>) -> bool {
        let announced = self.announced().take();
        if let Some((byte, sent_at)) = announced {
            desk.session.stop_sent(byte, sent_at);
        }
        announced.is_some()
    }

    fn set_writers(&self, writer: Option<Box<dyn SerialWriter>>, urgent: Option<Box<dyn SerialWriter>>) {
        self.lock().writer = writer;
        *self.urgent.lock() = urgent;
    }
}

/// Writes `bytes` in the protocol's pieces.
fn write_apart<D: Dialogue>(writer: &mut dyn SerialWriter, bytes: &[u8]) -> Result<(), SerialLineError> {
    let mut rest = bytes;
    while !rest.is_empty() {
        let n = D::piece(rest);
        writer.write_now(&rest[..n])?;
        rest = &rest[n..];
    }
    Ok(())
}

/// The thread: opens, reads, handles timers.
fn run<D: Dialogue>(shared: &Shared<D>, mut line: Box<dyn SerialLine>) {
    let _farewell = Farewell(shared);
    let mut buffer = [0; READ_BYTES];
    while let Some(next) = due(shared) {
        match next {
            Next::Open => open(shared, &mut *line),
            Next::Rest => rest(shared, &mut *line),
            Next::Read(wait) => {
                let read = line.read(&mut buffer, wait);
                let mut desk = shared.lock();
                shared.announce_stops(&mut desk);
                match read {
                    Ok(n) => desk.session.received(&buffer[..n], time::now()),
                    Err(error) => desk.session.line_lost(with_causes(&error)),
                }
                shared.settle(&mut desk);
            }
        }
    }
}

enum Next {
    Open,
    Rest,
    Read(Duration),
}

/// Processes timers; returns what to do next, or `None` to end.
fn due<D: Dialogue>(shared: &Shared<D>) -> Option<Next> {
    let mut desk = shared.lock();
    if desk.ended {
        return None;
    }
    desk.session.tick(time::now());
    shared.settle(&mut desk);
    Some(if desk.session.should_be_open() {
        Next::Open
    } else if desk.session.is_down() {
        Next::Rest
    } else {
        Next::Read(desk.session.wait())
    })
}

fn open<D: Dialogue>(shared: &Shared<D>, line: &mut dyn SerialLine) {
    shared.set_writers(None, None);
    let opened = line.reopen().and_then(|()| Ok((line.writer()?, line.writer()?)));
    match opened {
        Ok((writer, urgent)) => {
            shared.set_writers(Some(writer), Some(urgent));
            shared.lock().session.line_opened(time::now());
        }
        Err(error) => shared.lock().session.line_unopened(with_causes(&error)),
    }
    shared.settle(&mut shared.lock());
}

/// Closes the line and sleeps until there is something to do.
fn rest<D: Dialogue>(shared: &Shared<D>, line: &mut dyn SerialLine) {
    shared.set_writers(None, None);
    line.close();
    let desk = shared.lock();
    if !desk.ended && !desk.session.should_be_open() {
        drop(shared.wait(desk, time::now() + DOWN_WAIT));
    }
}

/// The thread's final action, also if it panics: everything stops and the laser goes off.
struct Farewell<'a, D: Dialogue>(&'a Shared<D>);

impl<D: Dialogue> Drop for Farewell<'_, D> {
    fn drop(&mut self) {
        let bytes = self.0.farewell.lock().clone();
        self.0.write_announced(&StopBytes { code: 0, bytes }).ok();
        self.0.set_writers(None, None);
    }
}
