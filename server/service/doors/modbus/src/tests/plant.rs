//! A scripted station with a log that survives the end of the server, as the outbox does.

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use app::doors::{Door as _, MachineState, OperationalState};
use async_trait::async_trait;
use parking_lot::Mutex;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::codes::AckCode;
use crate::door::ModbusDoor;
use crate::line::{JobEnd, Line, Station, TriggeredPart};
use crate::server::{Limits, serve};
use crate::settings::Settings;
use crate::tests::{delivery, inspection};

/// Events are numbered otherwise than inspections.
const FIRST_EVENT: i64 = 100;

/// As in the service.
const PATIENCE: Duration = Duration::from_secs(60);

/// What survives the end of the server.
pub struct Plant {
    pub address: SocketAddr,
    pub line: Arc<ScriptedLine>,
    /// Event of the last result whose delivery is stored.
    position: Arc<Mutex<i64>>,
    /// Set: the next acknowledgement is not stored, and nothing is delivered after it.
    crashing: watch::Sender<Crash>,
    /// Time after which the server closes a silent connection, and reports a result as waiting.
    pub patience: Duration,
    running: Option<Running>,
}

/// A crash between an acknowledgement and its storage.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Crash {
    None,
    Planned,
    Reached,
}

struct Running {
    door: Arc<ModbusDoor>,
    tasks: Vec<JoinHandle<()>>,
}

/// A station whose inspections end at once.
pub struct ScriptedLine {
    pub station: Mutex<Station>,
    /// What was called, with the source's address but not its port.
    pub calls: Mutex<Vec<String>>,
    /// Serial numbers in the order of inspection.
    pub inspected: watch::Sender<Vec<String>>,
    /// Number of the inspection before the first.
    pub before_first: i64,
    /// The outcome of triggers.
    pub refuses: Mutex<Option<AckCode>>,
    /// Whether inspections end; otherwise they run until they are aborted.
    pub ends: watch::Sender<bool>,
}

pub const READY: Station =
    Station { state: MachineState::Operational(OperationalState::Ready), stopped: false, simulated: true };

impl Plant {
    /// Inspections are numbered after `before_first`.
    pub fn new(before_first: i64) -> Self {
        // The port is free now, and is not given to others so soon.
        let address = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap();
        let line = Arc::new(ScriptedLine {
            station: Mutex::new(READY),
            calls: Mutex::default(),
            inspected: watch::Sender::default(),
            before_first,
            refuses: Mutex::default(),
            ends: watch::Sender::new(true),
        });
        Self {
            address,
            line,
            position: Arc::new(Mutex::new(FIRST_EVENT)),
            crashing: watch::Sender::new(Crash::None),
            patience: PATIENCE,
            running: None,
        }
    }

    pub fn settings(&self) -> Settings {
        Settings {
            name: "plc".to_owned(),
            listen: self.address,
            writes: true,
            recipes: Vec::new(),
            max_connections: 8,
        }
    }

    pub fn start(&mut self) {
        self.start_with(self.settings());
    }

    /// Starts server and deliveries.
    pub fn start_with(&mut self, settings: Settings) {
        let limits = Limits { max_connections: settings.max_connections, idle: self.patience };
        let mut door = ModbusDoor::new(settings).unwrap();
        door.patience = self.patience;
        let door = Arc::new(door);
        let serving = tokio::spawn(serve(door.shared.clone(), self.line.clone(), self.address, limits));
        let delivering = tokio::spawn(deliver_all(
            door.clone(),
            self.line.clone(),
            self.position.clone(),
            self.crashing.clone(),
        ));
        self.running = Some(Running { door, tasks: vec![serving, delivering] });
    }

    pub fn door(&self) -> &Arc<ModbusDoor> {
        &self.running.as_ref().unwrap().door
    }

    /// Ends the server wherever it is, as a crash does.
    pub async fn kill(&mut self) {
        let Some(running) = self.running.take() else { return };
        for task in running.tasks {
            task.abort();
            let _ = task.await;
        }
    }

