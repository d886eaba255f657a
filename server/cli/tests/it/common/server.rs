//! The server under test: started on a free port, used over HTTP, ended on drop.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::SHEAF;

/// Longest time until the URL is printed: five seconds are promised, the rest allows for a busy machine.
const URL_WITHIN: Duration = Duration::from_secs(60);

/// Longest time a job of these tests may take on a busy machine.
const JOB_WITHIN: Duration = Duration::from_secs(300);

/// A running `sheaf serve`.
pub struct Server {
    /// The printed URL.
    pub url: String,
    child: Child,
    agent: ureq::Agent,
}

/// A response.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub headers: Vec<(String, String)>,
    pub body: Vec<u8>,
}

impl Answer {
    /// The body as JSON; panics with the body otherwise.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|error| panic!("{error}: {} {}", self.status, String::from_utf8_lossy(&self.body)))
    }

    /// The same after asserting the status.
    #[track_caller]
    pub fn expect(&self, status: u16) -> Value {
        assert_eq!(self.status, status, "{}", String::from_utf8_lossy(&self.body));
        if self.body.is_empty() { Value::Null } else { self.json() }
    }

    /// A header by its lower-case name.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }
}

impl Server {
    /// Starts with a data folder on a free port, with further arguments.
    #[track_caller]
    pub fn start(data: &Path, arguments: &[&str]) -> Self {
        Self::start_with(data, arguments, &[])
    }

    /// The same with environment variables.
    #[track_caller]
    pub fn start_with(data: &Path, arguments: &[&str], environment: &[(&str, &str)]) -> Self {
        Self::start_by(Command::new(SHEAF), data, arguments, environment)
    }

    /// Starts with the data folder on a disk of `size_mib`. `None` without permission to create one: the calling test is
    /// then recorded as not run and must return.
    #[track_caller]
    pub fn start_on_small_disk(data: &Path, size_mib: u32) -> Option<Self> {
        let alone = |command: &mut Command| {
            command.args(["--user", "--map-root-user", "--mount", "sh", "-c"]);
        };
        let mount = format!("mount -t tmpfs -o size={size_mib}m none \"$0\"");
        std::fs::create_dir_all(data).unwrap();
        let mut trial = Command::new("unshare");
        alone(&mut trial);
        let trial = trial.arg(&mount).arg(data).stderr(Stdio::null()).status();
        if !trial.is_ok_and(|status| status.success()) {
            reference::without_small_disk();
            return None;
        }
        let mut command = Command::new("unshare");
        alone(&mut command);
        command.arg(format!("{mount} && exec \"$@\"")).arg(data).arg(SHEAF);
        Some(Self::start_by(command, data, &[], &[]))
    }

    #[track_caller]
    fn start_by(mut command: Command, data: &Path, arguments: &[&str], environment: &[(&str, &str)]) -> Self {
        let mut child = command
            .args(["serve", "--listen", "127.0.0.1:0", "--data"])
            .arg(data)
            .args(arguments)
            .envs(environment.iter().copied())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(std::fs::OpenOptions::new().create(true).append(true).open(log_of(data)).unwrap())
            .spawn()
            .unwrap();
        let (sender, receiver) = std::sync::mpsc::channel();
        let stdout = child.stdout.take().unwrap();
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
        let line = receiver.recv_timeout(URL_WITHIN).unwrap_or_else(|error| {
            let _ = child.kill();
            panic!("no URL: {error}; log:\n{}", std::fs::read_to_string(log_of(data)).unwrap_or_default())
        });
        let from = line.find("http://").unwrap_or_else(|| panic!("no URL in `{line}`"));
        let url = line[from..].split_whitespace().next().unwrap().trim_end_matches('/').to_owned();
        let agent = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .timeout_global(Some(Duration::from_secs(120)))
            // The server closes connections that are silent for 10 s; one that is closing must not be used again.
            .max_idle_age(Duration::from_secs(5))
            .build()
            .into();
        Self { url, child, agent }
    }

    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// `127.0.0.1:port`.
    pub fn address(&self) -> &str {
        self.url.trim_start_matches("http://")
    }

