//! The thread that drives a controller on a line, shared by its devices and written once for all protocols.
//!
//! A protocol is a [`Dialogue`]: a state without thread, line and clock. Callers write their lines themselves, under
//! the lock of the dialogue, so that nothing queues; the thread reads, handles timers (queries, leases, silence) and
//! opens the line. A stop's bytes bypass that lock, through a separate writer. When the thread ends, for whatever
//! reason, it finally sends the dialogue's shutdown bytes.

use parking_lot::{Condvar, Mutex, MutexGuard};
use std::sync::Arc;
use std::time::{Duration, Instant};

use remedy::with_causes;

use crate::lines::serial_line::{SerialLine, SerialLineError, SerialWriter};
use crate::params::ANSWER_WAIT;
use crate::time::{self, Thread};
use crate::{StageError, StopHandle};

/// Interval at which a thread without a line checks whether to open it.
const CLOSED_LINE_WAIT: Duration = Duration::from_millis(50);

/// Time that [`Controller::open`] waits beyond the opening's own limit.
const OPEN_SLACK: Duration = Duration::from_secs(2);

/// Polling interval under a simulated clock.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

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
    fn has_opened_or_failed(&self) -> bool;
    /// Checks that the stage has no fault.
    ///
    /// # Errors
    /// Its fault.
    fn check_fault(&self) -> Result<(), StageError>;
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
    fn shutdown_bytes(&self) -> Vec<u8>;
    /// Waits for the answer to this line; a refusal goes to the waiting caller.
    fn wait_for(&mut self, ticket: u64);
    /// Whether the line was answered or discarded.
    fn is_answered_or_discarded(&self, ticket: u64) -> bool;
    /// Ends the wait; returns the refusal, if there was one.
    fn end_wait(&mut self) -> Option<Self::Fault>;

    /// How many of `bytes`, which is not empty, are written in one call.
    fn chunk_len(bytes: &[u8]) -> usize {
        bytes.len()
    }
}

struct Inner<D> {
    session: D,
    writer: Option<Box<dyn SerialWriter>>,
    ended: bool,
}

struct Shared<D> {
    inner: Mutex<Inner<D>>,
    changed: Condvar,
    urgent: Mutex<Option<Box<dyn SerialWriter>>>,
    stop: Mutex<StopBytes>,
    shutdown_bytes: Mutex<Vec<u8>>,
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
    /// Starts a thread called `name` and waits, at most `open_limit`, until the controller is connected and checked. A
    /// fault that can be cleared over the line does not prevent this; it is reported when the controller is used.
    ///
    /// # Errors
    /// Why it was not.
    pub fn open(
        name: &str,
        session: D,
        line: Box<dyn SerialLine>,
        open_limit: Duration,
    ) -> Result<Arc<Self>, StageError> {
        let port_name = line.port_name();
        let shared = Arc::new(Shared {
            stop: Mutex::new(session.stop()),
            shutdown_bytes: Mutex::new(session.shutdown_bytes()),
            inner: Mutex::new(Inner { session, writer: None, ended: false }),
            changed: Condvar::new(),
            urgent: Mutex::new(None),
            announced: Mutex::new(None),
        });
        let for_thread = Arc::clone(&shared);
        let thread = time::spawn(name, move || run(&for_thread, line))
            .map_err(|cause| StageError::Disconnected { reason: format!("no thread for {port_name}: {cause}") })?;
        let controller = Self { shared, thread: Some(thread) };
        controller.wait_opened(open_limit + OPEN_SLACK)?;
        Ok(Arc::new(controller))
    }

    fn wait_opened(&self, limit: Duration) -> Result<(), StageError> {
        let deadline = time::now() + limit;
        let mut inner = self.shared.lock();
        while !inner.session.has_opened_or_failed() && time::now() < deadline {
            inner = self.shared.wait(inner, deadline);
        }
        let is_connected = inner.session.has_opened_or_failed() && !inner.session.is_down();
        if is_connected { Ok(()) } else { inner.session.check_fault() }
    }

    /// Lets `act` change the session, and writes the resulting output.
    pub fn act<T>(&self, act: impl FnOnce(&mut D, Instant) -> T) -> T {
        let mut inner = self.shared.lock();
        let result = act(&mut inner.session, time::now());
        self.shared.write_and_notify(&mut inner);
        result
    }

    /// As [`Controller::act`], then waits for the answer to the line sent, as long as a call may take; a later refusal
    /// becomes a fault.
    pub fn request<T, E>(
        &self,
        act: impl FnOnce(&mut D, Instant) -> Result<(T, Option<u64>), E>,
        refused: impl FnOnce(&D::Fault) -> E,
    ) -> Result<T, E> {
        let mut inner = self.shared.lock();
        let now = time::now();
        let (result, ticket) = act(&mut inner.session, now)?;
        let Some(ticket) = ticket else {
            self.shared.write_and_notify(&mut inner);
            return Ok(result);
        };
        inner.session.wait_for(ticket);
        self.shared.write_and_notify(&mut inner);
        let deadline = now + ANSWER_WAIT;
        while !inner.session.is_answered_or_discarded(ticket) && time::now() < deadline {
            inner = self.shared.wait(inner, deadline);
        }
        match inner.session.end_wait() {
            Some(fault) => Err(refused(&fault)),
            None => Ok(result),
        }
    }

