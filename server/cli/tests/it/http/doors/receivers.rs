//! The other ends of the doors, each by another author: a web server in Python, mosquitto, pymodbus, asyncua, a
//! folder.

use std::fs::{self, File};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Secrets of the web server, one after the other.
const SECRETS: [&str; 2] =
    ["whsec_c2hlYWYtdGVzdC1zZWNyZXQtd2l0aC0zMi1ieXRlcyE=", "whsec_bmV4dC10ZXN0LXNlY3JldC13aXRoLTMyLWJ5dGVzISE="];
const WEB: &str = include_str!("web_receiver.py");
const PLC: &str = include_str!("plc.py");
const OPC_UA: &str = include_str!("../../../../../service/doors/opcua/tests/client.py");
const PASSWORD: &str = "correct horse battery staple";
const PATIENCE: Duration = Duration::from_secs(180);

/// All receivers, on ports and folders of their own.
pub struct Receivers {
    python: PathBuf,
    folder: PathBuf,
    web_port: u16,
    broker_port: u16,
    plc_port: u16,
    opcua_port: u16,
    secret: &'static str,
    running: Vec<Child>,
}

impl Receivers {
    /// Running.
    pub fn start(python: PathBuf, folder: &Path) -> Self {
        let folder = folder.to_owned();
        let files = [
            ("secret", SECRETS[0]),
            ("password", PASSWORD),
            ("web_receiver.py", WEB),
            ("plc.py", PLC),
            ("client.py", OPC_UA),
        ];
        for (name, text) in files {
            fs::write(folder.join(name), text).unwrap();
        }
        for name in ["share", "orders"] {
            fs::create_dir(folder.join(name)).unwrap();
        }
        let [web_port, broker_port, plc_port, opcua_port] = free_ports();
        let broker = format!(
            "listener {broker_port} 127.0.0.1\nallow_anonymous true\nuser root\npersistence true\n\
             persistence_location {}/\nlog_type none\n",
            folder.display()
        );
        fs::write(folder.join("mosquitto.conf"), broker).unwrap();
        let (running, secret) = (Vec::new(), SECRETS[0]);
        let mut receivers = Self { python, folder, web_port, broker_port, plc_port, opcua_port, secret, running };
        receivers.restore();
        receivers.subscribe();
        receivers
    }

    /// The doors that deliver to them, as configuration.
    pub fn configuration(&self) -> String {
        let folder = self.folder.display();
        let Self { web_port, broker_port, plc_port, opcua_port, .. } = self;
        format!(
            "[[doors.folder]]\nname = \"share\"\npath = \"{folder}/share\"\nformats = [\"json\", \"csv\", \"dfq\", \"pdf\"]\n\
             orders = \"{folder}/orders\"\n\
             [[doors.webhook]]\nname = \"mes\"\nurl = \"http://127.0.0.1:{web_port}/sheaf\"\n\
             secret_file = \"{folder}/secret\"\nallowed_private = [\"127.0.0.1/32\"]\n\
             events = [\"inspection.finished\", \"control_chart.rule_violated\"]\n\
             [[doors.mqtt]]\nname = \"broker\"\nurl = \"mqtt://127.0.0.1:{broker_port}\"\ncommands = true\n\
             [[doors.modbus]]\nname = \"plc\"\nlisten = \"127.0.0.1:{plc_port}\"\nwrites = true\n\
             [[doors.opcua]]\nname = \"scada\"\nlisten = \"127.0.0.1:{opcua_port}\"\ncommands = true\n\
             certificates = \"{folder}/pki\"\n\
             users = [{{ name = \"mes\", password_file = \"{folder}/password\" }}]\n"
        )
    }

