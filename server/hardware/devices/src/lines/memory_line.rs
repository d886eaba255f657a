//! A serial line inside this process for simulated time, equivalent to a pseudo-terminal in real time.

use parking_lot::{Mutex, MutexGuard};
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::lines::serial_line::{SerialLine, SerialLineError, SerialWriter};
use crate::time;

/// Size of the receive buffer, as of a terminal.
const BUFFER_BYTES: usize = 4096;

/// The ports of this process, by path.
static PORTS: Mutex<BTreeMap<PathBuf, Arc<Mutex<Wires>>>> = Mutex::new(BTreeMap::new());

#[derive(Debug, Default)]
struct Wires {
    to_controller: VecDeque<u8>,
    to_computer: VecDeque<u8>,
    is_cut: bool,
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock()
}

fn read(wires: &Mutex<Wires>, end: fn(&mut Wires) -> &mut VecDeque<u8>, buffer: &mut [u8]) -> Option<usize> {
    let mut wires = lock(wires);
    if wires.is_cut {
        return Some(0);
    }
    let waiting = end(&mut wires);
    let n = waiting.len().min(buffer.len());
    buffer.iter_mut().zip(waiting.drain(..n)).for_each(|(to, from)| *to = from);
    (n > 0).then_some(n)
}

fn write(waiting: &mut VecDeque<u8>, bytes: &[u8]) {
    let room = BUFFER_BYTES.saturating_sub(waiting.len());
    waiting.extend(&bytes[..bytes.len().min(room)]);
}

/// The controller's end; dropping it cuts the cable.
pub struct MemoryPort {
    port_name: PathBuf,
    wires: Arc<Mutex<Wires>>,
}

impl MemoryPort {
    pub fn open(port_name: &Path) -> Self {
        let wires = Arc::default();
        lock(&PORTS).insert(port_name.to_owned(), Arc::clone(&wires));
        Self { port_name: port_name.to_owned(), wires }
    }

    /// Reads received bytes, waiting for `wait` at most; 0 if there are none.
    pub fn read(&mut self, buffer: &mut [u8], wait: Duration) -> usize {
        time::poll_for(wait, || read(&self.wires, |wires| &mut wires.to_controller, buffer)).unwrap_or(0)
    }

    pub fn write(&mut self, bytes: &[u8]) {
        write(&mut lock(&self.wires).to_computer, bytes);
    }
}

impl Drop for MemoryPort {
    fn drop(&mut self) {
        lock(&self.wires).is_cut = true;
        let mut ports = lock(&PORTS);
        if ports.get(&self.port_name).is_some_and(|wires| Arc::ptr_eq(wires, &self.wires)) {
            ports.remove(&self.port_name);
        }
    }
}

/// The computer's end.
pub struct MemoryLine {
    port_name: String,
    wires: Option<Arc<Mutex<Wires>>>,
}

impl MemoryLine {
    /// The port at `port_name`, not open yet.
    pub fn new(port_name: &str) -> Self {
        Self { port_name: port_name.to_owned(), wires: None }
    }

    fn wires(&self) -> Result<&Arc<Mutex<Wires>>, SerialLineError> {
        self.wires.as_ref().ok_or_else(|| SerialLineError::Closed { port_name: self.port_name.clone() })
    }
}

impl SerialLine for MemoryLine {
    fn port_name(&self) -> String {
        self.port_name.clone()
    }

    fn reopen(&mut self) -> Result<(), SerialLineError> {
        self.wires = lock(&PORTS).get(Path::new(&self.port_name)).cloned();
        self.wires().map(drop).map_err(|_| SerialLineError::OpenFailed {
            port_name: self.port_name.clone(),
            cause: serialport::Error::new(serialport::ErrorKind::NoDevice, "there is no such port"),
        })
    }

    fn close(&mut self) {
        self.wires = None;
    }

    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError> {
        let wires = self.wires()?;
        match time::poll_for(wait, || read(wires, |wires| &mut wires.to_computer, buffer)) {
            Some(0) => Err(SerialLineError::Disconnected { port_name: self.port_name.clone(), cause: None }),
            n => Ok(n.unwrap_or(0)),
        }
    }

    fn writer(&self) -> Result<Box<dyn SerialWriter>, SerialLineError> {
        Ok(Box::new(MemoryWriter { port_name: self.port_name.clone(), wires: Arc::clone(self.wires()?) }))
    }
}

struct MemoryWriter {
    port_name: String,
    wires: Arc<Mutex<Wires>>,
}

impl SerialWriter for MemoryWriter {
    fn write_now(&mut self, bytes: &[u8]) -> Result<(), SerialLineError> {
        let mut wires = lock(&self.wires);
        if wires.is_cut {
            return Err(SerialLineError::Disconnected { port_name: self.port_name.clone(), cause: None });
        }
        write(&mut wires.to_controller, bytes);
        Ok(())
    }
}