    /// Stops: the stop's bytes are written before anything else.
    pub fn stop(&self) {
        let stop = self.shared.stop().clone();
        let written = self.shared.write_announced(&stop);
        let mut inner = self.shared.lock();
        match written {
            Ok(true) => {
                let announced_before = !self.shared.announce_stops(&mut inner);
                if announced_before && inner.session.announces_again(stop.code) {
                    // The reader announced it before the bytes were written, and may have seen the end of a stop since:
                    // the stop is verified again.
                    inner.session.stop_sent(stop.code, time::now());
                }
            }
            // No line: nothing moves on a command of this driver, and the fault is reported already.
            Ok(false) => {}
            Err(reason) => inner.session.line_lost(reason),
        }
        self.shared.write_and_notify(&mut inner);
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
    fn lock(&self) -> MutexGuard<'_, Inner<D>> {
        self.inner.lock()
    }

    fn wait<'a>(&'a self, mut inner: MutexGuard<'a, Inner<D>>, deadline: Instant) -> MutexGuard<'a, Inner<D>> {
        let left = deadline.saturating_duration_since(time::now());
        if time::is_simulated() {
            drop(inner);
            time::sleep(left.min(POLL_INTERVAL));
            return self.lock();
        }
        self.changed.wait_for(&mut inner, left);
        inner
    }

    /// Writes the pending output and notifies waiting threads.
    fn write_and_notify(&self, inner: &mut Inner<D>) {
        let bytes = inner.session.take_outgoing();
        if let (false, Some(writer)) = (bytes.is_empty(), &mut inner.writer)
            && let Err(error) = write_in_chunks::<D>(&mut **writer, &bytes)
        {
            inner.writer = None;
            if !inner.session.is_down() {
                inner.session.line_lost(with_causes(&error));
            }
        }
        *self.stop() = inner.session.stop();
        *self.shutdown_bytes.lock() = inner.session.shutdown_bytes();
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
    fn announce_stops(&self, inner: &mut Inner<D>) -> bool {
        let announced = self.announced().take();
        if let Some((byte, sent_at)) = announced {
            inner.session.stop_sent(byte, sent_at);
        }
        announced.is_some()
    }

    fn set_writers(&self, writer: Option<Box<dyn SerialWriter>>, urgent: Option<Box<dyn SerialWriter>>) {
        self.lock().writer = writer;
        *self.urgent.lock() = urgent;
    }
}

/// Writes `bytes` in the protocol's chunks.
fn write_in_chunks<D: Dialogue>(writer: &mut dyn SerialWriter, bytes: &[u8]) -> Result<(), SerialLineError> {
    let mut rest = bytes;
    while !rest.is_empty() {
        let n = D::chunk_len(rest);
        writer.write_now(&rest[..n])?;
        rest = &rest[n..];
    }
    Ok(())
}

/// The thread: opens, reads, handles timers.
fn run<D: Dialogue>(shared: &Shared<D>, mut line: Box<dyn SerialLine>) {
    let _guard = ShutdownGuard(shared);
    let mut buffer = [0; READ_BYTES];
    while let Some(next) = due(shared) {
        match next {
            Next::Open => open(shared, &mut *line),
            Next::Sleep => sleep_until_needed(shared, &mut *line),
            Next::Read(wait) => {
                let read = line.read(&mut buffer, wait);
                let mut inner = shared.lock();
                shared.announce_stops(&mut inner);
                match read {
                    Ok(n) => inner.session.received(&buffer[..n], time::now()),
                    Err(error) => inner.session.line_lost(with_causes(&error)),
                }
                shared.write_and_notify(&mut inner);
            }
        }
    }
}

enum Next {
    Open,
    Sleep,
    Read(Duration),
}

/// Processes timers; returns what to do next, or `None` to end.
fn due<D: Dialogue>(shared: &Shared<D>) -> Option<Next> {
    let mut inner = shared.lock();
    if inner.ended {
        return None;
    }
    inner.session.tick(time::now());
    shared.write_and_notify(&mut inner);
    Some(if inner.session.should_be_open() {
        Next::Open
    } else if inner.session.is_down() {
        Next::Sleep
    } else {
        Next::Read(inner.session.wait())
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
    shared.write_and_notify(&mut shared.lock());
}

/// Closes the line and sleeps until there is something to do.
fn sleep_until_needed<D: Dialogue>(shared: &Shared<D>, line: &mut dyn SerialLine) {
    shared.set_writers(None, None);
    line.close();
    let inner = shared.lock();
    if !inner.ended && !inner.session.should_be_open() {
        drop(shared.wait(inner, time::now() + CLOSED_LINE_WAIT));
    }
}

/// The thread's final action, also if it panics: everything stops and the laser goes off.
struct ShutdownGuard<'a, D: Dialogue>(&'a Shared<D>);

impl<D: Dialogue> Drop for ShutdownGuard<'_, D> {
    fn drop(&mut self) {
        let bytes = self.0.shutdown_bytes.lock().clone();
        self.0.write_announced(&StopBytes { code: 0, bytes }).ok();
        self.0.set_writers(None, None);
    }
}