    /// Ends the server after an acknowledgement that is not stored.
    pub async fn kill_before_storing(&mut self) {
        self.crashing.send_replace(Crash::Planned);
        let _ = self.crashing.subscribe().wait_for(|crash| *crash == Crash::Reached).await;
        self.kill().await;
        self.crashing.send_replace(Crash::None);
    }

    /// Waits until the delivery of so many results is stored.
    pub async fn stored(&self, n: usize) {
        while *self.position.lock() < FIRST_EVENT + n as i64 {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
}

/// As the task of a door in the service: in order, and stored after the acknowledgement.
async fn deliver_all(
    door: Arc<ModbusDoor>,
    line: Arc<ScriptedLine>,
    position: Arc<Mutex<i64>>,
    crashing: watch::Sender<Crash>,
) {
    let mut inspected = line.inspected.subscribe();
    let mut noted = *position.lock();
    loop {
        let serials = inspected.borrow_and_update().clone();
        let last = FIRST_EVENT + serials.len() as i64;
        (noted + 1..=last).for_each(|event_seq| door.shared.handshake.lock().results.note(event_seq));
        noted = noted.max(last);
        let event_seq = *position.lock() + 1;
        let idx = (event_seq - FIRST_EVENT - 1) as usize;
        let Some(serial) = serials.get(idx) else {
            if inspected.changed().await.is_err() {
                return;
            }
            continue;
        };
        let result = inspection(line.before_first + idx as i64 + 1, serial);
        let delivering = delivery(event_seq, result);
        let delivered = tokio::select! {
            delivered = door.deliver(&delivering) => delivered.is_ok(),
            // More results wait, which only changes how many. The same one is offered again.
            _ = inspected.changed() => { inspected.mark_changed(); false }
        };
        if delivered {
            // Why a result may come twice.
            if *crashing.borrow() == Crash::Planned {
                crashing.send_replace(Crash::Reached);
                std::future::pending::<()>().await;
            }
            *position.lock() = event_seq;
        }
    }
}

impl ScriptedLine {
    fn call(&self, source: &str, what: &str) {
        let host = source.rsplit_once(':').map_or(source, |(host, _)| host);
        self.calls.lock().push(format!("{host} {what}"));
    }
}

#[async_trait]
impl Line for ScriptedLine {
    fn station(&self) -> Station {
        *self.station.lock()
    }

    async fn trigger(&self, source: &str, part: &TriggeredPart) -> Result<String, AckCode> {
        let TriggeredPart { recipe, serial, order } = part;
        let of_order = order.as_ref().map_or(String::new(), |order| format!(" of {order}"));
        self.call(source, &format!("trigger {recipe:?} {serial}{of_order}"));
        if let Some(code) = *self.refuses.lock() {
            return Err(code);
        }
        if *self.ends.borrow() {
            self.inspected.send_modify(|inspected| inspected.push(serial.clone()));
        }
        Ok(serial.clone())
    }

    async fn ended(&self, _job_id: &str) -> JobEnd {
        if *self.ends.borrow() {
            return JobEnd::Finished;
        }
        let _ = self.ends.subscribe().wait_for(|ends| *ends).await;
        JobEnd::Cancelled
    }

    async fn abort(&self, source: &str, job_id: &str) -> Result<(), AckCode> {
        self.call(source, &format!("abort {job_id}"));
        self.ends.send_replace(true);
        Ok(())
    }

    async fn stop(&self, source: &str) -> Result<(), AckCode> {
        self.call(source, "stop");
        let mut station = self.station.lock();
        (station.state, station.stopped) = (MachineState::Halted, true);
        Ok(())
    }

    async fn prepare(&self, recipe: u32) -> Result<(), AckCode> {
        if recipe == 12 { Ok(()) } else { Err(AckCode::NoRecipe) }
    }
}
