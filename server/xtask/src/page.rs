//! Steps of the web page: packages, build, checks, and the tests in a real browser.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::command::{Outcome, run, workspace};
use crate::tools::{ensure_file, ensure_packages, ensure_program, npm};

/// Sources of the built page.
const SOURCES: [&str; 6] = ["src", "public", "index.html", "vite.config.ts", "tsconfig.json", "package-lock.json"];

/// Builds the page into `web/dist`, from which it is embedded in the program; does nothing if it is newer than its sources.
pub fn ensure_page() -> Outcome {
    let web = workspace().join("web");
    ensure_packages(&web)?;
    let built = modified(&web.join("dist/index.html"));
    let changed = SOURCES.iter().filter_map(|source| newest(&web.join(source))).max();
    if built.is_some() && built >= changed {
        return Ok(());
    }
    run("page", npm(&web).args(["run", "--silent", "build"]))
}

/// Lint, types, unit tests, and agreement of the client with the API document.
pub fn check_page() -> Outcome {
    let web = workspace().join("web");
    for script in ["lint", "types", "test"] {
        run(script, npm(&web).args(["run", "--silent", script]))?;
    }
    Ok(())
}

/// Installs Debian's Chromium without windows, which needs less time than the one with, and a font, which a minimal Debian
/// lacks.
pub fn ensure_browser() -> Outcome {
    ensure_program("chromium-headless-shell", "chromium-headless-shell")?;
    ensure_file("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "fonts-dejavu-core")
}

/// Tests the page in Chromium against the real program, which must be built before.
pub fn test_in_browser(program: &Path) -> Outcome {
    let web = workspace().join("web");
    run("browser", npm(&web).args(["run", "--silent", "browser"]).env("SHEAF_BIN", program))
}

/// Writes the client's types from the API document.
pub fn write_schema() -> Outcome {
    let web = workspace().join("web");
    ensure_packages(&web)?;
    run("schema", npm(&web).args(["run", "--silent", "schema"]))
}

fn modified(file: &Path) -> Option<SystemTime> {
    std::fs::metadata(file).ok()?.modified().ok()
}

/// Modification time of the newest file under a path.
fn newest(path: &Path) -> Option<SystemTime> {
    if path.is_file() {
        return modified(path);
    }
    let entries: Vec<PathBuf> = std::fs::read_dir(path).ok()?.flatten().map(|entry| entry.path()).collect();
    // The folder's own time shows removed files.
    entries.iter().filter_map(|entry| newest(entry)).chain(modified(path)).max()
}