    /// Ends web server and broker, and takes the share away. The web server gets its next secret; both sign meanwhile.
    pub fn cut(&mut self) {
        self.secret = SECRETS[1];
        fs::write(self.folder.join("secret"), SECRETS.join("\n")).unwrap();
        for mut child in self.running.drain(..) {
            // The broker writes what it keeps for absent subscribers.
            let pid = nix::unistd::Pid::from_raw(child.id().cast_signed());
            nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGTERM).unwrap();
            child.wait().unwrap();
        }
        fs::rename(self.folder.join("share"), self.folder.join("away")).unwrap();
    }

    /// Starts them, and returns the share.
    pub fn restore(&mut self) {
        let away = self.folder.join("away");
        if away.exists() {
            fs::rename(away, self.folder.join("share")).unwrap();
        }
        let mut web = Command::new(&self.python);
        web.arg(self.folder.join("web_receiver.py")).args([&self.web_port.to_string(), self.secret]);
        web.arg(self.web_file());
        let mut broker = Command::new(program("mosquitto"));
        broker.arg("-c").arg(self.folder.join("mosquitto.conf"));
        for mut command in [web, broker] {
            self.running.push(command.stdin(Stdio::null()).stdout(Stdio::null()).spawn().unwrap());
        }
        for port in [self.web_port, self.broker_port] {
            let begun = Instant::now();
            while std::net::TcpStream::connect(("127.0.0.1", port)).is_err() {
                assert!(begun.elapsed() < PATIENCE, "nobody listens on port {port}");
                std::thread::sleep(Duration::from_millis(50));
            }
        }
    }

    /// Leaves a subscription with the broker, which keeps messages for it while the subscriber is absent.
    fn subscribe(&self) {
        self.subscriber(&["-E"]);
    }

    fn subscriber(&self, arguments: &[&str]) -> String {
        let port = self.broker_port.to_string();
        let output = Command::new(program("mosquitto_sub"))
            .args(["-p", &port, "-V", "mqttv5", "-q", "1", "-c", "-x", "3600", "-i", "mes"])
            .args(["-t", "sheaf/station/result"])
            .args(arguments)
            .stderr(Stdio::inherit())
            .output()
            .unwrap();
        String::from_utf8(output.stdout).unwrap()
    }

    /// The answer to an MQTT command.
    pub fn mqtt(&self, command: &Value) -> Value {
        let mut client = Command::new(program("mosquitto_rr"));
        client.args(["-p", &self.broker_port.to_string(), "-q", "1", "-t", "sheaf/station/cmd", "-e", "answers"]);
        client.args(["-m", &command.to_string(), "-D", "publish", "message-expiry-interval", "5", "-W", "60"]);
        let output = client.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn web_file(&self) -> PathBuf {
        self.folder.join("received.jsonl")
    }

    /// What the web server received.
    pub fn web_messages(&self) -> Vec<Value> {
        lines(&fs::read_to_string(self.web_file()).unwrap_or_default())
    }

    /// What the broker kept for the subscriber, read once.
    pub fn broker_messages(&self) -> Vec<Value> {
        lines(&self.subscriber(&["-F", "%p", "-W", "3"]))
    }

    /// The JSON files in the share, in the order of their inspections.
    pub fn share_messages(&self) -> Vec<Value> {
        let files = fs::read_dir(self.folder.join("share")).unwrap().map(|entry| entry.unwrap().path());
        let json = files.filter(|path| path.extension().is_some_and(|extension| extension == "json"));
        let mut all: Vec<Value> =
            json.map(|path| serde_json::from_reader(File::open(path).unwrap()).unwrap()).collect();
        all.sort_by_key(|message| message["data"]["seq"].as_i64());
        all
    }

    /// Names of the files in the share with this extension.
    pub fn files(&self, extension: &str) -> usize {
        let files = fs::read_dir(self.folder.join("share")).unwrap().map(|entry| entry.unwrap().path());
        files.filter(|path| path.extension().is_some_and(|other| other == extension)).count()
    }

    /// The report in the share of a part, the first of it.
    pub fn report(&self, serial: &str) -> Vec<u8> {
        let files = fs::read_dir(self.folder.join("share")).unwrap().map(|entry| entry.unwrap().path());
        let is_of = |path: &PathBuf| {
            let name = path.file_name().unwrap().to_string_lossy();
            name.starts_with(&format!("{serial}_")) && name.ends_with(".pdf")
        };
        fs::read(files.filter(is_of).min().expect("there is a report")).unwrap()
    }

    /// Drops an order; returns once it is accepted.
    pub fn order(&self, order: &Value) {
        let orders = self.folder.join("orders");
        fs::write(orders.join("order.json"), order.to_string()).unwrap();
        let begun = Instant::now();
        while !orders.join("accepted").join("order.json").exists() {
            assert!(!orders.join("refused").join("order.json").exists(), "the order was refused");
            assert!(begun.elapsed() < PATIENCE, "the order is not read");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// One cycle of the PLC.
    pub fn plc(&self, arguments: &[&str]) -> Value {
        let output = Command::new(&self.python)
            .arg(self.folder.join("plc.py"))
            .arg(self.plc_port.to_string())
            .args(arguments)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }
}

impl Receivers {
    /// Trusts the certificate of the OPC UA client, which a first connection left among the rejected ones.
    pub fn trust_opcua_client(&self) {
        assert!(!self.opcua_client(&["connect"]).status.success(), "an unknown client was let in");
        let folder = |name: &str| self.folder.join("pki").join(name);
        let rejected: Vec<_> = fs::read_dir(folder("rejected")).unwrap().map(|entry| entry.unwrap()).collect();
        assert_eq!(rejected.len(), 1);
        fs::rename(rejected[0].path(), folder("trusted").join(rejected[0].file_name())).unwrap();
    }

    /// What the OPC UA client saw; it connects signed and encrypted, as a user.
    pub fn opcua(&self, arguments: &[&str]) -> Value {
        let output = self.opcua_client(arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn opcua_client(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(&self.python);
        command.arg(self.folder.join("client.py")).arg(format!("opc.tcp://127.0.0.1:{}", self.opcua_port));
        command.arg(&self.folder).args(["Basic256Sha256", "mes", PASSWORD]).args(arguments);
        command.output().unwrap()
    }
}

impl Drop for Receivers {
    fn drop(&mut self) {
        for child in &mut self.running {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Debian keeps servers where only root looks for them.
fn program(name: &str) -> PathBuf {
    let server = Path::new("/usr/sbin").join(name);
    if server.is_file() { server } else { name.into() }
}

fn free_ports<const N: usize>() -> [u16; N] {
    let listeners: Vec<_> = (0..N).map(|_| TcpListener::bind(("127.0.0.1", 0)).unwrap()).collect();
    std::array::from_fn(|idx| listeners[idx].local_addr().unwrap().port())
}
