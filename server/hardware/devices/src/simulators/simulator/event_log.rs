//! Log of the actual events at the simulated controller: laser, motion and every received byte, with times.

use parking_lot::{Mutex, MutexGuard};
use std::collections::VecDeque;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A recorded event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LogEvent {
    /// Power-on: the firmware starts.
    PoweredOn,
    /// The laser went on, with this fraction of full power.
    LightOn(f64),
    /// The laser went off.
    LightOff,
    /// The axis began to move at this machine position, mm.
    MotionBegan(f64),
    /// The axis came to rest at this machine position, mm.
    MotionEnded(f64),
    /// A byte was received from the computer.
    Byte(u8),
}

/// An event and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Time by this computer's monotonic clock.
    pub at: Instant,
    /// The event.
    pub what: LogEvent,
}

/// The event log of a simulated controller. Clones share it.
#[derive(Debug, Clone)]
pub struct EventLog {
    inner: Arc<Mutex<Record>>,
}

#[derive(Debug)]
struct Record {
    begun_at: Instant,
    entries: Vec<Entry>,
    light: bool,
    moving: bool,
    /// Recent positions of the axis while it moved.
    path: VecDeque<(Instant, f64)>,
    file: Option<File>,
}

/// How long positions of the axis are kept.
const PATH: Duration = Duration::from_secs(3);

impl EventLog {
    /// An empty record; every entry is also written to `file` at once as a line `µs-since-start what value`, so that
    /// another process can follow it.
    ///
    /// # Errors
    /// If the file cannot be created.
    pub fn new(file: Option<&Path>) -> std::io::Result<Self> {
        let file = file.map(File::create).transpose()?;
        let record = Record {
            begun_at: crate::time::now(),
            entries: Vec::new(),
            light: false,
            moving: false,
            path: VecDeque::new(),
            file,
        };
        Ok(Self { inner: Arc::new(Mutex::new(record)) })
    }

    /// All entries, in order.
    pub fn entries(&self) -> Vec<Entry> {
        self.lock().entries.clone()
    }

    /// Number of entries so far, to be passed to [`Self::since`].
    pub fn mark(&self) -> usize {
        self.lock().entries.len()
    }

    /// Entries since the mark.
    pub fn since(&self, mark: usize) -> Vec<Entry> {
        self.lock().entries.get(mark..).map_or_else(Vec::new, <[Entry]>::to_vec)
    }

    /// Time of the first such byte since the mark.
    pub fn byte_since(&self, mark: usize, byte: u8) -> Option<Instant> {
        let record = self.lock();
        let entries = record.entries.get(mark..).unwrap_or_default();
        entries.iter().find(|entry| entry.what == LogEvent::Byte(byte)).map(|entry| entry.at)
    }

    /// Whether the laser is on.
    pub fn light(&self) -> bool {
        self.lock().light
    }

    /// Whether the axis moves.
    pub fn moving(&self) -> bool {
        self.lock().moving
    }

    /// How many motions began since the mark.
    pub fn n_motions_since(&self, mark: usize) -> usize {
        let began = |entry: &Entry| matches!(entry.what, LogEvent::MotionBegan(_));
        self.since(mark).into_iter().filter(began).count()
    }

    /// Lowest and highest machine position, mm, between `from` and `to`; `None` if no longer stored.
    pub fn positions_between(&self, from: Instant, to: Instant) -> Option<(f64, f64)> {
        let record = self.lock();
        let after = record.path.iter().position(|(at, _)| *at > to).unwrap_or(record.path.len());
        let first = record.path.iter().rposition(|(at, _)| *at <= from)?;
        let there = record.path.range(first..(after + 1).min(record.path.len())).map(|(_, at_mm)| *at_mm);
        let within =
            there.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at_mm| (low.min(at_mm), high.max(at_mm)));
        Some(within)
    }

    pub(crate) fn record_position(&self, at: Instant, at_mm: f64) {
        let path = &mut self.lock().path;
        while path.front().is_some_and(|(before, _)| at.saturating_duration_since(*before) > PATH)
            && path.len() > 1
        {
            path.pop_front();
        }
        path.push_back((at, at_mm));
    }

    pub(crate) fn record(&self, at: Instant, what: LogEvent) {
        if let LogEvent::MotionBegan(at_mm) | LogEvent::MotionEnded(at_mm) = what {
            self.record_position(at, at_mm);
        }
        let mut record = self.lock();
        match what {
            LogEvent::LightOn(_) => record.light = true,
            LogEvent::LightOff => record.light = false,
            LogEvent::MotionBegan(_) => record.moving = true,
            LogEvent::MotionEnded(_) => record.moving = false,
            LogEvent::PoweredOn | LogEvent::Byte(_) => {}
        }
        record.entries.push(Entry { at, what });
        let since_us = at.saturating_duration_since(record.begun_at).as_micros();
        if let Some(file) = &mut record.file {
            // The record in memory is kept; a full disk ends the file, which its reader notices.
            writeln!(file, "{since_us} {}", text_of(what)).ok();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Record> {
        self.inner.lock()
    }
}

fn text_of(what: LogEvent) -> String {
    match what {
        LogEvent::PoweredOn => "powered-on".to_owned(),
        LogEvent::LightOn(power) => format!("light-on {power}"),
        LogEvent::LightOff => "light-off".to_owned(),
        LogEvent::MotionBegan(at_mm) => format!("motion-began {at_mm:.4}"),
        LogEvent::MotionEnded(at_mm) => format!("motion-ended {at_mm:.4}"),
        LogEvent::Byte(byte) => format!("byte {byte:#04x}"),
    }
}
