//! A line that disturbs what passes, on request.

use parking_lot::{Mutex, MutexGuard};
use std::sync::Arc;
use std::time::Duration;

use super::Dice;
use crate::lines::ports::line_to;
use crate::lines::serial_line::{SerialLine, SerialLineError, SerialWriter};

/// What becomes of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Noise {
    None,
    /// What comes is random bytes.
    Garbage,
    /// In each of the next reads one bit is turned.
    Flips(usize),
    /// Nothing comes.
    Silence,
    /// Of what comes, the second half is lost each time.
    Halves,
    /// The next writes are lost but for half of them.
    LostWrites(usize),
}

/// Sets the noise of a line.
#[derive(Clone)]
pub struct LineControl(Arc<Mutex<(Noise, Dice)>>);

impl LineControl {
    pub fn new() -> Self {
        Self(Arc::new(Mutex::new((Noise::None, Dice(0x2545_f491_4f6c_dd1d)))))
    }

    pub fn set(&self, noise: Noise) {
        self.lock().0 = noise;
    }

    fn lock(&self) -> MutexGuard<'_, (Noise, Dice)> {
        self.0.lock()
    }
}

/// A port whose bytes pass through the noise.
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
    fn place(&self) -> String {
        self.port.place()
    }

    fn reopen(&mut self) -> Result<(), SerialLineError> {
        self.port.reopen()
    }

    fn close(&mut self) {
        self.port.close();
    }

    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError> {
        let n = self.port.read(buffer, wait)?;
        let (noise, dice) = &mut *self.control.lock();
        Ok(match noise {
            _ if n == 0 => 0,
            Noise::None | Noise::LostWrites(_) => n,
            Noise::Silence => 0,
            Noise::Halves => n.div_ceil(2),
            Noise::Garbage => {
                buffer[..n].iter_mut().for_each(|byte| *byte = dice.roll(256) as u8);
                n
            }
            Noise::Flips(left) => {
                buffer[dice.roll(n)] ^= 1 << dice.roll(7);
                *left -= 1;
                if *left == 0 {
                    *noise = Noise::None;
                }
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
            let (noise, _) = &mut *self.control.lock();
            match noise {
                Noise::LostWrites(left) => {
                    *left -= 1;
                    if *left == 0 {
                        *noise = Noise::None;
                    }
                    bytes.len() / 2
                }
                _ => bytes.len(),
            }
        };
        self.writer.write_now(&bytes[..kept])
    }
}
