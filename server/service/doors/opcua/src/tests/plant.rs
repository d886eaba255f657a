//! A scripted station, and the Python client.

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use app::doors::{Delivery, DeviceIdentity, Door as _, EventRecord, MachineState, OperationalState, now_ms};
use app::health::{CalibrationInUse, Health, HealthState, StationHealth, WatchOutcome};
use async_trait::async_trait;
use parking_lot::Mutex;
use serde_json::Value;
use tempfile::TempDir;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::door::OpcUaDoor;
use crate::line::{Condition, Devices, Finished, Line, Recipe, ResultFilter, StartJob};
use crate::refusal::Refusal;
use crate::settings::{Settings, User};
use crate::tests::inspection;

/// A password that no client guesses.
pub const PASSWORD: &str = "correct horse battery staple";

/// The policy of most tests.
pub const POLICY: &str = "Basic256Sha256";

/// A part at which the station fails.
pub const FAULTY: &str = "S-faulty";

/// What happens then, and what to do.
pub const FAULT: &str = "the stage stalled; free the carriage";

/// Time of the scan that the watches saw.
pub const SCANNED_AT_MS: i64 = 1_764_164_142_100;

/// When the active calibration was computed.
pub const CALIBRATED_AT_MS: i64 = 1_764_000_000_000;

/// A server with its folder.
pub struct Plant {
    pub folder: TempDir,
    pub line: Arc<ScriptedLine>,
    address: SocketAddr,
    running: Vec<JoinHandle<()>>,
    door: Option<Arc<OpcUaDoor>>,
}

/// A station whose inspections end at once; results are stored, and delivered in order.
pub struct ScriptedLine {
    pub condition: watch::Sender<Condition>,
    pub calls: Mutex<Vec<String>>,
    pub stored: watch::Sender<Vec<Finished>>,
    unfinished: watch::Sender<Vec<EventRecord>>,
    /// When it failed, ms since 1970.
    pub failed_at_ms: AtomicI64,
}

