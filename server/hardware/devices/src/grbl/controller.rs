//! One controller: its thread, its line, and the state that stage and laser share.
//!
//! Callers write their lines themselves, under the lock of the session, so that nothing queues; the thread reads,
//! keeps the time (queries, lease, silence) and opens the line. A stop's first byte goes out past that lock, by a
//! writer of its own. When the thread ends, for whatever reason, its last act is a soft reset.

use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use remedy::with_causes;

use super::GrblConfig;
use super::fault::Fault;
use super::protocol::{HOLD, RESET};
use super::session::{Session, stop_bytes};
use crate::StageError;
use crate::params::GRBL_ANSWER_WAIT;
use crate::serial_line::{SerialLine, SerialWriter};

/// How often a thread without a line looks whether it is to open one.
const DOWN_WAIT: Duration = Duration::from_millis(50);

/// What [`Controller::open`] waits beyond the opening's own limit.
const OPEN_SLACK: Duration = Duration::from_secs(2);

/// Longest text of one read; GRBL's reports have a hundred bytes.
const READ_BYTES: usize = 512;

struct Desk {
    session: Session,
    writer: Option<Box<dyn SerialWriter>>,
    ended: bool,
}

struct Shared {
    desk: Mutex<Desk>,
    changed: Condvar,
    urgent: Mutex<Option<Box<dyn SerialWriter>>>,
    stop_byte: AtomicU8,
    /// A stop whose byte goes out past the session, until the session knows of it. It is there before the byte is, so
    /// that the controller's answer never comes before the question.
    announced: Mutex<Option<(u8, Instant)>>,
}

/// See the module.
pub struct Controller {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Controller {
    /// Starts the thread and waits for the controller to be reached and checked.
    pub fn open(config: &GrblConfig, line: Box<dyn SerialLine>) -> Result<Arc<Self>, StageError> {
        let place = line.place();
        let session = Session::new(config.clone(), place.clone());
        let shared = Arc::new(Shared {
            stop_byte: AtomicU8::new(session.stop_byte()),
            desk: Mutex::new(Desk { session, writer: None, ended: false }),
            changed: Condvar::new(),
            urgent: Mutex::new(None),
            announced: Mutex::new(None),
        });
        let for_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("grbl".to_owned())
            .spawn(move || run(&for_thread, line))
            .map_err(|cause| StageError::Gone { reason: format!("no thread for {place}: {cause}") })?;
        let controller = Self { shared, thread: Some(thread) };
        controller.wait_opened(config.open_limit + OPEN_SLACK)?;
        Ok(Arc::new(controller))
    }

    fn wait_opened(&self, limit: Duration) -> Result<(), StageError> {
        let deadline = Instant::now() + limit;
        let mut desk = self.shared.lock();
        while !desk.session.opened_or_failed() && Instant::now() < deadline {
            desk = self.shared.wait(desk, deadline);
        }
        desk.session.sound()
    }

    /// Lets `act` change the session, and writes what it wants written.
    pub fn act<T>(&self, act: impl FnOnce(&mut Session, Instant) -> T) -> T {
        let mut desk = self.shared.lock();
        let result = act(&mut desk.session, Instant::now());
        self.shared.settle(&mut desk);
        result
    }

    /// As [`Controller::act`], then waits for the answer to the line that was sent, as long as a call may take; a
    /// later refusal becomes a fault.
    pub fn ask<T, E>(
        &self,
        act: impl FnOnce(&mut Session, Instant) -> Result<(T, Option<u64>), E>,
        refused: impl FnOnce(&Fault) -> E,
    ) -> Result<T, E> {
        let mut desk = self.shared.lock();
        let now = Instant::now();
        let (result, ticket) = act(&mut desk.session, now)?;
        let Some(ticket) = ticket else {
            self.shared.settle(&mut desk);
            return Ok(result);
        };
        desk.session.wait_for(ticket);
        self.shared.settle(&mut desk);
        let deadline = now + GRBL_ANSWER_WAIT;
        while !desk.session.answered_or_gone(ticket) && Instant::now() < deadline {
            desk = self.shared.wait(desk, deadline);
        }
        match desk.session.end_wait() {
            Some(fault) => Err(refused(&fault)),
            None => Ok(result),
        }
    }

