//! Tools required by the checks beside Rust, installed by name if missing.

use std::path::{Path, PathBuf};
use std::process::Command;

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
        ensure_apt("python3-venv")?;
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
    let on_path = std::env::var_os("PATH")
        .is_some_and(|path| std::env::split_paths(&path).any(|folder| folder.join(program).is_file()));
    if on_path || Path::new("/usr/sbin").join(program).is_file() { Ok(()) } else { ensure_apt(package) }
}

/// Installs the Debian package of a file unless the file exists.
pub fn ensure_file(file: &str, package: &str) -> Outcome {
    if Path::new(file).is_file() { Ok(()) } else { ensure_apt(package) }
}

/// Cargo's arguments for everything that needs the C library of GenICam cameras.
pub const GENICAM: &[&str] = &["--features", "sheaf/genicam"];

/// Whether that library is installed.
pub fn has_aravis() -> bool {
    succeeds(Command::new("pkg-config").args(["--exists", "aravis-0.8", "libusb-1.0"]))
}

/// Installs the C library of GenICam cameras with its link dependencies, and the camera process for the driver's tests.
pub fn ensure_genicam() -> Outcome {
    ensure_program("pkg-config", "pkg-config")?;
    for (library, package) in [("aravis-0.8", "libaravis-dev"), ("libusb-1.0", "libusb-1.0-0-dev")] {
        if !succeeds(Command::new("pkg-config").args(["--exists", library])) {
            ensure_apt(package)?;
        }
    }
    ensure_program("arv-fake-gv-camera-0.8", "aravis-tools")
}

/// Installs the MQTT broker that the tests of doors publish to, and its client.
pub fn ensure_broker() -> Outcome {
    ensure_program("mosquitto", "mosquitto")?;
    ensure_program("mosquitto_sub", "mosquitto-clients")
}

/// Installs a Debian package.
pub fn ensure_apt(package: &str) -> Outcome {
    say(&format!("── installing the Debian package {package}"));
    let missing =
        |error| format!("{package} is missing and could not be installed ({error}); install it and repeat");
    let install = ["install", "--yes", "--no-install-recommends", package];
    run("apt-get", Command::new("apt-get").args(["update", "--quiet"])).map_err(missing)?;
    run("apt-get", Command::new("apt-get").args(install).env("DEBIAN_FRONTEND", "noninteractive"))
        .map_err(missing)?;
    Ok(())
}
