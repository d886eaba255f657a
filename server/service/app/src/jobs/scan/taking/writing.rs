//! Writes the peaks of a scan to disk on its own thread, so that neither frames nor viewers wait when the disk stalls.

use parking_lot::Mutex;
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::Instant;

use scanning::files::peaks::PeaksWriter;

use crate::error::AppError;
use crate::error::disk_problem;
use crate::jobs::scan::timing::Timing;

/// Records waiting for the disk: write-back can stall a writer for up to 0.2 s, commonly 0.1 s; at 500 frames/s the
/// queue covers 0.125 s. A full queue blocks the stages before it.
pub const QUEUE_RECORDS: usize = 64;

/// The peaks file of a running scan.
pub type NewPeaks = PeaksWriter<File>;

/// A frame as stored in the peaks file.
pub struct Record {
    /// The packed frame.
    pub bytes: Vec<u8>,
    /// Stage position, mm; on a turntable, degrees.
    pub position: f64,
    /// Time of arrival at the station.
    pub arrived_at: Instant,
    /// Time at which its profile was on the live bus.
    pub shown_at: Instant,
}

/// The stored data of the frames.
pub struct Kept<'k> {
    /// Stage positions, mm; on a turntable, degrees.
    pub positions: &'k mut Vec<f64>,
    /// Number of line points.
    pub peaks: &'k mut NewPeaks,
    /// Latencies.
    pub timing: &'k mut Timing,
}

/// Buffers of written records, for reuse.
#[derive(Default)]
pub struct FreeRecords(Mutex<Vec<Vec<u8>>>);

impl FreeRecords {
    /// A buffer for reuse, if any.
    pub fn take(&self) -> Vec<u8> {
        self.0.lock().pop().unwrap_or_default()
    }

    fn give_back(&self, bytes: Vec<u8>) {
        self.0.lock().push(bytes);
    }
}

impl Kept<'_> {
    /// Writes records as they arrive. After a failure it accepts and discards, so that no sender blocks.
    pub fn write(
        &mut self,
        records: &Receiver<Record>,
        free: &FreeRecords,
        failed: &AtomicBool,
    ) -> Result<(), AppError> {
        let mut outcome = Ok(());
        for record in records {
            if outcome.is_ok() {
                outcome = self.write_one(&record);
                if outcome.is_err() {
                    failed.store(true, Ordering::Relaxed);
                }
            }
            free.give_back(record.bytes);
        }
        outcome
    }

    /// Data handed to the operating system survive the end of this process.
    fn write_one(&mut self, record: &Record) -> Result<(), AppError> {
        self.peaks.add_packed(&record.bytes).map_err(disk_problem)?;
        self.positions.push(record.position);
        self.timing.shown(record.arrived_at, record.shown_at);
        self.timing.kept(record.arrived_at);
        Ok(())
    }
}
