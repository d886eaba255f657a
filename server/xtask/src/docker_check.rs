//! `cargo xtask docker-check`: checks the image without a container engine. Every stage becomes a Debian 12 folder made
//! by debootstrap, its RUN steps are replayed there by chroot, and the station's program is started in the last one.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::command::{Outcome, run, target_folder, workspace};
use crate::dockerfile::{Instruction, Stage, parse};
use crate::tools::ensure_program;

/// Mirror from which the folders are created.
const MIRROR: &str = "http://deb.debian.org/debian";

/// Packages of the build stage's base image beside the toolchain.
const BUILD_PACKAGES: &str = "ca-certificates,gcc,libc6-dev,pkg-config";

/// Packages of the station's base image.
const STATION_PACKAGES: &str = "ca-certificates";

/// The port of the image.
const PORT: u16 = 8080;

/// Longest time from the program's start to its readiness: five seconds are promised, the rest allows for a busy
/// machine.
const READY_LIMIT: Duration = Duration::from_secs(30);

/// Replays the Dockerfile. With `binary` the stages before the last are skipped and that program is used instead.
pub fn docker_check(binary: Option<&Path>) -> Outcome {
    ensure_program("debootstrap", "debootstrap")?;
    let stages = parse(&std::fs::read_to_string(workspace().join("docker/Dockerfile"))?)?;
    let [page, build, station] = &stages[..] else {
        return Err("docker/Dockerfile must have the stages page, build and station".into());
    };
    let built = match binary {
        Some(binary) => binary.to_owned(),
        None => replay_build(build, &replay_page(page)?)?,
    };
    let root = debian_folder("docker-station", STATION_PACKAGES)?;
    let program = replay_station(station, &root, &built)?;
    let server = Started(start(&program, &root)?);
    wait_until_ready(server)?;
    check_unit()
}

/// Downloads the packages of the station's folder.
pub fn ensure_station_base() -> Outcome {
    ensure_program("debootstrap", "debootstrap")?;
    debian_base(STATION_PACKAGES).map(drop)
}

/// A Debian 12 folder; debootstrap runs once for each list of packages.
fn debian_base(packages: &str) -> Outcome<PathBuf> {
    let base = target_folder().join("debian").join(packages.replace(',', "-"));
    if !base.join("usr/bin/env").is_file() || !base.join(".complete").is_file() {
        let _ = std::fs::remove_dir_all(&base);
        std::fs::create_dir_all(&base)?;
        let include = format!("--include={packages}");
        let mut command = Command::new("debootstrap");
        run(
            "Debian 12",
            command.args(["--variant=minbase", &include, "bookworm"]).arg(&base).arg(MIRROR).stdout(Stdio::null()),
        )?;
        std::fs::write(base.join(".complete"), "")?;
    }
    Ok(base)
}

/// A fresh copy of a Debian 12 folder.
fn debian_folder(name: &str, packages: &str) -> Outcome<PathBuf> {
    let base = debian_base(packages)?;
    let root = target_folder().join(name);
    if root.exists() {
        std::fs::remove_dir_all(&root)?;
    }
    run("copy", Command::new("cp").args(["--archive", "--reflink=auto"]).arg(&base).arg(&root))?;
    let _ = std::fs::copy("/etc/resolv.conf", root.join("etc/resolv.conf"));
    Ok(root)
}

/// Builds the page from the files under version control with this machine's Node instead of the base image's; returns
/// the folder that corresponds to the image's root.
fn replay_page(stage: &Stage) -> Outcome<PathBuf> {
    let root = target_folder().join("docker-page");
    if root.exists() {
        std::fs::remove_dir_all(&root)?;
    }
    let mut folder = root.clone();
    for instruction in &stage.instructions {
        match instruction {
            Instruction::Workdir(path) => folder = inside(&root, path),
            Instruction::Copy { from: None, .. } => copy_context(&folder)?,
            Instruction::Run(line) => {
                run("RUN", Command::new("/bin/sh").args(["-c", line]).current_dir(&folder))?;
            }
            other => return Err(format!("the page stage must not contain {other:?}").into()),
        }
    }
    Ok(root)
}

