//! Tools required by the checks beside Rust, installed by name if missing.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::command::{Outcome, run, say, succeeds, target_folder, workspace};

/// A separate Python environment with the packages of `server/cli/tests/requirements.txt`.
pub fn ensure_python() -> Outcome<PathBuf> {
    let requirements = workspace().join("server/cli/tests/requirements.txt");
    let folder = target_folder().join("python");
    let python = folder.join("bin/python");
    let stamp = folder.join("requirements.txt");
    let wanted = std::fs::read(&requirements)?;
    if std::fs::read(&stamp).is_ok_and(|present| present == wanted)
        && succeeds(Command::new(&python).arg("--version"))
    {
        return Ok(python);
    }
    if !succeeds(Command::new("python3").args(["-c", "import venv, ensurepip"])) {
        ensure_apt(&["python3-venv"])?;
    }
    run("python", Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
    let mut pip = Command::new(&python);
    run("pip", pip.args(["-m", "pip", "install", "--quiet", "--requirement"]).arg(&requirements))?;
    std::fs::write(stamp, wanted)?;
    Ok(python)
}

/// The `node_modules` of the packages in `server/cli/tests/package.json`, below the target folder.
pub fn ensure_node_modules() -> Outcome<PathBuf> {
    let (sources, folder) = (workspace().join("server/cli/tests"), target_folder().join("node"));
    std::fs::create_dir_all(&folder)?;
    for name in ["package.json", "package-lock.json"] {
        std::fs::copy(sources.join(name), folder.join(name))?;
    }
    ensure_packages(&folder)?;
    Ok(folder.join("node_modules"))
}

/// Installs the packages of `package.json` in a folder, in the versions of its lock file.
pub fn ensure_packages(folder: &Path) -> Outcome {
    let wanted = std::fs::read(folder.join("package-lock.json"))?;
    let stamp = folder.join("node_modules/.installed-lock.json");
    if std::fs::read(&stamp).is_ok_and(|present| present == wanted) {
        return Ok(());
    }
    run("packages", npm(folder).args(["ci", "--no-audit", "--no-fund"])).map_err(|cause| {
        format!("{cause}; this needs Node 18.13 or newer with npm, and its registry within reach")
    })?;
    std::fs::write(stamp, wanted)?;
    Ok(())
}

/// npm in this folder.
pub fn npm(folder: &Path) -> Command {
    let mut command = Command::new("npm");
    command.current_dir(folder);
    command
}

/// Installs a program's Debian package unless the program exists.
pub fn ensure_program(program: &str, package: &str) -> Outcome {
    if is_installed(program) { Ok(()) } else { ensure_apt(&[package]) }
}

fn is_installed(program: &str) -> bool {
    let on_path = std::env::var_os("PATH")
        .is_some_and(|path| std::env::split_paths(&path).any(|folder| folder.join(program).is_file()));
    on_path || Path::new("/usr/sbin").join(program).is_file()
}

/// Installs the Debian package of a file unless the file exists.
pub fn ensure_file(file: &str, package: &str) -> Outcome {
    if Path::new(file).is_file() { Ok(()) } else { ensure_apt(&[package]) }
}

/// Cargo's arguments for everything that needs the C library of GenICam cameras.
pub const GENICAM: &[&str] = &["--features", "sheaf/genicam"];

/// Whether that library is installed.
pub fn has_aravis() -> bool {
    succeeds(Command::new("pkg-config").args(["--exists", "aravis-0.8", "libusb-1.0"]))
}

/// Installs the C library of GenICam cameras with its link dependencies, and for the driver's tests the camera process and
/// what gives each of them a network of its own.
pub fn ensure_genicam() -> Outcome {
    ensure_program("pkg-config", "pkg-config")?;
    let is_missing = |library: &str| !succeeds(Command::new("pkg-config").args(["--exists", library]));
    let libraries = [("aravis-0.8", "libaravis-dev"), ("libusb-1.0", "libusb-1.0-0-dev")];
    let missing = libraries.into_iter().filter(|(library, _)| is_missing(library)).map(|(_, package)| package);
    let programs = [("arv-fake-gv-camera-0.8", "aravis-tools"), ("ip", "iproute2")];
    let programs = programs.into_iter().filter(|(program, _)| !is_installed(program)).map(|(_, package)| package);
    ensure_apt(&missing.chain(programs).collect::<Vec<_>>())
}

/// Installs the MQTT broker that the tests of doors publish to, and its client.
pub fn ensure_broker() -> Outcome {
    let packages = [("mosquitto", "mosquitto"), ("mosquitto_sub", "mosquitto-clients")];
    let missing = packages.into_iter().filter(|(program, _)| !is_installed(program)).map(|(_, package)| package);
    ensure_apt(&missing.collect::<Vec<_>>())
}

/// Installs Debian packages. The lists of packages are updated once.
fn ensure_apt(packages: &[&str]) -> Outcome {
    static UPDATED: OnceLock<Result<(), String>> = OnceLock::new();
    if packages.is_empty() {
        return Ok(());
    }
    let names = packages.join(", ");
    say(&format!("── installing Debian packages: {names}"));
    let missing =
        |error| format!("{names}: missing, and could not be installed ({error}); install them and repeat");
    let update = || run("apt-get", Command::new("apt-get").args(["update", "--quiet"])).map_err(|e| e.to_string());
    UPDATED.get_or_init(update).clone().map_err(missing)?;
    let mut install = Command::new("apt-get");
    install.args(["install", "--yes", "--no-install-recommends"]).args(packages);
    run("apt-get", install.env("DEBIAN_FRONTEND", "noninteractive")).map_err(|e| missing(e.to_string()))?;
    Ok(())
}
