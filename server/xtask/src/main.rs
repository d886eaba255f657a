//! Developer commands: `cargo xtask run` shows the product, `cargo xtask test` checks it.

mod steps;

use std::process::ExitCode;

const HELP: &str = "\
Developer commands:
  cargo xtask run [ARGS…]   build with optimisation and run `sheaf demo ARGS…`
  cargo xtask test          every check: format, clippy, tests, doc tests, documentation, data schemas
  cargo xtask ci            the same as test";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let outcome = match arguments.next().as_deref() {
        Some("run") => steps::run_demo(&arguments.collect::<Vec<_>>()),
        Some("test" | "ci") => steps::test(),
        Some("help" | "--help" | "-h") => {
            println!("{HELP}");
            Ok(())
        }
        _ => {
            eprintln!("{HELP}");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error}");
            ExitCode::FAILURE
        }
    }
}