/// Compiles in the build stage's folder with this machine's toolchain instead of the base image's.
fn replay_build(stage: &Stage, page_root: &Path) -> Outcome<PathBuf> {
    let root = debian_folder("docker-build", BUILD_PACKAGES)?;
    let mut mounts = Mounts(Vec::new());
    let home = PathBuf::from(std::env::var_os("HOME").ok_or("HOME is not set")?);
    let cargo = std::env::var_os("CARGO_HOME").map_or_else(|| home.join(".cargo"), PathBuf::from);
    let rustup = std::env::var_os("RUSTUP_HOME").map_or_else(|| home.join(".rustup"), PathBuf::from);
    mounts.add(cargo, root.join("usr/local/cargo"));
    mounts.add(rustup, root.join("usr/local/rustup"));
    // Present in every container; rustup finds its own path in /proc.
    mounts.add(PathBuf::from("/proc"), root.join("proc"));
    mounts.add(PathBuf::from("/dev"), root.join("dev"));
    let output = target_folder().join("docker-target");
    std::fs::create_dir_all(&output)?;
    let mut folder = "/".to_owned();
    for instruction in &stage.instructions {
        match instruction {
            Instruction::Workdir(path) => {
                std::fs::create_dir_all(inside(&root, path))?;
                folder = path.clone();
            }
            Instruction::Copy { from: None, .. } => {
                copy_context(&inside(&root, &folder))?;
                mounts.add(output.clone(), inside(&root, &folder).join("target"));
            }
            Instruction::Copy { from: Some(_), source, target } => {
                let to = inside(&root, &folder).join(target);
                run("copy", Command::new("cp").arg("--archive").arg(inside(page_root, source)).arg(to))?;
            }
            Instruction::Run(line) => {
                let line = format!(
                    "export PATH=/usr/local/cargo/bin:$PATH CARGO_HOME=/usr/local/cargo RUSTUP_HOME=/usr/local/rustup; \
                     cd {folder} && {line}"
                );
                run("RUN", &mut mounts.around(Command::new("chroot").arg(&root).args(["/bin/sh", "-c", &line])))?;
            }
            other => return Err(format!("the build stage must not contain {other:?}").into()),
        }
    }
    Ok(output.join("release/sheaf"))
}

/// The files under version control, as in the build context.
fn copy_context(target: &Path) -> Outcome {
    let list = Command::new("git").args(["ls-files", "-z"]).current_dir(workspace()).output()?;
    for file in list.stdout.split(|&byte| byte == 0).filter(|file| !file.is_empty()) {
        let file = std::str::from_utf8(file)?;
        let to = target.join(file);
        std::fs::create_dir_all(to.parent().unwrap_or(target))?;
        std::fs::copy(workspace().join(file), to)?;
    }
    Ok(())
}

/// Entry point with arguments, and its user.
struct Program {
    user: String,
    words: Vec<String>,
}

fn replay_station(stage: &Stage, root: &Path, built: &Path) -> Outcome<Program> {
    let mut program = Program { user: "root".to_owned(), words: Vec::new() };
    for instruction in &stage.instructions {
        match instruction {
            Instruction::Run(line) => run("RUN", Command::new("chroot").arg(root).args(["/bin/sh", "-c", line]))?,
            Instruction::Copy { from: Some(_), source, target } if source.ends_with("release/sheaf") => {
                let to = inside(root, target);
                std::fs::copy(built, &to)?;
                std::fs::set_permissions(&to, std::fs::Permissions::from_mode(0o755))?;
            }
            Instruction::User(user) => program.user = user.clone(),
            Instruction::Entrypoint(words) | Instruction::Cmd(words) => {
                program.words.extend(words.iter().cloned())
            }
            Instruction::HealthCheck(_) | Instruction::Note => {}
            other => return Err(format!("the station stage must not contain {other:?}").into()),
        }
    }
    Ok(program)
}

