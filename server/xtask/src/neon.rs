//! `cargo xtask neon`: compiles the tests about instruction sets for aarch64 and runs them in an emulator, to verify on
//! a machine without NEON that it gives the same bits.

use std::process::Command;

use crate::command::{Outcome, cargo, run};
use crate::tools::{ensure_file, ensure_program};

/// The target for Linux on aarch64.
const TARGET: &str = "aarch64-unknown-linux-gnu";
/// Debian's path of its libraries.
const LIBRARIES: &str = "/usr/aarch64-linux-gnu";

/// The crates with code that is compiled for several instruction sets and runs on camera frames.
const PACKAGES: [&str; 3] = ["sheaf-optics", "sheaf-vision", "sheaf-scanning"];

/// Parts of the test names; all other tests do not depend on instruction sets and take an emulator minutes.
const TESTS: [&str; 3] = ["every_instruction_set", "every_architecture", "the_exponential"];

/// Installs what is missing, compiles and runs.
pub fn neon() -> Outcome {
    ensure_program("qemu-aarch64", "qemu-user")?;
    ensure_program("aarch64-linux-gnu-gcc", "gcc-aarch64-linux-gnu")?;
    ensure_file(&format!("{LIBRARIES}/lib/libc.so.6"), "libc6-arm64-cross")?;
    ensure_file(&format!("{LIBRARIES}/lib/crt1.o"), "libc6-dev-arm64-cross")?;
    run("target", Command::new("rustup").args(["target", "add", TARGET]))?;
    let mut tests = cargo(&["test", "--target", TARGET, "--lib"]);
    tests.args(PACKAGES.iter().flat_map(|package| ["--package", package]));
    tests.arg("--").args(TESTS);
    tests.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER", "aarch64-linux-gnu-gcc");
    tests.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER", format!("qemu-aarch64 -L {LIBRARIES}"));
    run("tests on aarch64", &mut tests)
}