    /// Stops: the first byte goes out before anything else is looked at.
    pub fn stop(&self) {
        let byte = self.shared.stop_byte.load(Ordering::SeqCst);
        let written = self.shared.write_announced(byte);
        let mut desk = self.shared.lock();
        match written {
            Ok(true) => {
                let told_before = !self.shared.tell_of_stops(&mut desk);
                if told_before && byte == HOLD {
                    // The reader told of it before the byte was out, and may have seen the end of a stop since: the
                    // hold that came after it is verified anew.
                    desk.session.stop_sent(byte, Instant::now());
                }
            }
            // No line: nothing moves by our doing, and the fault is told already.
            Ok(false) => {}
            Err(reason) => desk.session.down(Fault::Gone { reason }),
        }
        self.shared.settle(&mut desk);
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.shared.lock().ended = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

impl Shared {
    /// A panic elsewhere must not keep anyone from darkening the laser.
    fn lock(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, desk: MutexGuard<'a, Desk>, deadline: Instant) -> MutexGuard<'a, Desk> {
        let left = deadline.saturating_duration_since(Instant::now());
        self.changed.wait_timeout(desk, left).unwrap_or_else(PoisonError::into_inner).0
    }

    /// Writes what is to be written, and tells who waits.
    fn settle(&self, desk: &mut Desk) {
        let bytes = desk.session.take_outgoing();
        if let (false, Some(writer)) = (bytes.is_empty(), &mut desk.writer)
            && let Err(error) = write_apart(&mut **writer, &bytes)
        {
            desk.writer = None;
            if !desk.session.is_down() {
                desk.session.down(Fault::Gone { reason: with_causes(&error) });
            }
        }
        self.stop_byte.store(desk.session.stop_byte(), Ordering::SeqCst);
        self.changed.notify_all();
    }

    /// Writes a stop's byte past the session and leaves word of it; false without a line.
    fn write_announced(&self, byte: u8) -> Result<bool, String> {
        let mut urgent = self.urgent.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(writer) = urgent.as_mut() else { return Ok(false) };
        *self.announced() = Some((byte, Instant::now()));
        let written = writer.write_now(stop_bytes(byte));
        if written.is_err() {
            *self.announced() = None;
        }
        written.map(|()| true).map_err(|error| with_causes(&error))
    }

    fn announced(&self) -> MutexGuard<'_, Option<(u8, Instant)>> {
        self.announced.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells the session of a stop that went out past it: whoever comes first, the one that sent it or the one that read
    /// the answer. Whether there was one to tell of.
    fn tell_of_stops(&self, desk: &mut Desk) -> bool {
        let announced = self.announced().take();
        if let Some((byte, sent_at)) = announced {
            desk.session.stop_sent(byte, sent_at);
        }
        announced.is_some()
    }

    fn set_writers(&self, writer: Option<Box<dyn SerialWriter>>, urgent: Option<Box<dyn SerialWriter>>) {
        self.lock().writer = writer;
        *self.urgent.lock().unwrap_or_else(PoisonError::into_inner) = urgent;
    }
}

/// Real-time bytes go out singly, lines as a whole: USB adapters pass a lone byte on at once.
fn write_apart(writer: &mut dyn SerialWriter, bytes: &[u8]) -> Result<(), crate::serial_line::SerialLineError> {
    let is_line_byte = |byte: u8| (b'$'..=b'Z').contains(&byte) && byte != b'?';
    let mut rest = bytes;
    while let Some(&first) = rest.first() {
        let n = if is_line_byte(first) {
            rest.iter().position(|&byte| byte == b'\n').map_or(rest.len(), |at| at + 1)
        } else {
            1
        };
        writer.write_now(&rest[..n])?;
        rest = &rest[n..];
    }
    Ok(())
}

/// The thread: opens, reads, keeps the time.
fn run(shared: &Shared, mut line: Box<dyn SerialLine>) {
    let _farewell = Farewell(shared);
    let mut buffer = [0; READ_BYTES];
    while let Some(next) = due(shared) {
        match next {
            Next::Open => open(shared, &mut *line),
            Next::Rest => rest(shared, &mut *line),
            Next::Read(wait) => {
                let read = line.read(&mut buffer, wait);
                let mut desk = shared.lock();
                shared.tell_of_stops(&mut desk);
                match read {
                    Ok(n) => desk.session.received(&buffer[..n], Instant::now()),
                    Err(error) => desk.session.down(Fault::Gone { reason: with_causes(&error) }),
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

/// Does what time demands; what to do next, or nothing more.
fn due(shared: &Shared) -> Option<Next> {
    let mut desk = shared.lock();
    if desk.ended {
        return None;
    }
    desk.session.tick(Instant::now());
    shared.settle(&mut desk);
    Some(if desk.session.wants_open() {
        Next::Open
    } else if desk.session.is_down() {
        Next::Rest
    } else {
        Next::Read(desk.session.wait())
    })
}

fn open(shared: &Shared, line: &mut dyn SerialLine) {
    shared.set_writers(None, None);
    let opened = line.reopen().and_then(|()| Ok((line.writer()?, line.writer()?)));
    match opened {
        Ok((writer, urgent)) => {
            shared.set_writers(Some(writer), Some(urgent));
            shared.lock().session.line_opened(Instant::now());
        }
        Err(error) => shared.lock().session.line_unopened(with_causes(&error)),
    }
    shared.settle(&mut shared.lock());
}

/// Closes the line and sleeps until something is wanted.
fn rest(shared: &Shared, line: &mut dyn SerialLine) {
    shared.set_writers(None, None);
    line.close();
    let desk = shared.lock();
    if !desk.ended && !desk.session.wants_open() {
        drop(shared.wait(desk, Instant::now() + DOWN_WAIT));
    }
}

/// The thread's last act, also if it panics: everything stops and the laser goes dark.
struct Farewell<'a>(&'a Shared);

impl Drop for Farewell<'_> {
    fn drop(&mut self) {
        self.0.write_announced(RESET).ok();
        self.0.set_writers(None, None);
    }
}