/// Starts the program as its user inside the folder, on the loopback address.
fn start(program: &Program, root: &Path) -> Outcome<Child> {
    if TcpStream::connect(("127.0.0.1", PORT)).is_ok() {
        return Err(format!("port {PORT} is taken; stop what listens there").into());
    }
    let words = program.words.iter().map(|word| word.replace("0.0.0.0", "127.0.0.1"));
    println!("── start: {} as {}", program.words.join(" "), program.user);
    let mut command = Command::new("chroot");
    command.arg(format!("--userspec={0}:{0}", program.user)).arg(root).args(words);
    Ok(command.env_clear().env("PATH", "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin").spawn()?)
}

/// A running server, killed on drop.
struct Started(Child);

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn wait_until_ready(mut server: Started) -> Outcome {
    let begun = Instant::now();
    while begun.elapsed() < READY_LIMIT {
        if let Some(status) = server.0.try_wait()? {
            return Err(format!("the station ended unexpectedly: {status}").into());
        }
        if ready().unwrap_or(false) {
            println!("── ready after {:.1} s", begun.elapsed().as_secs_f64());
            run("stop", Command::new("kill").args(["-TERM", &server.0.id().to_string()]))?;
            let status = server.0.wait()?;
            return if status.success() {
                Ok(())
            } else {
                Err(format!("the station did not exit successfully: {status}").into())
            };
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    Err(format!("the station was not ready within {} s", READY_LIMIT.as_secs()).into())
}

fn ready() -> std::io::Result<bool> {
    let mut stream = TcpStream::connect(("127.0.0.1", PORT))?;
    stream.set_read_timeout(Some(Duration::from_secs(2)))?;
    stream.write_all(b"GET /ready HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    Ok(answer.starts_with("HTTP/1.1 200"))
}

/// Checks the service unit's exposure with systemd-analyze, if installed.
fn check_unit() -> Outcome {
    let unit = workspace().join("docker/sheaf.service");
    let mut command = Command::new("systemd-analyze");
    command.args(["security", "--offline=yes", "--threshold=20", "--no-pager"]).arg(unit);
    match command.output() {
        Err(_) => println!("── systemd-analyze is not installed: the unit's exposure is not checked"),
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stdout);
            println!("── {}", text.lines().last().unwrap_or_default());
            if !output.status.success() {
                return Err("docker/sheaf.service is more exposed than 2.0 of 10".into());
            }
        }
    }
    Ok(())
}

/// A path of the image as a path of this machine.
fn inside(root: &Path, path: &str) -> PathBuf {
    root.join(path.trim_start_matches('/'))
}

/// Bind mounts during a command: (from, to). They are made in the command's own mount namespace, so that none remain
/// however the command ends; a remaining mount would be emptied with the folder at the next run.
struct Mounts(Vec<(PathBuf, PathBuf)>);

/// Takes pairs up to `--` and mounts them, then executes the command behind.
const MOUNT_AND_RUN: &str =
    r#"while [ "$1" != -- ]; do mkdir -p "$2"; mount --bind "$1" "$2"; shift 2; done; shift; exec "$@""#;

impl Mounts {
    fn add(&mut self, from: PathBuf, to: PathBuf) {
        self.0.push((from, to));
    }

    fn around(&self, command: &Command) -> Command {
        let mut around = Command::new("unshare");
        around.args(["--mount", "/bin/sh", "-ec", MOUNT_AND_RUN, "sh"]);
        around.args(self.0.iter().flat_map(|(from, to)| [from, to])).arg("--");
        around.arg(command.get_program()).args(command.get_args());
        // The target folder is defined by the image.
        around.env_remove("CARGO_TARGET_DIR");
        around
    }
}