    /// One request; `Err` if the connection broke.
    pub fn try_send(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: &[u8],
    ) -> Result<Answer, ureq::Error> {
        let uri = if path.starts_with("http://") { path.to_owned() } else { format!("{}{path}", self.url) };
        let mut request = ureq::http::Request::builder().method(method).uri(uri);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let mut response = self.agent.run(request.body(body.to_vec())?)?;
        let headers = response
            .headers()
            .iter()
            .map(|(name, value)| {
                (name.as_str().to_owned(), String::from_utf8_lossy(value.as_bytes()).into_owned())
            })
            .collect();
        let status = response.status().as_u16();
        let body = response.body_mut().with_config().limit(1 << 31).read_to_vec()?;
        Ok(Answer { status, headers, body })
    }

    #[track_caller]
    pub fn send(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        self.try_send(method, path, headers, body).unwrap_or_else(|error| panic!("{method} {path}: {error}"))
    }

    #[track_caller]
    pub fn get(&self, path: &str) -> Answer {
        self.send("GET", path, &[], &[])
    }

    #[track_caller]
    pub fn post(&self, path: &str, body: &Value) -> Answer {
        self.send("POST", path, &[("content-type", "application/json")], body.to_string().as_bytes())
    }

    #[track_caller]
    pub fn put(&self, path: &str, body: &Value) -> Answer {
        self.send("PUT", path, &[("content-type", "application/json")], body.to_string().as_bytes())
    }

    /// Starts a job and waits for its end.
    #[track_caller]
    pub fn run_job(&self, path: &str, body: &Value) -> Value {
        let accepted = self.post(path, body);
        accepted.expect(202);
        self.wait_for_job(accepted.header("location").expect("a Location"))
    }

    /// Starts a job, asserts success, and returns the id of its result.
    #[track_caller]
    pub fn result_of(&self, path: &str, body: &Value) -> String {
        let job = self.run_job(path, body);
        assert_eq!(job["state"], "succeeded", "{job:#}");
        job["result"]["id"].as_str().unwrap().to_owned()
    }

    /// The job once it has ended.
    #[track_caller]
    pub fn wait_for_job(&self, location: &str) -> Value {
        let begun = Instant::now();
        loop {
            let job = self.get(location).expect(200);
            if !matches!(job["state"].as_str(), Some("queued" | "running")) {
                return job;
            }
            assert!(begun.elapsed() < JOB_WITHIN, "still {job:#}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Uploads a capture folder as a zip archive.
    #[track_caller]
    pub fn upload(&self, folder: &Path) -> String {
        let answer =
            self.send("POST", "/api/v1/captures", &[("content-type", "application/zip")], &zip_of(folder));
        answer.expect(201)["id"].as_str().unwrap().to_owned()
    }

    /// Kills the process.
    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Sends SIGTERM and waits for the end.
    pub fn terminate(mut self) -> ExitStatus {
        assert!(Command::new("kill").args(["-TERM", &self.child.id().to_string()]).status().unwrap().success());
        self.child.wait().unwrap()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// File with its stderr, beside the data folder, so that a failed test can show it.
pub fn log_of(data: &Path) -> PathBuf {
    data.with_extension("log")
}

/// A capture folder as a zip archive, its images stored uncompressed.
pub fn zip_of(folder: &Path) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for file in capture::Capture::open(folder).unwrap().files() {
        archive.start_file(file.path.to_string_lossy(), options).unwrap();
        archive.write_all(&std::fs::read(folder.join(&file.path)).unwrap()).unwrap();
    }
    archive.start_file("capture.json", options).unwrap();
    archive.write_all(&std::fs::read(folder.join("capture.json")).unwrap()).unwrap();
    archive.finish().unwrap().into_inner()
}
