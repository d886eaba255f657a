//! A serial line that injects faults on request.

use parking_lot::{Mutex, MutexGuard};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::Xorshift;
use crate::lines::ports::line_to;
use crate::lines::serial_line::{SerialLine, SerialLineError, SerialWriter};
use crate::time;

/// A disturbance of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Noise {
    None,
    /// Random bytes are received.
    Garbage,
    /// One bit is flipped in each of the next reads.
    Flips(usize),
    /// Nothing is received.
    Silence,
    /// The second half of each read is lost.
    Halves,
    /// Half of each of the next writes is lost.
    LostWrites(usize),
}

/// The disturbance of a line, and its effects so far.
struct Disturbance {
    noise: Noise,
    rng: Xorshift,
    /// When it took effect: for a continuing disturbance the first time; for single bits and writes, each of which is a
    /// fault, the last time.
    effective_at: Option<Instant>,
}

/// Sets the disturbance of a line.
#[derive(Clone)]
pub struct LineControl(Arc<Mutex<Disturbance>>);

impl LineControl {
    pub fn new() -> Self {
        let rng = Xorshift(0x2545_f491_4f6c_dd1d);
        Self(Arc::new(Mutex::new(Disturbance { noise: Noise::None, rng, effective_at: None })))
    }

    pub fn set(&self, noise: Noise) {
        let mut line = self.lock();
        (line.noise, line.effective_at) = (noise, None);
    }

    /// When the disturbance took effect: before that it was not detectable.
    pub fn effective_at(&self) -> Option<Instant> {
        self.lock().effective_at
    }

    fn lock(&self) -> MutexGuard<'_, Disturbance> {
        self.0.lock()
    }
}

impl Disturbance {
    /// Records that data were disturbed.
    fn mark_effective(&mut self) {
        let is_continuous = !matches!(self.noise, Noise::Flips(_) | Noise::LostWrites(_));
        self.effective_at = self.effective_at.filter(|_| is_continuous).or_else(|| Some(time::now()));
    }

    /// Counts down the events for which the disturbance lasts.
    fn ends_after(&mut self, left: usize) {
        if left == 0 {
            self.noise = Noise::None;
        }
    }
}

/// A serial line with a disturbance.
pub struct NoisyLine {
    port: Box<dyn SerialLine>,
    control: LineControl,
}

impl NoisyLine {
    pub fn new(port: &str, control: &LineControl) -> Self {
        Self { port: line_to(port, 115_200), control: control.clone() }
    }
}

impl SerialLine for NoisyLine {
    fn port_name(&self) -> String {
        self.port.port_name()
    }

    fn reopen(&mut self) -> Result<(), SerialLineError> {
        self.port.reopen()
    }

    fn close(&mut self) {
        self.port.close();
    }

    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError> {
        let n = self.port.read(buffer, wait)?;
        let line = &mut *self.control.lock();
        if n == 0 || matches!(line.noise, Noise::None | Noise::LostWrites(_)) {
            return Ok(n);
        }
        line.mark_effective();
        Ok(match &mut line.noise {
            Noise::None | Noise::LostWrites(_) => n,
            Noise::Silence => 0,
            Noise::Halves => n.div_ceil(2),
            Noise::Garbage => {
                buffer[..n].iter_mut().for_each(|byte| *byte = line.rng.roll(256) as u8);
                n
            }
            Noise::Flips(left) => {
                buffer[line.rng.roll(n)] ^= 1 << line.rng.roll(7);
                *left -= 1;
                let left = *left;
                line.ends_after(left);
                n
            }
        })
    }

    fn writer(&self) -> Result<Box<dyn SerialWriter>, SerialLineError> {
        Ok(Box::new(NoisyWriter { writer: self.port.writer()?, control: self.control.clone() }))
    }
}

struct NoisyWriter {
    writer: Box<dyn SerialWriter>,
    control: LineControl,
}

impl SerialWriter for NoisyWriter {
    fn write_now(&mut self, bytes: &[u8]) -> Result<(), SerialLineError> {
        let kept = {
            let line = &mut *self.control.lock();
            match &mut line.noise {
                Noise::LostWrites(left) => {
                    *left -= 1;
                    let left = *left;
                    line.mark_effective();
                    line.ends_after(left);
                    bytes.len() / 2
                }
                _ => bytes.len(),
            }
        };
        self.writer.write_now(&bytes[..kept])
    }
}