impl Plant {
    /// In the state Ready, not serving yet.
    pub fn new() -> Self {
        // The port is free now, and is not given to others so soon.
        let address = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap();
        let line = ScriptedLine {
            condition: watch::Sender::default(),
            calls: Mutex::default(),
            stored: watch::Sender::default(),
            unfinished: watch::Sender::default(),
            failed_at_ms: AtomicI64::new(0),
        };
        line.enter(MachineState::Preoperational);
        line.enter(MachineState::Operational(OperationalState::Initialized));
        line.enter(MachineState::Operational(OperationalState::Ready));
        line.condition.send_modify(|condition| {
            (condition.health, condition.devices) = (Some(healthy()), devices());
        });
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("password"), format!("{PASSWORD}\n")).unwrap();
        Self { folder, line: Arc::new(line), address, running: Vec::new(), door: None }
    }

    /// One user, commands on.
    pub fn settings(&self) -> Settings {
        Settings {
            name: "scada".to_owned(),
            listen: self.address,
            host: None,
            certificates: self.pki(),
            users: vec![User { name: "mes".to_owned(), password_file: self.folder.path().join("password") }],
            commands: true,
            anonymous: false,
            recipes: Vec::new(),
        }
    }

    /// The folder of certificates.
    pub fn pki(&self) -> PathBuf {
        self.folder.path().join("pki")
    }

    /// Starts server and deliveries; returns once it listens.
    pub async fn start(&mut self, settings: Settings) {
        let door = Arc::new(OpcUaDoor::new(settings).unwrap());
        let (serving, line) = (door.clone(), self.line.clone());
        self.running.push(tokio::spawn(async move {
            let condition = line.condition.subscribe();
            serving.run(line, condition, std::future::pending()).await;
        }));
        while let Err(reason) = door.deliver(&Delivery::test("scada")).await {
            assert!(reason.to_string().contains("starting"), "{reason}");
            tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        }
        let (delivering, line) = (door.clone(), self.line.clone());
        let mut unfinished = line.unfinished.subscribe();
        let (delivering_unfinished, mut n_unfinished) = (door.clone(), 0);
        self.running.push(tokio::spawn(async move {
            while unfinished.changed().await.is_ok() {
                let all = unfinished.borrow_and_update().clone();
                for event in &all[n_unfinished..] {
                    assert!(delivering_unfinished.wants(event), "{event:?}");
                    delivering_unfinished.deliver(&Delivery::new(event.clone(), None)).await.unwrap();
                }
                n_unfinished = all.len();
            }
        }));
        let mut stored = line.stored.subscribe();
        let mut n_delivered = stored.borrow().len();
        self.running.push(tokio::spawn(async move {
            while stored.changed().await.is_ok() {
                let all = stored.borrow_and_update().clone();
                for finished in &all[n_delivered..] {
                    delivering.deliver(&delivery(finished)).await.unwrap();
                }
                n_delivered = all.len();
            }
        }));
        self.door = Some(door);
    }

    /// Ends the server wherever it is, as a crash does.
    pub async fn kill(&mut self) {
        for task in self.running.drain(..) {
            task.abort();
            let _ = task.await;
        }
        self.door = None;
    }

    /// Moves all rejected certificates to the trusted ones, as an administrator does.
    pub fn trust_rejected(&self) -> usize {
        let rejected: Vec<_> =
            std::fs::read_dir(self.pki().join("rejected")).unwrap().map(|entry| entry.unwrap()).collect();
        for entry in &rejected {
            std::fs::rename(entry.path(), self.pki().join("trusted").join(entry.file_name())).unwrap();
        }
        rejected.len()
    }

    /// Runs the client; `None` without Python.
    pub async fn client(&self, policy: &str, user: &str, password: &str, arguments: &[&str]) -> Option<Output> {
        let python = reference::python()?;
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/client.py");
        let mut command = Command::new(python);
        command.arg(script).arg(format!("opc.tcp://{}", self.address)).arg(self.folder.path());
        command.args([policy, user, password]).args(arguments).stdin(Stdio::null());
        Some(tokio::task::spawn_blocking(move || command.output().unwrap()).await.unwrap())
    }

    /// Runs the second client, as the user; `None` without its packages.
    pub async fn second_client(&self, arguments: &[&str]) -> Option<Output> {
        let modules = reference::node_modules()?;
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/client.cjs");
        let mut command = Command::new("node");
        command.arg(script).arg(format!("opc.tcp://{}", self.address)).arg(self.folder.path());
        command.args(["mes", PASSWORD]).args(arguments).env("NODE_PATH", modules).stdin(Stdio::null());
        Some(tokio::task::spawn_blocking(move || command.output().unwrap()).await.unwrap())
    }

    /// Runs the client as the user, with a trusted certificate.
    pub async fn user(&self, arguments: &[&str]) -> Option<Value> {
        Some(answer(&self.client(POLICY, "mes", PASSWORD, arguments).await?))
    }

    /// Makes the client's certificate known and trusted; `None` without Python.
    pub async fn introduce(&self) -> Option<()> {
        let refused = self.client(POLICY, "mes", PASSWORD, &["connect"]).await?;
        assert!(!refused.status.success(), "an unknown client was let in");
        assert_eq!(self.trust_rejected(), 1, "{}", String::from_utf8_lossy(&refused.stderr));
        Some(())
    }
}

