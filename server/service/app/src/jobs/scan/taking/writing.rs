//! What is kept of a scan's frames, on its way to the disk. A thread of its own, so that neither the next frames nor
//! those who watch wait when the disk pauses.

use parking_lot::Mutex;
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::Instant;

use scanning::files::peaks::PeaksWriter;

use crate::error::AppError;
use crate::jobs::scan::timing::Timing;
use crate::resources::stored_scan::disk_problem;

/// Records that wait for the disk: a system that writes back lets a writer wait up to a fifth of a second, a tenth is
/// common; at 500 frames/s this is an eighth. A full queue holds back those before it.
pub const QUEUE_RECORDS: usize = 64;

/// The peaks file of a scan under way.
pub type NewPeaks = PeaksWriter<File>;

/// A frame as the peaks file keeps it.
pub struct Record {
    /// The packed frame.
    pub bytes: Vec<u8>,
    /// Where it was taken, mm; on a turntable, degrees.
    pub position: f64,
    /// When the station had it.
    pub arrived_at: Instant,
    /// When its profile was on the live bus.
    pub shown_at: Instant,
}

/// What is kept of the frames.
pub struct Kept<'k> {
    /// Where they were taken, mm; on a turntable, degrees.
    pub positions: &'k mut Vec<f64>,
    /// Their lines.
    pub peaks: &'k mut NewPeaks,
    /// How long that took.
    pub timing: &'k mut Timing,
}

/// Memory of records that are written, for the next ones.
#[derive(Default)]
pub struct FreeRecords(Mutex<Vec<Vec<u8>>>);

impl FreeRecords {
    /// Memory that was used before, if there is any.
    pub fn take(&self) -> Vec<u8> {
        self.0.lock().pop().unwrap_or_default()
    }

    fn give_back(&self, bytes: Vec<u8>) {
        self.0.lock().push(bytes);
    }
}

impl Kept<'_> {
    /// Writes records as they come. After a failure it accepts and discards, so that no sender blocks.
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

    /// What the operating system has, the end of this process does not take away.
    fn write_one(&mut self, record: &Record) -> Result<(), AppError> {
        self.peaks.add_packed(&record.bytes).map_err(disk_problem)?;
        self.positions.push(record.position);
        self.timing.shown(record.arrived_at, record.shown_at);
        self.timing.kept(record.arrived_at);
        Ok(())
    }
}