/// What the client printed.
pub fn answer(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// All is well; two watches have seen a scan.
fn healthy() -> StationHealth {
    let outcome = |watch: &str, state: &str| WatchOutcome {
        watch: watch.to_owned(),
        state: state.to_owned(),
        reason: String::new(),
        at_ms: SCANNED_AT_MS,
    };
    StationHealth {
        watches: vec![outcome("lost_steps", "quiet"), outcome("wavelength", "blind")],
        calibration: Some(CalibrationInUse { id: "c".to_owned(), created_at_ms: CALIBRATED_AT_MS }),
        ..StationHealth::default()
    }
}

/// A camera and a stage are connected; the laser is not.
fn devices() -> Devices {
    let identity = |model: &str| DeviceIdentity {
        vendor: "Maker".to_owned(),
        model: model.to_owned(),
        serial: "4711".to_owned(),
        ..DeviceIdentity::unknown("none")
    };
    Devices {
        camera: Some(identity("Eye")),
        stage: Some(identity("Slide")),
        frames_lost: Some(3),
        homed: Some(true),
        ..Devices::default()
    }
}

fn delivery(finished: &Finished) -> Delivery {
    let event = EventRecord {
        seq: finished.inspection.seq,
        kind: "inspection.finished".to_owned(),
        subject: finished.inspection.id.clone(),
        body: serde_json::json!({ "recipe": "bracket@7", "re_evaluated_from": null, "serial": finished.inspection.serial }),
        at_ms: finished.inspection.inspected_at_ms,
    };
    Delivery::new(event, Some(finished.inspection.clone()))
}

impl ScriptedLine {
    /// The station enters a state.
    pub fn enter(&self, state: MachineState) {
        self.condition.send_modify(|condition| {
            let number = condition.changes.len() as u64 + 1;
            condition.changes.push((number, state));
        });
    }

    /// A part is inspected, by whomever.
    pub fn inspect(&self, serial: &str, job: Option<StartJob>) -> String {
        let n = self.stored.borrow().len() as i64 + 1;
        let job_id = format!("job-{n}");
        self.condition.send_modify(|condition| condition.job_id = Some(job_id.clone()));
        self.enter(MachineState::Operational(OperationalState::SingleExecution));
        let mut inspection = inspection(n, serial);
        let attributes = job.into_iter().flat_map(|job| job.attributes);
        inspection.attributes = attributes.map(|(key, value)| (key.to_owned(), value)).collect();
        let finished = Finished { inspection, job_id: Some(job_id.clone()) };
        self.stored.send_modify(|stored| stored.push(finished));
        // The station leaves a job by way of Initialized.
        self.enter(MachineState::Operational(OperationalState::Initialized));
        self.enter(MachineState::Operational(OperationalState::Ready));
        job_id
    }

    /// A job fails by a fault, which is acknowledged at once; the stage is out of order until a reset.
    fn fail(&self) -> String {
        self.enter(MachineState::Operational(OperationalState::SingleExecution));
        let since_ms = now_ms();
        self.failed_at_ms.store(since_ms, Ordering::Relaxed);
        self.condition.send_modify(|condition| {
            condition.fault = Some(FAULT.to_owned());
            let message = FAULT.to_owned();
            let failed = Health { state: HealthState::Failure, message, since_ms: Some(since_ms) };
            condition.health = Some(StationHealth { stage: failed.clone(), station: failed, ..healthy() });
        });
        self.enter(MachineState::Error);
        self.enter(MachineState::Preoperational);
        let body = serde_json::json!({ "id": "job-failed", "kind": "inspection", "state": "failed", "serial": FAULTY,
            "recipe": "bracket@7", "message": "failed" });
        let (kind, subject) = ("job.failed".to_owned(), "job-failed".to_owned());
        let failed = EventRecord { seq: 99, kind, subject: subject.clone(), body, at_ms: since_ms };
        self.unfinished.send_modify(|all| all.push(failed));
        subject
    }

    fn call(&self, user: &str, what: &str) {
        self.calls.lock().push(format!("{user} {what}"));
    }
}

#[async_trait]
impl Line for ScriptedLine {
    async fn start(&self, user: &str, job: StartJob) -> Result<String, Refusal> {
        self.call(user, &format!("start {} {:?}", job.serial, job.recipe));
        if job.recipe.as_deref() != Some("bracket") {
            return Err(Refusal::NoRecipe);
        }
        if job.serial == FAULTY {
            return Ok(self.fail());
        }
        let serial = job.serial.clone();
        Ok(self.inspect(&serial, Some(job)))
    }

    async fn abort(&self, user: &str, job_id: &str) -> Result<(), Refusal> {
        self.call(user, &format!("abort {job_id}"));
        Ok(())
    }

    async fn halt(&self, user: &str) -> Result<(), Refusal> {
        self.call(user, "halt");
        self.enter(MachineState::Halted);
        Ok(())
    }

    async fn reset(&self, user: &str) -> Result<(), Refusal> {
        self.call(user, "reset");
        self.condition.send_modify(|condition| condition.health = Some(healthy()));
        self.enter(MachineState::Preoperational);
        Ok(())
    }

    fn newest_change(&self) -> u64 {
        self.condition.borrow().changes.len() as u64
    }

    async fn recipes(&self) -> Result<Vec<Recipe>, Refusal> {
        Ok(vec![Recipe { id: "bracket".to_owned(), version: 7, digest: "00ff".to_owned() }])
    }

    async fn result(&self, id: &str) -> Result<Finished, Refusal> {
        let found = self.stored.borrow().iter().find(|finished| finished.inspection.id == id).cloned();
        found.ok_or(Refusal::NoResult)
    }

    async fn results(
        &self,
        filter: &ResultFilter,
        skip: usize,
        limit: usize,
    ) -> Result<(Vec<Finished>, bool), Refusal> {
        let stored = self.stored.borrow().clone();
        let is_listed =
            |one: &Finished| filter.serial.as_ref().is_none_or(|serial| *serial == one.inspection.serial);
        let all: Vec<Finished> = stored.into_iter().rev().filter(is_listed).skip(skip).collect();
        Ok((all.iter().take(limit).cloned().collect(), all.len() <= limit))
    }
}
